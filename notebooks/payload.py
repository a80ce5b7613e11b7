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
# # The payload of a tool from two logs
#
# A robot plays one path twice: without a tool and with it. The difference of the torques gives mass, centre of mass and
# inertia of the tool. Only the geometry of the robot must be known.
#
# The robot is a virtual UR10 of `oed.benchmarks.truth`. This plant is independent: it uses pinocchio, and none of the
# code that identifies. It has friction, noise, and encoders with finite resolution.

# %%
import tempfile
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pinocchio as pin

from estimation import identify_payload
from oed.benchmarks.truth.description import write_description
from oed.benchmarks.truth.dynamics import with_tool
from oed.benchmarks.truth.machines import draw_machine
from oed.benchmarks.truth.noise import draw_noise
from oed.benchmarks.truth.plant import play
from oed.benchmarks.truth.references import draw_periodic
from robots import Log, load_robot

rng = np.random.default_rng(11)
machine = draw_machine("ur10", rng)
robot = load_robot(write_description(machine, Path(tempfile.mkdtemp())))
noise = draw_noise(machine.n, machine.gear, rng)
path = draw_periodic(machine, rng, period=10.0, cycles=2)

# %% [markdown]
# ## The tool
#
# It is a box with its centre in front of the flange, and off the axis.

# %%
tool = pin.Inertia.FromBox(2.0, 0.12, 0.08, 0.10)
tool.lever = np.array([0.02, -0.015, 0.07])
flange = pin.SE3(robot.chain.tip[:3, :3], robot.chain.tip[:3, 3])
carrying = replace(machine, model=with_tool(machine.model, flange.act(tool)))


# %% [markdown]
# ## Two logs of one path


# %%
def record(robot_now, name):
    """Plays the path, and keeps what a controller records: t, q, tau."""
    played = play(robot_now, [path], [], noise, rng)[0]
    return Log(played.t, played.q, played.tau, name=name)


without, loaded = record(machine, "without tool"), record(carrying, "with tool")
print(f"two logs of {without.duration:.0f} s")

# %% [markdown]
# ## Identification

# %%
payload = identify_payload(loaded, robot=robot, without=without)
print(payload.summary())

# %% [markdown]
# The truth is known here. The table shows estimates, 95 % intervals, and true values.

# %%
true_values = np.array([tool.mass, *tool.lever, *tool.inertia[np.triu_indices(3)]])
for item, true in zip(payload.quantities, true_values, strict=True):
    print(f"{item.name:8} {item.value:9.4f} ({item.lower:9.4f} to {item.upper:9.4f})   true {true:8.4f} {item.unit}")

# %% [markdown]
# ## The picture
#
# The error of each quantity as a share of the half-width of its interval. Between the lines the interval holds the
# truth.

# %%
errors = [
    (item.value - true) / ((item.upper - item.lower) / 2)
    for item, true in zip(payload.quantities, true_values, strict=True)
]
figure, axes = plt.subplots(1, 2, figsize=(11, 4), layout="constrained")
wrist = 1
axes[0].plot(without.t - without.t[0], without.tau[:, wrist], label="without tool", linewidth=0.8)
axes[0].plot(loaded.t - loaded.t[0], loaded.tau[:, wrist], label="with tool", linewidth=0.8)
axes[0].set(xlabel="time [s]", ylabel=f"torque of joint {wrist + 1} [N m]")
axes[0].legend()
axes[1].axhspan(-1, 1, color="tab:green", alpha=0.15, label="95 % interval")
axes[1].plot(range(len(errors)), errors, "o", color="black")
axes[1].set_xticks(range(len(errors)), [item.name for item in payload.quantities], rotation=45)
axes[1].set_ylabel("error over half-width of the interval")
axes[1].legend()
plt.show()
