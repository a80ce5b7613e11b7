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
# # Identification of a real robot
#
# This notebook identifies a UR10 of the University of Salerno from a published log. The model is fitted to the first
# part of the recording and predicts the rest.
#
# The log is not part of this repository. It comes from `github.com/unisa-acg/inverse-dynamics-solver` (BSD-3-Clause).
# Set the environment variable `OED_DATA` to the folder that holds `ur10_unisa/exciting.parquet`.

# %%
import os
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from estimation import identify, predict, read_log
from robots import Log, load_robot

place = Path(os.environ.get("OED_DATA", "../shared/data")) / "ur10_unisa"
available = (place / "exciting.parquet").exists()
if not available:
    print(f"{place / 'exciting.parquet'} does not exist. Set OED_DATA to the folder of the data; the rest is skipped.")


# %% [markdown]
# ## Two parts of one recording
#
# The motion is not periodic, so that the second part is another motion than the first. One second between the parts is
# left out: the filters of the recorder spread the torque over some samples.


# %%
def part(log, begin, end, name):
    """The rows between two times, counted from the start of the log [s]."""
    rows = (log.t - log.t[0] >= begin) & (log.t - log.t[0] < end)
    return Log(log.t[rows], log.q[rows], log.tau[rows], name=name)


if available:
    robot = load_robot("ur10")
    log = read_log(place / "exciting.parquet")
    split = 0.65 * log.duration
    fitted = part(log, 0.0, split, "first part")
    unseen = part(log, split + 1.0, np.inf, "second part")
    print(f"{fitted.duration:.1f} s to identify, {unseen.duration:.1f} s to predict, {robot.n} joints")

# %% [markdown]
# ## Identification
#
# Only `t`, `q` and the torque are used. The effort column is the motor current times a gain that the authors chose.

# %%
if available:
    estimate = identify(robot, fitted, friction="coulomb-viscous")
    print(estimate.summary())

# %% [markdown]
# ## Prediction
#
# The band is the 95 % prediction interval. It allows for the noise of the torque and for the uncertainty of the
# parameters. The last column says how many measured samples lie inside.

# %%
if available:
    prediction = predict(estimate.model, unseen)
    inside = prediction.band_coverage
    print("joint   error RMS [N m]   error / torque   in the band")
    for joint in range(robot.n):
        print(
            f"{joint + 1:5}   {prediction.error_rms[joint]:15.2f}   {prediction.nrmse[joint]:14.1%}   "
            f"{inside[joint]:11.0%}"
        )

# %% [markdown]
# ## The picture
#
# Each panel is one joint on the motion that the fit has not seen.

# %%
if available:
    figure, axes = plt.subplots(3, 2, figsize=(10, 7), sharex=True, layout="constrained")
    t = prediction.motion.t - prediction.motion.t[0]
    for joint, ax in enumerate(axes.T.flat):
        middle, half = prediction.predicted[:, joint], prediction.band[:, joint]
        ax.fill_between(t, middle - half, middle + half, color="tab:orange", alpha=0.3, label="95 % band")
        ax.plot(t, prediction.measured[:, joint], color="black", linewidth=0.8, label="measured")
        ax.plot(t, middle, color="tab:orange", linewidth=1.0, label="predicted")
        ax.set_title(f"joint {joint + 1}: error {prediction.nrmse[joint]:.1%} of the torque", fontsize=9)
        ax.set_ylabel("torque [N m]")
    for ax in axes[-1]:
        ax.set_xlabel("time [s]")
    axes[0, 0].legend(fontsize=8)
    plt.show()
