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
# # A hidden effect is found
#
# The package contains two logs of a virtual ER3A. Something acts on this robot that the usual model does not have. The
# diagnosis gets `t`, `q` and `tau`, and the robot's description.

# %%
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import oed
from estimation import diagnose, read_log
from robots import load_robot

examples = Path(oed.__file__).parent / "examples"
robot = load_robot("er3a")
log, held_out = read_log(examples / "log.csv"), read_log(examples / "held_out.csv")
print(f"{log.duration:.0f} s to diagnose, {held_out.duration:.0f} s of another motion for the proof")

# %% [markdown]
# ## Diagnosis
#
# Each effect of the catalogue is tested at each joint. To keep this notebook short, six effects are candidates
# here; leave `candidates` out to test all of them. The model is extended by effects that are significant and that
# improve the prediction of the held-out log.

# %%
CANDIDATES = ["spring", "stribeck", "asymmetric_friction", "load_dependent_friction", "encoder_offset", "torque_ripple"]
diagnosis = diagnose(robot, log, held_out=held_out, friction="coulomb-viscous", candidates=CANDIDATES)
print(diagnosis.summary())

# %% [markdown]
# ## Size and gain
#
# The gain is measured on the held-out log: the error of the torque over the torque, without the effect and with it.

# %%
for finding in diagnosis.findings:
    where = "the whole robot" if finding.joint is None else f"joint {finding.joint}"
    print(f"{finding.effect}, {where}")
    for parameter in finding.parameters:
        low, high = (parameter.value + s * 1.96 * parameter.standard_error for s in (-1, 1))
        print(f"  {parameter.name} = {parameter.value:.3g} ({low:.3g} to {high:.3g}) {parameter.unit}")
    gain = finding.gain
    print(f"  held-out error {gain.nrmse_before:.2%} before, {gain.nrmse_after:.2%} after")
print("all joints, before:", np.round(100 * diagnosis.baseline, 2), "%")
print("all joints, after: ", np.round(100 * diagnosis.extended, 2), "%")

# %% [markdown]
# ## The picture
#
# The residual of the held-out log against the position of the joint, without the effect and with it. What remains is
# noise.

# %%
finding = diagnosis.findings[0]
joint = finding.joint - 1
trace = diagnosis.trace
figure, axes = plt.subplots(1, 2, figsize=(10, 4), sharey=True, layout="constrained")
for ax, residuals, title in zip(axes, (trace.before, trace.after), ("usual model", "extended model"), strict=True):
    counted = np.isfinite(residuals[:, joint])  # rows at reversals of a joint do not count
    residual, q = residuals[counted, joint], trace.coordinate[0][counted]
    ax.plot(q, residual, ".", markersize=1.5, color="tab:gray")
    edges = np.linspace(q.min(), q.max(), 16)
    number = np.clip(np.digitize(q, edges) - 1, 0, 14)
    mean = [residual[number == k].mean() if np.any(number == k) else np.nan for k in range(15)]
    ax.plot((edges[1:] + edges[:-1]) / 2, mean, "o-", color="tab:red", label="mean in 15 bins")
    ax.set_title(f"{title}: RMS {np.sqrt(np.mean(residual**2)):.2f} N m")
    ax.set_xlabel(f"position of joint {joint + 1} [rad]")
axes[0].set_ylabel("measured minus predicted torque [N m]")
axes[0].legend()
plt.show()
