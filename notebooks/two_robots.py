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
# # Two robots over four days, and one damaged gearbox
#
# Chapter 5 of the thesis repeats a test on two robots of one type. The robots heat up on each of the four days. On the
# second day a gearbox of Robot 2 was damaged after 60 min, and its friction rose by 32 %.
#
# Here both robots are virtual. They come from an independent plant (`benchmarks/monitoring_parts`), and differ only in
# noise and damage. Ten logs of 10 s are taken on each day, where the thesis logs 24 cycles. The robot moves between the
# logs, too, and that heat counts. The ambient temperature has the same course on all days, so that the scatter of a
# healthy joint is smaller than on real robots.

# %%
import sys
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from estimation import compare, identify
from estimation.comparisons import Run
from estimation.thermal import ThermalRun, fit_thermal, thermal_runs
from oed.benchmarks.truth.description import write_description
from robots import Log, load_robot

notebook = Path(__file__) if "__file__" in globals() else Path.cwd() / "notebook"
sys.path.insert(0, str(notebook.resolve().parents[1]))
from benchmarks.monitoring_parts.virtual_robot import DAY, Cause, VirtualRobot

DAYS, JOINT, DAMAGE = 4, 1, 0.32
STARTS = np.array([0, 1, 3, 5, 10, 20, 55, 60, 65, 75])  # of the logs on each day [min]
PAUSES = np.diff(STARTS, append=120)


def heat_up(plant, seconds):
    """Repeats the motion of 10 s without a log; one step of the plant's heat each."""
    _, v, _, _, sign = plant.motions[0]
    f = plant.machine.friction
    coulomb = (f[:, 0] * sign * v).mean(axis=0) / plant.level
    viscous = ((f[:, 1] * v + f[:, 2] * v * np.abs(v) + f[:, 3] * v**3) * v).mean(axis=0) / plant.level
    for _ in range(round(seconds / 10)):
        c, w = plant.factors(plant.clock)
        plant.heat = plant.heat + (coulomb * c + viscous * w - plant.heat) * (1 - np.exp(-10.0 / plant.times))
        plant.clock += 10.0


# %% [markdown]
# ## Four days of both robots

# %%
logs = {}
for number in (1, 2):
    plant = VirtualRobot(1, fall=0.5)
    plant.rng = np.random.default_rng(number)
    plant.rest(DAY)
    if number == 2:
        plant.causes = [Cause(kind="damage", time=2 * DAY + 3600.0, joint=JOINT, amount=DAMAGE)]
    for day in range(DAYS):
        for k, minutes in enumerate(PAUSES):
            log = plant.log(10.0, 0, f"robot {number}, day {day + 1}, log {k + 1}")
            logs[number, day, k] = Log(log.t[::4], log.q[::4], log.tau[::4], name=log.name)
            heat_up(plant, 60.0 * minutes - 10.0)
        plant.rest((day + 2) * DAY - plant.clock)
robot = load_robot(str(write_description(plant.machine, Path(tempfile.mkdtemp()))))

# %% [markdown]
# ## Repeatability
#
# Four logs are identified, each on its own. Inertial parameters should not depend on day, robot or temperature. Those
# that are known to 2 % are compared.

# %%
last = len(STARTS) - 1
cases = {"cold": (1, 0, 0), "warm": (1, 0, last), "another day": (1, 3, 0), "another robot": (2, 0, 0)}
models = {name: identify(robot, logs[case], friction="polynomial").model for name, case in cases.items()}
common = compare([Run(model=model, label=name) for name, model in models.items()]).common
error = np.sqrt(np.diagonal(common.covariances[0]))
rigid = [
    i
    for i, column in enumerate(common.columns)
    if column.term == "rigid_body" and common.determined[i] and error[i] < 0.02 * abs(common.values[0, i])
]
changes = dict(
    zip(models, np.median(np.abs(common.values[:, rigid] / common.values[0, rigid] - 1), axis=1), strict=True)
)
for name in ("warm", "another day", "another robot"):
    print(f"cold log and {name}: median change of {len(rigid)} inertial parameters {changes[name]:.2%}")

# %% [markdown]
# ## Friction of the joint
#
# The friction of each log is measured relative to the first, cold log. A thermal model is fitted to the first day of
# Robot 1. It then follows all days of both robots.


# %%
def friction(number, day):
    """Friction of a day's logs over cold friction, and the mean power of the cold friction [W]."""
    (run,) = thermal_runs(models["cold"], [logs[number, day, k] for k in range(len(STARTS))], JOINT)
    seen = np.isfinite(run.friction)
    level = (run.friction[seen] / run.cold_friction[seen]).reshape(len(STARTS), -1).mean(axis=1)
    return level, run.power[run.power > 0].mean()


levels = {(number, day): friction(number, day)[0] for number in (1, 2) for day in range(DAYS)}
watts = friction(1, 0)[1]
healthy = ThermalRun(
    t=60.0 * STARTS, power=np.full(len(STARTS), watts), friction=levels[1, 0], cold_friction=1.0, ambient=20.0
)
thermal = fit_thermal(healthy, order="second", starts=1).model
cold_over_warm = levels[1, 0][0] / levels[1, 0][-1]
print(f"joint {JOINT} of Robot 1: cold friction is {cold_over_warm - 1:.0%} higher than warm friction")

# %% [markdown]
# ## Damage
#
# What the temperature does not explain is the measured friction over that of the thermal model. A damaged joint also
# produces more heat, so that the model follows the measured power.


# %%
def unexplained(level):
    """Rise of a day's friction beyond the thermal model, as a share."""
    zones, rises = np.array([20.0, 20.0]), []
    for value, minutes in zip(level, PAUSES, strict=True):
        rises.append(value / float(thermal.friction_factor(zones[0])))
        zones = thermal.temperatures([watts * rises[-1]], [60.0 * minutes], start=zones, ambient=20.0)[-1]
    return np.array(rises) - 1


rises = {case: unexplained(level) for case, level in levels.items()}
# Days that the model was not fitted to give the scatter of a healthy joint.
scatter = np.sqrt(np.mean([rises[1, day] ** 2 for day in range(1, DAYS)]))
alarms = {case: np.flatnonzero(np.abs(rise) > 6 * scatter) for case, rise in rises.items()}
day = next(day for day in range(DAYS) if len(alarms[2, day]))
first = int(alarms[2, day][0])
sizes = np.concatenate([rises[2, day][first:], *(rises[2, later] for later in range(day + 1, DAYS))])
print(f"healthy scatter {scatter:.2%}")
print(f"damage on day {day + 1}, between {STARTS[first - 1]} and {STARTS[first]} min; the plant's: day 2, 60 min")
print(f"size {np.mean(sizes):.0%} ({sizes.min():.0%} to {sizes.max():.0%} in single logs); the plant's: {DAMAGE:.0%}")

# %% [markdown]
# ## The picture
#
# Left: the friction that is measured. On day two the damaged joint still has less friction than the healthy joint when
# cold, so that a limit on friction without temperature does not find the damage. Right: what the temperature does not
# explain.

# %%
figure, axes = plt.subplots(1, 2, figsize=(11, 4), layout="constrained")
place = np.concatenate([number + STARTS / 120 for number in range(1, DAYS + 1)])
for number, style in ((1, "o"), (2, "s")):
    for ax, values in zip(axes, (levels, rises), strict=True):
        shown = 100 * np.concatenate([values[number, d] for d in range(DAYS)])
        ax.plot(place, shown, style, markersize=4, alpha=0.7, label=f"Robot {number}")
axes[1].axhline(100 * DAMAGE, color="black", linewidth=0.8, linestyle=":", label="true damage")
axes[0].set(xlabel="day (120 min of motion each)", ylabel=f"friction of joint {JOINT} over cold friction [%]")
axes[1].set(xlabel="day (120 min of motion each)", ylabel="friction beyond the thermal model [%]")
for ax in axes:
    ax.set_xticks(range(1, DAYS + 1))
axes[1].legend()
plt.show()
