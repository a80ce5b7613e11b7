# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Drives of an arm that logs no torque
#
# Hobby arms log commands and positions. MuJoCo plays a virtual arm of two servos here: friction that sticks, a delayed
# command, encoders with 4096 steps a turn, and a dead band on the second joint that nobody knows of. The simulation
# that one would use has other friction, other rotor inertia, no delay and no dead band.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import mujoco
import numpy as np

from estimation.actuators import identify_actuators
from estimation.actuators.exports import drives_mjcf
from robots import Log
from robots.drives import described_drives, load_branches

ARM = """
<mujoco model="two servos"><compiler angle="radian"/><option timestep="{step}" integrator="RK4"/><worldbody>
<body name="upper" pos="0 0 0.1"><inertial mass="0.25" pos="0 0 0.06" diaginertia="4e-4 4e-4 1e-4"/>
<joint name="shoulder" axis="0 1 0" armature="{armature}" damping="{viscous}" frictionloss="{coulomb}"
 solreffriction="{stick} 1" solimpfriction="0.999 0.9999 0.0001"/>
<body name="fore" pos="0 0 0.12"><inertial mass="0.15" pos="0 0 0.05" diaginertia="2e-4 2e-4 5e-5"/>
<joint name="elbow" axis="0 1 0" armature="{armature}" damping="{viscous}" frictionloss="{coulomb}"
 solreffriction="{stick} 1" solimpfriction="0.999 0.9999 0.0001"/></body></body></worldbody><actuator>
<position joint="shoulder" kp="17.8" kv="0.6" forcerange="-3.3 3.3"/>
<position joint="elbow" kp="17.8" kv="0.6" forcerange="-3.3 3.3"/></actuator></mujoco>"""
STEP, PERIOD, DELAY, DEAD_BAND = 2e-4, 5e-3, 0.012, 0.015
described = ARM.format(step=STEP, stick=2 * STEP, armature=0.01, viscous=0.1, coulomb=0.1)
TRUE = {"armature": 0.028, "viscous": 0.3, "coulomb": 0.06}
plant = ARM.format(step=STEP, stick=2 * STEP, **TRUE)

# %% [markdown]
# ## Two runs of other motions
#
# Commands are held for 5 ms. The servo sees them 12 ms later.


# %%
def run(seed: int, seconds: float = 8.0) -> Log:
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds / PERIOD)) * PERIOD
    frequencies = np.geomspace(0.2, 3.0, 6)
    waves = [np.sin(2 * np.pi * np.outer(t, frequencies) + rng.uniform(0, 6.28, 6)) for _ in range(2)]
    command = np.column_stack([wave @ (0.3 / np.sqrt(frequencies)) for wave in waves])
    command = np.array([0.3, 0.6]) + command * np.minimum(1, t / 0.5)[:, None]
    model = mujoco.MjModel.from_xml_string(plant)
    data = mujoco.MjData(model)
    data.qpos[:] = command[0]
    q = np.empty_like(command)
    for k in range(len(t)):
        q[k] = np.round(data.qpos * 4096 / (2 * np.pi)) / 4096 * 2 * np.pi
        for step in range(round(PERIOD / STEP)):
            wanted = command[max(0, int(np.floor((k * PERIOD + step * STEP - DELAY) / PERIOD + 1e-9)))].copy()
            error = wanted[1] - data.qpos[1]
            wanted[1] = data.qpos[1] + error - np.clip(error, -DEAD_BAND, DEAD_BAND)
            data.ctrl[:] = wanted
            mujoco.mj_step(model, data)
    return Log(t=t, q=q, command=command, name=f"run {seed}")


log, held_out = run(1), run(2)

# %% [markdown]
# ## The drives
#
# The description is what the simulation has. Its position actuators state the control law.

# %%
folder = Path(tempfile.mkdtemp())
(folder / "arm.xml").write_text(described)
chains = load_branches(folder / "arm.xml")
result = identify_actuators(chains, log, described_drives(chains).drives, held_out=held_out)
result

# %% [markdown]
# The dead band is found and measured, and the values are those of the plant:

# %%
for name, true in TRUE.items():
    for joint in result.joints:
        value = result.value(name, joint)
        print(f"{name:9} {joint:9} {value.value:.4f} ({value.lower:.4f} to {value.upper:.4f}), true {true}")
delay = result.value("delay", "shoulder")
band = result.value("dead_band", "elbow")
print(f"delay {1e3 * delay.value:.2f} ms, true {1e3 * DELAY:g}")
print(f"dead band {1e3 * band.value:.2f} mrad, true {1e3 * DEAD_BAND:g}")

# %% [markdown]
# ## The motion on the run that nothing was fitted to

# %%
trace = result.traces[0]
figure, axes = plt.subplots(2, 1, sharex=True, figsize=(8, 5))
axes[0].plot(trace.t, trace.command[:, 1], ":", label="command")
axes[0].plot(trace.t, trace.measured[:, 1], label="measured")
axes[0].plot(trace.t, trace.identified[:, 1], "--", label="simulated")
axes[0].set_ylabel("elbow [rad]")
axes[0].legend()
axes[1].plot(trace.t, 1e3 * (trace.measured - trace.described)[:, 1], label="as described")
axes[1].plot(trace.t, 1e3 * (trace.measured - trace.identified)[:, 1], label="identified")
axes[1].set_ylabel("error [mrad]")
axes[1].set_xlabel("time [s]")
axes[1].legend()
figure

# %% [markdown]
# ## Back into MuJoCo
#
# The file states rotor inertia, friction, gains and delay. It cannot state the dead band, and says so.

# %%
written = drives_mjcf(result, folder)
(folder / "drives.xml").write_text(written.text)
written.remarks
