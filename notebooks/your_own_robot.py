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
# # Your own robot: from nothing to a model
#
# This notebook writes a small URDF, designs an experiment, plays it on a virtual robot, and identifies a model.
# With a real robot, replace the URDF by yours and the virtual log by that of your controller.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import oed
from estimation import identify, predict
from robots import Sensors, load_robot, nominal_plant, simulate

# %% [markdown]
# ## The URDF
#
# Three joints are enough here. Each joint needs limits of position, velocity and effort. Each link needs an inertial.
# The numbers of the inertials may be rough: they are where the design starts, and are not used by the fit alone.

# %%
LINKS = {"base": (8.0, 0.05), "shoulder": (5.0, 0.10), "upper": (4.0, 0.20), "fore": (2.0, 0.15)}
JOINTS = [
    ("j1", "base", "shoulder", "0 0 0.15", "0 0 1", 2.8, 2.0, 120),
    ("j2", "shoulder", "upper", "0 0.1 0.1", "0 1 0", 1.6, 2.0, 120),
    ("j3", "upper", "fore", "0 0 0.4", "0 1 0", 2.2, 2.5, 60),
]


def link_xml(name, mass, height):
    """A link with its centre of mass on the z axis, of the inertia of a rod."""
    side, axis = mass * height**2 / 3 + 0.01, 0.02
    return (
        f'<link name="{name}"><inertial><origin xyz="0.01 0.01 {height}"/><mass value="{mass}"/>'
        f'<inertia ixx="{side}" iyy="{side}" izz="{axis}" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )


def joint_xml(name, parent, child, origin, axis, reach, speed, torque):
    """A revolute joint with symmetric limits."""
    return (
        f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{origin}"/><axis xyz="{axis}"/>'
        f'<limit lower="{-reach}" upper="{reach}" velocity="{speed}" effort="{torque}"/></joint>'
    )


folder = Path(tempfile.mkdtemp())
urdf = folder / "my_robot.urdf"
parts = [link_xml(name, *values) for name, values in LINKS.items()] + [joint_xml(*joint) for joint in JOINTS]
urdf.write_text(f'<robot name="my_robot">{"".join(parts)}</robot>')
robot = load_robot(str(urdf))
print(robot.name, robot.joint_names)
print("limits that the URDF does not state, and that were assumed:", ", ".join(robot.assumed) or "none")

# %% [markdown]
# ## Design
#
# The search is short. The columns are those of the model that the fit will have.

# %%
QUICK = oed.Effort(islands=1, starts=1, hops=0, finish_samples=100)


def designed(seed):
    """A short search; the seed gives another motion."""
    return oed.design(
        robot,
        model=oed.ModelOptions(friction="coulomb-viscous"),
        trajectory=oed.TrajectoryOptions(periods=1),
        search=oed.SearchOptions(effort=QUICK, workers=1, seed=seed),
    )


design = designed(1)
print(design.summary())
design.save(folder)

# %% [markdown]
# ## Log and model
#
# The virtual robot differs from the URDF by up to a fifth, and its torque has 2 % of coloured noise. It has friction,
# which the URDF does not state.

# %%
FRICTION = {"f1_1": 6.0, "f1_2": 7.0, "f1_3": 3.0, "f2_1": 4.0, "f2_2": 5.0, "f2_3": 2.0}  # [N m], [N m s/rad]
plant = nominal_plant(
    robot,
    friction="coulomb-viscous",
    spread=0.2,
    seed=2,
    sensors=Sensors(torque_noise=0.02),
    overrides=FRICTION,
)
estimate = identify(robot, simulate(plant, design.motion, seed=3), friction="coulomb-viscous")
print(estimate.summary())
estimate.save(folder)

# %% [markdown]
# ## Proof on another motion

# %%
prediction = predict(estimate.model, simulate(plant, designed(5).motion, seed=4))
print(prediction.summary())

# %% [markdown]
# ## The picture
#
# Friction of each joint: identified with the 95 % interval, and true.

# %%
values = dict(zip(estimate.model.names, estimate.model.values, strict=True))
errors = dict(zip(estimate.model.names, estimate.model.standard_errors, strict=True))
truth = dict(zip(plant.model.names, plant.parameters, strict=True))
figure, axes = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
names = [name for name in values if name.startswith(("f1_", "f2_"))]
at = np.arange(len(names))
half = [1.96 * errors[name] for name in names]
axes[0].errorbar(at, [values[n] for n in names], half, fmt="o", capsize=4, label="identified")
axes[0].plot(at, [truth[n] for n in names], "x", color="tab:red", label="true")
axes[0].set_xticks(at, names)
axes[0].set_ylabel("f1 [N m], f2 [N m s/rad]")
axes[0].legend()
t = prediction.motion.t - prediction.motion.t[0]
axes[1].plot(t, prediction.measured[:, 1], color="black", linewidth=0.8, label="measured")
axes[1].plot(t, prediction.predicted[:, 1], color="tab:orange", label="predicted")
axes[1].set(xlabel="time [s]", ylabel="torque of joint 2 [N m]", title="a motion that the fit has not seen")
axes[1].legend()
plt.show()
