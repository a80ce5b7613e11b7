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
# # Friction that changes with temperature
#
# A cold industrial robot has more friction than a warm one. Friction heats the joint, and the heat lowers the friction.
# Chapter 4 of the thesis models this; see the page on thermal friction in the documentation.
#
# Here a virtual ER3A repeats one motion for two hours. The robot is an independent plant
# (`benchmarks/monitoring_parts`). Its friction falls exponentially with the temperature, so that the thermal model is
# only approximately right, as on a real robot.

# %%
import sys
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from estimation import identify, predict
from estimation.thermal import ThermalRun, ThermalTorqueModel, fit_thermal, thermal_runs
from oed.benchmarks.truth.description import write_description
from robots import Log, load_robot

notebook = Path(__file__) if "__file__" in globals() else Path.cwd() / "notebook"
sys.path.insert(0, str(notebook.resolve().parents[1]))
from benchmarks.monitoring_parts.virtual_robot import VirtualRobot

plant = VirtualRobot(1, fall=0.5)
test_motion = plant.add_motion()
robot = load_robot(str(write_description(plant.machine, Path(tempfile.mkdtemp()))))

# %% [markdown]
# ## Heating
#
# The first 10 s of each cycle are logged, at 62.5 Hz. The thesis has 24 cycles of 5 min. Here 12 cycles become longer
# towards the end. The robot moves in the rest of each cycle, too, and its heat counts.
#
# A test motion is played twice: on the cold robot, and right after the last cycle.

# %%
MINUTES = [1, 1, 2, 2, 4, 5, 10, 15, 20, 20, 20, 20]


def recorded(motion, name):
    """A log of 10 s with a quarter of the samples, and the plant's true factors of Coulomb and viscous friction."""
    factors = plant.factors(plant.clock)
    log = plant.log(10.0, motion, name)
    return Log(log.t[::4], log.q[::4], log.tau[::4], name=name), factors


cold, _ = recorded(test_motion, "cold")
plant.rest(86_400.0 - plant.clock)
begin = plant.clock
cycles, truth = [], []
for minutes in MINUTES:
    log, factors = recorded(0, f"cycle {len(cycles) + 1}")
    cycles.append(log)
    truth.append(factors)
    plant.warm_up(60.0 * minutes - 10.0)
warm, _ = recorded(test_motion, "warm")
elapsed = np.array([log.t[0] - begin for log in cycles]) / 60

# %% [markdown]
# ## Fit
#
# The plain model is identified from the first cycle, so that its friction is that of the cold robot. Each joint gets a
# thermal model of second order. It is fitted to the friction of the cycles. The mean friction power of the repeated
# motion is known from the plain model, and it holds between the logs, too (thesis, section 4.4).

# %%
plain = identify(robot, cycles[0], friction="polynomial").model
thermal_models, runs, estimates = [], [], []
for joint in range(1, robot.n + 1):
    (windows,) = thermal_runs(plain, cycles, joint)
    logged = np.isfinite(windows.friction)
    ratio, watts = windows.friction[logged] / windows.cold_friction[logged], windows.power[windows.power > 0]
    run = ThermalRun(
        t=60 * elapsed,
        power=np.full(len(cycles), watts.mean()),
        friction=ratio.reshape(len(cycles), -1).mean(axis=1),
        cold_friction=1.0,
        ambient=20.0,
    )
    estimate = fit_thermal(run, order="second", starts=1)
    runs.append(run)
    estimates.append(estimate)
    thermal_models.append(estimate.model)
thermal = ThermalTorqueModel(model=plain, thermal=tuple(thermal_models))
print(estimates[0].summary())

# %% [markdown]
# ## Cold and warm prediction
#
# The test motion is new to the model. The temperatures before the warm test follow from the heating time alone. No
# torque of the warm robot is used.

# %%
seconds = warm.t[0] - begin
power = [run.power[0] for run in runs]
temperatures = [
    model.temperatures([watts], [seconds], start=[20.0, 20.0], ambient=20.0)[-1]
    for model, watts in zip(thermal_models, power, strict=True)
]
predictions = {
    ("cold", "with heat"): predict(plain, cold, thermal=thermal),
    ("warm", "without heat"): predict(plain, warm),
    ("warm", "with heat"): predict(plain, warm, thermal=thermal, start=temperatures),
}
errors = {case: prediction.nrmse for case, prediction in predictions.items()}
for (state, kind), error in errors.items():
    print(f"{state}, {kind:12}: error over torque " + " ".join(f"{value:6.1%}" for value in error))

# %% [markdown]
# ## The picture
#
# Left: the friction of a joint over that of the cold robot. The plant knows its own Coulomb and viscous friction, which
# fall differently. The fitted factor is one for both, so that it lies between them. Right: torque of the test motion on
# the warm robot.

# %%
minutes = np.linspace(0.0, elapsed[-1], 200)
joint = int(np.argmax(errors["warm", "without heat"]))
step = 60 * np.diff(minutes)
curves = np.stack(
    [
        model.friction_factor(
            model.temperatures(np.full(len(step), watts), step, start=[20.0, 20.0], ambient=20.0)[:, 0]
        )
        for model, watts in zip(thermal_models, power, strict=True)
    ],
    axis=1,
)
truth = np.array(truth)  # (cycles, 2, joints)
figure, axes = plt.subplots(1, 2, figsize=(11, 4), layout="constrained")
axes[0].fill_between(
    elapsed, truth[:, 0, joint], truth[:, 1, joint], color="tab:green", alpha=0.2, label="plant, Coulomb to viscous"
)
axes[0].plot(elapsed, runs[joint].friction, "o", color="black", markersize=4, label="measured, one log each")
axes[0].plot(minutes, curves[:, joint], color="tab:red", label="thermal model")
axes[0].set(xlabel="time [min]", ylabel=f"friction of joint {joint + 1} over cold friction")
axes[0].legend(fontsize=8)
prediction = predictions["warm", "with heat"]
t = prediction.motion.t - prediction.motion.t[0]
axes[1].plot(t, prediction.measured[:, joint], color="black", linewidth=0.7, label="measured, warm robot")
for kind, style in (("without heat", ":"), ("with heat", "-")):
    label = f"{kind}: error {errors['warm', kind][joint]:.1%}"
    axes[1].plot(t, predictions["warm", kind].predicted[:, joint], style, linewidth=1.2, label=label)
axes[1].set(xlabel="time [s]", ylabel=f"torque of joint {joint + 1} [N m]")
axes[1].legend(fontsize=8)
plt.show()
