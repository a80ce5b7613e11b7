"""Heat: the change of friction that temperature explains, as features of a level filter."""

from __future__ import annotations

import numpy as np

from estimation.monitoring.settings import PAUSE_SECONDS, Heat
from estimation.monitoring.windows.baseline import Baseline
from estimation.monitoring.windows.unlogged_work import DUTY_SPREAD, JOINT_SPREAD, UnloggedWork
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.records import Record
from robots.thermal import ThermalModel
from robots.thermal.online import Step, discretise

# Time constants of a joint [s]: the means of Table 8 of the thesis, of six joints at full duty.
FAST_TIME_CONSTANT, SLOW_TIME_CONSTANT = 138.0, 1467.0
# What a healthy joint's friction differs from the model's by (log), beyond what all joints share: the larger RMS of
# eight virtual robots with plain and thermal models, cold and warm, on known and other motions (largest: 0.19).
HEALTHY_LEVEL_SPREAD = 0.055
# Priors (mean, standard deviation) of what the features explain, in logs of the friction. The last one is the level.
MODEL_PRIOR = ((1.0, 0.15), (0.0, HEALTHY_LEVEL_SPREAD))
TEMPERATURE_PRIOR = ((-0.2, 0.2), (0.0, HEALTHY_LEVEL_SPREAD))
COMMON_PRIOR = ((-0.2, 0.2), (-0.3, 0.3), (0.0, HEALTHY_LEVEL_SPREAD))
# Without heat, temperature changes the level, too.
LEVEL_PRIOR = ((0.0, 0.3),)


class HeatState(Record):
    """Follows the heat of each joint from window to window, and gives features of the log of its friction.

    Args:
        kind: what explains the change of friction.
        baseline: the model.
    """

    ENTRIES = ("kind", "states", "kept", "work?", "reference")

    states: list[Array | None]
    kept: Array
    work: UnloggedWork
    reference: Array

    def __init__(self, kind: Heat, baseline: Baseline) -> None:
        if kind == "model" and baseline.thermal is None:
            raise InputError("heat 'model', but the model has no thermal part", remedy="use a model of oed thermal")
        self.kind, self.baseline = kind, baseline
        n = baseline.robot.n
        self.n = n
        self.models: tuple[ThermalModel | None, ...] = (
            baseline.thermal.thermal if kind == "model" and baseline.thermal is not None else (None,) * n
        )
        self.states = [_start(model) for model in self.models]
        self.kept = np.zeros((n, 2))
        self.reference = np.full(n, np.nan)
        fast = baseline.time_constant
        self.times = np.array(
            [FAST_TIME_CONSTANT, SLOW_TIME_CONSTANT]
            if fast is None
            else [fast, fast * SLOW_TIME_CONSTANT / FAST_TIME_CONSTANT]
        )
        self.temperatures = np.full(n, np.nan)
        self.work = UnloggedWork(n)
        self.work.rested = list(self.states)
        self._steps: dict[tuple[int, float], Step] = {}

    @property
    def prior(self) -> tuple[Array, Array]:
        """Means and standard deviations of the coefficients (m,)."""
        table = {"model": MODEL_PRIOR, "temperature": TEMPERATURE_PRIOR, "common": COMMON_PRIOR}
        values = np.array(table.get(self.kind, LEVEL_PRIOR))
        return values[:, 0], values[:, 1]

    @property
    def common_spread(self) -> Array:
        """Standard deviations of the common unknowns (2,): in their unit, and the duty; zero where there is none."""
        if self.kind == "model":
            # Standard deviations of what all joints share: of the ambient temperature [K] and of the duty.
            return np.array([10.0, DUTY_SPREAD])
        # Standard deviation of a share that is common to all joints.
        return np.array([0.0 if self.kind == "none" else 0.5, 0.0])

    def factor(self, j: int) -> float:
        """Friction of joint j, counted from 0, over the model's, by the thermal model; 1 without one."""
        return self._factor_of(j, self.states[j])

    def _factor_of(self, j: int, state: Array | None) -> float:
        model = self.models[j]
        if model is None or state is None:
            return 1.0
        T = model.zone_temperatures(model.values, list(state))[0]
        return max(float(model.friction_factor(T)), 0.05)

    def features(self, j: int) -> Array | None:
        """What explains the log of the friction of joint j (m,); None where it is not known."""
        if self.kind == "model":
            return np.array([np.log(self.factor(j)), 1.0])
        if self.kind == "temperature":
            T = self.temperatures[j]
            # Temperatures count per 20 degrees, from 20 degC.
            return np.array([(T - 20.0) / 20.0, 1.0]) if np.isfinite(T) else None
        if self.kind == "common":
            return np.array([*self.kept[j], 1.0])
        return np.ones(1)

    def sensitivity(self, j: int) -> Array:
        """Change of the log of the friction of joint j per unit of each common unknown (2,)."""
        if self.kind == "model":
            model, worked = self.models[j], self.work.worked[j]
            if model is None:
                return np.zeros(2)
            here = self.factor(j)
            more = 0.0 if worked is None else self._factor_of(j, worked) / here - 1.0
            return np.array([model.alpha / here, self.work.per_duty(more)])
        return np.array([0.0 if self.kind == "none" else 1.0, 0.0])

    def unlogged(self, j: int) -> float:
        """Standard deviation of the log of the friction of joint j by work that its logs do not show."""
        rested, worked = self.work.rested[j], self.work.worked[j]
        if rested is None or worked is None:
            return 0.0
        here = self.factor(j)
        now = here + self.work.duty * (self._factor_of(j, worked) - here)
        return JOINT_SPREAD * abs(float(np.log(now / self._factor_of(j, rested))))

    def pause(self, duration: float, ambient: float | None) -> None:
        """Goes on by a time without rows [s]: the joints rest, or in a long one work unseen."""
        if duration <= 0:
            return
        if self.kind == "model" and duration > PAUSE_SECONDS:
            self.states = self.work.settle(self.states)
            self.work.pause(self.states, duration, ambient, self._factor_of, self._heated)
        else:
            self.work.worked = self._all_heated(self.work.worked, np.zeros(self.n), duration, ambient)
        self.work.rested = self._all_heated(self.work.rested, np.zeros(self.n), duration, ambient)
        self._go_on(np.zeros(self.n), duration, ambient)

    def advance(self, power: Array, duration: float, ambient: float | None) -> None:
        """Goes on by a time [s] at constant power (n,) [W], that which friction turns into heat."""
        if duration <= 0:
            return
        self.work.record(power / np.array([self.factor(j) for j in range(self.n)]), duration)
        self.work.worked = self._all_heated(self.work.worked, power, duration, ambient)
        self.work.rested = self._all_heated(self.work.rested, power, duration, ambient)
        self._go_on(power, duration, ambient)

    def _go_on(self, power: Array, duration: float, ambient: float | None) -> None:
        self.states = self._all_heated(self.states, power, duration, ambient)
        first = np.isnan(self.reference) & (power > 0)
        self.reference[first] = power[first]
        share = np.where(np.isnan(self.reference), 0.0, power / self.reference)
        keep = np.exp(-duration / self.times)
        self.kept = self.kept * keep + share[:, None] * (1 - keep)

    def _all_heated(
        self, states: list[Array | None], power: Array, duration: float, ambient: float | None
    ) -> list[Array | None]:
        return [
            state if state is None else self._heated(j, state, float(power[j]), duration, ambient)
            for j, state in enumerate(states)
        ]

    def _heated(self, j: int, state: Array, power: float, duration: float, ambient: float | None) -> Array:
        model = self.models[j]
        if model is None:
            return state
        key = (j, round(duration, 3))
        step = self._steps.get(key)
        if step is None:
            step = discretise(model, duration)
            if len(self._steps) < 64 * self.n:
                self._steps[key] = step
        around = model.ambient if ambient is None else ambient
        return step.Phi @ state + step.around * around + step.driven + step.heat * power


def _start(model: ThermalModel | None) -> Array | None:
    if model is None:
        return None
    return np.array(model.start_state([model.ambient] * len(model.zones), model.state_count()), dtype=float)
