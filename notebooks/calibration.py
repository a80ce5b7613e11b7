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
# # The geometry of a robot from measured poses
#
# A robot stands where its description does not say: joint zeros are off by some mrad, a link is a millimetre longer, an
# encoder is eccentric. A tracker measures three markers at some poses. The calibration finds the errors, and predicts
# poses that it has not seen.

# %%
import matplotlib.pyplot as plt
import numpy as np

from estimation import calibrate
from oed import PoseOptions, design_poses
from robots import load_robot
from robots.geometry_errors import Markers, random_positions, simulate_poses

robot = load_robot("er3a")
truth = {
    **{"zero_2": 0.0042, "zero_3": -0.0031, "zero_5": 0.0058},
    **{"link_2_y": 0.0007, "link_4_z": 0.0006},
    **{"sine_4": 0.0009, "cosine_4": -0.0004},
}

# %% [markdown]
# ## Poses to measure
#
# The design chooses 25 poses that determine zeros and links best. It states the errors to expect before anything moves.
# Here collisions are left out, which takes half of the time.

# %%
noise = {"m": 5e-5}
design = design_poses(robot, count=25, options=PoseOptions(noise=noise, collision=False))
print(design.summary())

# %% [markdown]
# ## The measurement
#
# The virtual robot has the errors above. On a real one, fill the columns of `poses.csv` and read it with `read_poses`.

# %%
tracker = Markers(count=3)
poses = simulate_poses(robot, design.q, tracker, truth, noise=noise, seed=1)
other = simulate_poses(robot, random_positions(robot, 40, seed=2), tracker, truth, noise=noise, seed=3)

# %% [markdown]
# ## The calibration
#
# Kinds of errors are added while they predict held-out poses better. The other poses were never fitted.

# %%
calibration = calibrate(robot, poses, held_out=other)
print(calibration.summary())

# %% [markdown]
# ## Errors before and after
#
# The intervals hold the truth with 95 %. Zeros of the first and last joint cannot be distinguished from the tracker
# and the tool.

# %%
found = {item.name: item for item in calibration.errors}
shown = [name for name in ("zero_2", "zero_3", "zero_5", "sine_4", "cosine_4") if name in found]
scores = np.array([(found[name].value - truth[name]) / found[name].standard_error for name in shown])
figure, axes = plt.subplots(1, 2, figsize=(11, 4), layout="constrained")
calibration.plot(axes[0])
place = np.arange(len(shown))
half = [(found[name].upper - found[name].lower) / 2 for name in shown]
axes[1].errorbar(place, [1e3 * found[n].value for n in shown], 1e3 * np.array(half), fmt="o", label="calibrated")
axes[1].plot(place, [1e3 * truth[name] for name in shown], "_", markersize=20, color="black", label="truth")
axes[1].set_xticks(place, shown)
axes[1].set_ylabel("error [mrad]")
axes[1].legend()
plt.show()
