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
# # A MuJoCo model is corrected
#
# A MuJoCo model has rough masses and friction, and lacks a spring. The logs come from another MuJoCo model, the real
# robot of this notebook. The diagnosis finds the spring and writes a corrected MJCF. Both models then follow a motion
# that the diagnosis has not seen.
#
# Install MuJoCo with `pip install "robot-oed[mujoco]"`. Without it the notebook is skipped.

# %%
import importlib.util
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from estimation import diagnose, export_mjcf
from robots import Log, load_robot

available = importlib.util.find_spec("mujoco") is not None
if available:
    import mujoco
else:
    print("MuJoCo is not installed; the rest is skipped.")

# %% [markdown]
# ## The two models
#
# A value of the real robot replaces each one that the original model has wrong.

# %%
ORIGINAL = {"upper": 4.0, "fore": 2.0, "damping": 2.0, "friction": 3.0, "stiffness": 0.0, "rest": 0.0}
REAL = {"upper": 4.6, "fore": 1.7, "damping": 2.5, "friction": 3.6, "stiffness": 15.0, "rest": 0.3}
STEP, EVERY, PERIOD, PERIODS = 0.0005, 8, 10.0, 2
DRY = f'solreffriction="{2 * STEP} 1"'  # stiff dry friction; by default it fades at low speed
TEMPLATE = """<mujoco model="arm">
<compiler angle="radian"/>
<option timestep="{step}" integrator="implicitfast"/>
<worldbody><body name="turret" pos="0 0 0.3">
  <inertial pos="0 0 0.05" mass="5" diaginertia="0.05 0.05 0.04"/>
  <joint name="j1" axis="0 0 1" range="-3 3" damping="{damping}" frictionloss="{friction}" armature="0.3" {dry}/>
  <body name="upper" pos="0 0.1 0.1">
    <inertial pos="0.02 0 0.2" mass="{upper}" diaginertia="0.08 0.08 0.01"/>
    <joint name="j2" axis="0 1 0" range="-2 2" damping="{damping}" frictionloss="{friction}" armature="0.3"
      stiffness="{stiffness}" springref="{rest}" {dry}/>
    <body name="fore" pos="0 0 0.4">
      <inertial pos="0.01 0 0.15" mass="{fore}" diaginertia="0.02 0.02 0.004"/>
      <joint name="j3" axis="0 1 0" range="-2.5 2.5" damping="{damping}" frictionloss="{friction}" armature="0.1"
        {dry}/>
</body></body></body></worldbody>
<actuator><motor joint="j1"/><motor joint="j2"/><motor joint="j3"/></actuator></mujoco>"""


def reference(seed):
    """Positions and velocities of a periodic motion (N, 3), slow at first."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, PERIOD * PERIODS, STEP)
    angle = 2 * np.pi / PERIOD * t[:, None] * np.arange(1, 6)
    waves = np.sin(angle) @ rng.normal(size=(5, 3)) + np.cos(angle) @ rng.normal(size=(5, 3))
    x = np.clip(np.minimum(t, t[-1] - t) / 2, 0, 1)[:, None]
    q = waves / np.abs(waves).max(axis=0) * [1.5, 1.1, 1.3] * (10 * x**3 - 15 * x**4 + 6 * x**5)
    return q, np.gradient(q, STEP, axis=0)


def play(path, motion):
    """Runs a position loop in MuJoCo; positions and torques at 250 Hz."""
    model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT
    data = mujoco.MjData(model)
    data.qpos[:] = motion[0][0]
    rows = []
    for k, (q, dq) in enumerate(zip(*motion, strict=True)):
        data.ctrl[:] = [3000, 3000, 1500] * (q - data.qpos) + [150, 150, 50] * (dq - data.qvel)
        if k % EVERY == 0:
            rows.append((data.qpos.copy(), data.ctrl.copy()))
        mujoco.mj_step(model, data)
    return tuple(np.array(column) for column in zip(*rows, strict=True))


# %% [markdown]
# ## Logs of the real robot

# %%
if available:
    folder = Path(tempfile.mkdtemp())
    for name, values in (("original", ORIGINAL), ("real", REAL)):
        (folder / f"{name}.xml").write_text(TEMPLATE.format(step=STEP, dry=DRY, **values))
    rng = np.random.default_rng(0)
    logs = []
    for number in range(3):
        q, tau = play(folder / "real.xml", reference(number))
        t = number * 60.0 + np.arange(len(q)) * STEP * EVERY
        noise = 0.01 * tau.std(axis=0) * rng.normal(size=tau.shape)
        logs.append(Log(t, q + 2e-5 * rng.normal(size=q.shape), tau + noise, name=f"log {number + 1}"))

# %% [markdown]
# ## Diagnosis and corrected model

# %%
if available:
    robot = load_robot(str(folder / "original.xml"))
    diagnosis = diagnose(
        robot,
        logs[:2],
        held_out=logs[2],
        friction="coulomb-viscous",
        candidates=["spring", "stribeck", "asymmetric_friction"],
    )
    print(diagnosis.summary())
    written = export_mjcf(diagnosis.model, folder / "corrected.xml", robot=robot)
    print(*written.remarks, sep="\n")

# %% [markdown]
# ## Both models on a new motion
#
# Each model runs under the same position loop. Its torque is compared with that of the real robot.

# %%
if available:
    unseen = reference(99)
    torque = {name: play(folder / f"{name}.xml", unseen)[1] for name in ("real", "original", "corrected")}
    torque_errors = {
        name: np.sqrt(np.mean((torque[name] - torque["real"]) ** 2, axis=0)) for name in ("original", "corrected")
    }
    for name, error in torque_errors.items():
        print(f"{name:9}: torque error RMS " + ", ".join(f"{value:.3f}" for value in error) + " N m")

# %% [markdown]
# ## The picture

# %%
if available:
    figure, axes = plt.subplots(1, 2, figsize=(11, 4), layout="constrained", width_ratios=(2, 1))
    t = np.arange(len(torque["real"])) * STEP * EVERY
    axes[0].plot(t, torque["real"][:, 1], color="black", label="real robot")
    axes[0].plot(t, torque["original"][:, 1], ":", label="original model")
    axes[0].plot(t, torque["corrected"][:, 1], "--", label="corrected model")
    axes[0].set(xlabel="time [s]", ylabel="torque of joint 2 [N m]")
    axes[0].legend()
    for shift, (name, error) in zip((-0.2, 0.2), torque_errors.items(), strict=True):
        axes[1].bar(np.arange(1, 4) + shift, error, 0.4, label=name)
    axes[1].set(xlabel="joint", ylabel="torque error RMS [N m]", xticks=[1, 2, 3])
    axes[1].legend()
    plt.show()
