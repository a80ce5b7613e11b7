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
# # First tour: design, experiment, identification, prediction
#
# This tour uses a virtual ER3A, so it runs without a robot. With a real robot, send `trajectory.csv` to the controller
# and read its log instead of the one of `simulate`.
#
# The true parameters of the virtual robot differ by a fifth from its description.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import oed
from estimation import identify, load_model, predict, read_log, write_log
from robots import Sensors, load_robot, nominal_plant, simulate

folder = Path(tempfile.mkdtemp())
robot = load_robot("er3a")
print(robot.name, robot.joint_names)
print("assumed values, without a source:", ", ".join(robot.assumed))

# %% [markdown]
# ## Design
#
# This is a quick search. The criterion is the condition number of the regressor Y, unscaled and in SI units. Y has a
# column for each parameter that can be identified: 36 of the rigid body, 4 rotor inertias, and Coulomb and viscous
# friction of six joints.

# %%
design = oed.design(
    robot,
    model=oed.ModelOptions(friction="coulomb-viscous"),
    search=oed.SearchOptions(effort="quick", seed=1),
)
print(design.summary())
design.save(folder)  # trajectory.csv for the controller, design.json for the record

# %% [markdown]
# The plot shows each joint's velocity as a share of its limit. Three periods of the Fourier series come first. One
# velocity stroke a joint follows, to its velocity bound and back.

# %%
_, axes = plt.subplots(figsize=(9, 4))
design.plot(ax=axes)
plt.show()

# %% [markdown]
# The smallest margins to the limits, computed from the samples of the file:

# %%
for margin in sorted(design.check(), key=lambda margin: margin.slack_fraction)[:5]:
    print(
        f"{margin.quantity:13} joint {margin.joint}: {margin.value:8.3f} of {margin.limit:8.3f} at {margin.time:.1f} s"
    )

# %% [markdown]
# ## Experiment
#
# The log has positions in encoder steps, and torques with 2 % of coloured noise.

# %%
plant = nominal_plant(robot, spread=0.2, seed=3, sensors=Sensors(torque_noise=0.02))
write_log(folder / "log.csv", simulate(plant, design.motion, seed=4))
log = read_log(folder / "log.csv")
print(f"{len(log)} samples of {log.n} joints, {log.duration:.1f} s")

# %% [markdown]
# ## Identification
#
# Only `t`, `q` and `tau` are used. The columns are shares of the joint's torque RMS: the error of the fit, of blocks
# left out of the fit, of a constant, and of the robot's description.

# %%
estimate = identify(robot, log, friction="coulomb-viscous")
print(estimate.summary())
table = estimate.model.to_frame()
print(table[["value", "standard_error", "percent", "unit"]].head(12).to_string(float_format="%.4g"))

# %%
_, axes = plt.subplots(figsize=(5, 5))
estimate.plot(ax=axes)
plt.show()

# %% [markdown]
# The true values are known here. The error of an estimate, divided by its standard error, should be about as large as a
# standard normal variable.

# %%
truth = dict(zip(plant.model.names, plant.parameters, strict=True))
friction = [name for name in estimate.model.names if name.startswith(("f1", "f2"))]
values = dict(zip(estimate.model.names, estimate.model.values, strict=True))
errors = dict(zip(estimate.model.names, estimate.model.standard_errors, strict=True))
score = np.array([(values[name] - truth[name]) / errors[name] for name in friction])
print(f"friction parameters: RMS of error over standard error {np.sqrt(np.mean(score**2)):.2f}")

# %% [markdown]
# ## Prediction
#
# The model predicts the torque of a held-out motion. It needs only its positions.

# %%
estimate.save(folder)
model = load_model(folder)
other = oed.design(
    robot,
    model=oed.ModelOptions(friction="coulomb-viscous"),
    search=oed.SearchOptions(effort=oed.Effort(islands=1, starts=1, hops=0), seed=2),
)
unseen = simulate(plant, other.motion, seed=5)
prediction = predict(model, unseen)
print(prediction.summary())

# %%
_, axes = plt.subplots(figsize=(9, 4))
axes.plot(unseen.t, prediction.measured[:, 1], label="measured")
axes.plot(unseen.t, prediction.predicted[:, 1], label="predicted")
axes.set_xlabel("time [s]")
axes.set_ylabel("torque of joint 2 [N m]")
axes.legend()
plt.show()
