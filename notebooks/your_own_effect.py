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
# # Your own effect
#
# The catalogue of effects is open. This notebook adds a hose that pulls at a joint beyond some angle. A virtual robot
# has such a hose, and the diagnosis finds it.
#
# The class is that of `examples/extending/effect.py`. It is read from there, so that both stay the same.

# %%
import inspect
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import oed
from estimation import diagnose
from robots import Sensors, load_robot, nominal_plant, simulate
from robots.plants import plant_effect
from robots.terms.effects import EFFECTS

notebook = Path(__file__) if "__file__" in globals() else Path.cwd() / "notebook"
sys.path.insert(0, str(notebook.resolve().parents[1] / "examples" / "extending"))
from effect import TightHose

print(inspect.getsource(TightHose))

# %% [markdown]
# ## A robot that has it
#
# A registered class is known to the simulator and the diagnosis.

# %%
if "tight_hose" not in EFFECTS:
    EFFECTS.register(TightHose)
TRUE = {"hose_stiffness": 12.0, "free_angle": 0.2}  # [N m/rad2], [rad]
JOINT = 2
robot = load_robot("er3a")
plant = nominal_plant(
    robot,
    friction="coulomb-viscous",
    spread=0.1,
    seed=1,
    sensors=Sensors(torque_noise=0.02),
    effects=(plant_effect(robot, "tight_hose", JOINT, TRUE),),
)


def record(seed):
    """Plays a motion that a short search designed."""
    effort = oed.Effort(islands=1, starts=1, hops=0, finish_samples=100)
    motion = oed.design(
        robot,
        search=oed.SearchOptions(effort=effort, workers=1, seed=seed),
        trajectory=oed.TrajectoryOptions(periods=1),
    ).motion
    return simulate(plant, motion, seed=seed)


log, held_out = record(0), record(1)

# %% [markdown]
# ## Diagnosis
#
# The new effect competes with a spring and with the Stribeck effect.

# %%
diagnosis = diagnose(
    robot, log, held_out=held_out, friction="coulomb-viscous", candidates=[TightHose(), "spring", "stribeck"]
)
print(diagnosis.summary())

# %% [markdown]
# ## The picture
#
# The torque of the hose over the position of the joint: identified and true.

# %%
finding = diagnosis.findings[0]
found = {parameter.name.split("[")[0]: parameter.value for parameter in finding.parameters}
print({name: round(value, 3) for name, value in found.items()}, "true:", TRUE)
q = held_out.q[:, JOINT - 1]
angle = np.linspace(q.min(), q.max(), 200)
figure, axes = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
for values, style, label in ((found, "-", "identified"), (TRUE, "--", "true")):
    pull = values["hose_stiffness"] * np.maximum(angle - values["free_angle"], 0.0) ** 2
    axes[0].plot(angle, pull, style, label=label)
axes[0].set(xlabel=f"position of joint {JOINT} [rad]", ylabel="torque of the hose [N m]")
axes[0].legend()
joints = np.arange(1, robot.n + 1)
axes[1].bar(joints - 0.2, 100 * diagnosis.baseline, 0.4, label="usual model")
axes[1].bar(joints + 0.2, 100 * diagnosis.extended, 0.4, label="with the hose")
axes[1].set(xlabel="joint", ylabel="held-out error over torque [%]")
axes[1].legend()
plt.show()
