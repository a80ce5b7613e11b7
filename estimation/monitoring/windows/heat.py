"""Heat: the change of friction that temperature explains, as features of a level filter."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimation.monitoring.settings import Heat
from estimation.monitoring.windows.baseline import Baseline
from robots.common.errors import InputError
from robots.thermal import ThermalModel
from robots.thermal.online import Step, discretise

Array = NDArray[np.float64]

# Time constants of a joint [s]: the means of Table 8 of the thesis, of six joints at full duty.
FAST, SLOW = 138.0, 1467.0
# What a healthy joint's friction differs from the model's by (log), beyond what all joints share: the larger RMS of
# eight virtual robots with plain and thermal models, cold and warm, on known and other motions (largest: 0.19).
LEVEL = 0.055
# Priors (mean, standard deviation) of what the features explain, in logs of the friction. The last one is the level.
MODEL_PRIOR = ((1.0, 0.15), (0.0, LEVEL))
TEMPERATURE_PRIOR = ((-0.2, 0.2), (0.0, LEVEL))
COMMON_PRIOR = ((-0.2, 0.2), (-0.3, 0.3), (0.0, LEVEL))
# Without heat, temperature changes the level, too.
LEVEL_PRIOR = ((0.0, 0.3),)
# Temperatures count per so many degrees from this one.
DEGREES, ROOM = 20.0, 20.0
# Standard deviations of what is unknown and common to all joints: the ambient temperature [K], or a share.
AMBIENT_SPREAD, COMMON_SPREAD = 10.0, 0.5
LOWEST_FACTOR = 0.05
# Deviations of a joint, in standard deviations, from which it counts less, and not at all.
FAR, TOO_FAR = 2.0, 4.0


class HeatState:
    """Follows the heat of each joint from window to window, and gives features of the log of its friction.

    Args:
        kind: what explains the change of friction.
        baseline: the model.
    """

    def __init__(self, kind: Heat, baseline: Baseline) -> None:
        if kind == "model" and baseline.thermal is None:
            raise InputError("heat 'model', but the model has no thermal part", remedy="use a model of oed thermal")
        self.kind, self.baseline = kind, baseline
        n = baseline.robot.n
        self.n = n
        self.models: tuple[ThermalModel | None, ...] = (
            baseline.thermal.thermal if kind == "model" and baseline.thermal is not None else (None,) * n
        )
        self.states: list[Array | None] = [_start(model) for model in self.models]
        self.kept = np.zeros((n, 2))
        self.reference = np.full(n, np.nan)
        fast = baseline.time_constant
        self.times = np.array([FAST, SLOW] if fast is None else [fast, fast * SLOW / FAST])
        self.temperatures = np.full(n, np.nan)
        self._steps: dict[tuple[int, float], Step] = {}

    @property
    def prior(self) -> tuple[Array, Array]:
        """Means and standard deviations of the coefficients (m,)."""
        table = {"model": MODEL_PRIOR, "temperature": TEMPERATURE_PRIOR, "common": COMMON_PRIOR}
        values = np.array(table.get(self.kind, LEVEL_PRIOR))
        return values[:, 0], values[:, 1]

    @property
    def common_spread(self) -> float:
        """Standard deviation of the common unknown, in its unit; zero where nothing common is explained."""
        return {"model": AMBIENT_SPREAD, "none": 0.0}.get(self.kind, COMMON_SPREAD)

    def factor(self, j: int) -> float:
        """Friction of joint j, counted from 0, over the model's, by the thermal model; 1 without one."""
        model, state = self.models[j], self.states[j]
        if model is None or state is None:
            return 1.0
        T = model.zone_temperatures(model.values, list(state))[0]
        return max(float(model.friction_factor(T)), LOWEST_FACTOR)

    def features(self, j: int) -> Array | None:
        """What explains the log of the friction of joint j (m,); None where it is not known."""
        if self.kind == "model":
            return np.array([np.log(self.factor(j)), 1.0])
        if self.kind == "temperature":
            T = self.temperatures[j]
            return np.array([(T - ROOM) / DEGREES, 1.0]) if np.isfinite(T) else None
        if self.kind == "common":
            return np.array([*self.kept[j], 1.0])
        return np.ones(1)

    def sensitivity(self, j: int) -> float:
        """Change of the log of the friction of joint j per unit of the common unknown."""
        if self.kind == "model":
            model = self.models[j]
            return 0.0 if model is None else model.alpha / self.factor(j)
        return 0.0 if self.kind == "none" else 1.0

    def advance(self, power: Array, duration: float, ambient: float | None) -> None:
        """Goes on by a time [s] at constant power (n,) [W], that which friction turns into heat."""
        if duration <= 0:
            return
        for j, model in enumerate(self.models):
            state = self.states[j]
            if model is not None and state is not None:
                self.states[j] = self._advanced(j, model, state, float(power[j]), duration, ambient)
        first = np.isnan(self.reference) & (power > 0)
        self.reference[first] = power[first]
        share = np.where(np.isnan(self.reference), 0.0, power / self.reference)
        keep = np.exp(-duration / self.times)
        self.kept = self.kept * keep + share[:, None] * (1 - keep)

    def _advanced(
        self, j: int, model: ThermalModel, state: Array, power: float, duration: float, ambient: float | None
    ) -> Array:
        key = (j, round(duration, 3))
        step = self._steps.get(key)
        if step is None:
            step = discretise(model, duration)
            if len(self._steps) < 64 * self.n:
                self._steps[key] = step
        around = model.ambient if ambient is None else ambient
        return step.Phi @ state + step.around * around + step.driven + step.heat * power

    def to_dict(self) -> dict[str, Any]:
        """Gives the state as plain data."""
        return {
            "kind": self.kind,
            "states": [None if state is None else state.tolist() for state in self.states],
            "kept": self.kept.tolist(),
            "reference": [None if np.isnan(value) else float(value) for value in self.reference],
        }

    @classmethod
    def from_dict(cls, data: dict[str, Any], baseline: Baseline) -> HeatState:
        """Reads `to_dict`."""
        found = cls(data["kind"], baseline)
        found.states = [None if state is None else np.array(state, dtype=float) for state in data["states"]]
        found.kept = np.array(data["kept"], dtype=float)
        found.reference = np.array([np.nan if value is None else value for value in data["reference"]], dtype=float)
        return found


def _start(model: ThermalModel | None) -> Array | None:
    if model is None:
        return None
    return np.array(model.start_state([model.ambient] * len(model.zones), model.state_count()), dtype=float)


def common_change(
    deviations: Array, variances: Array, sensitivities: Array, spread: float, leave: int | None
) -> tuple[float, float]:
    """Estimates the unknown that all joints share, such as an error of the ambient temperature.

    Weighted least squares with a normal prior; joints that deviate from the others by more than `FAR` standard
    deviations count less (Huber 1964), and by more than `TOO_FAR` not at all: a damaged joint must not move the others.

    Args:
        deviations: of the logs of friction (n,); NaN where unknown.
        variances: of them (n,).
        sensitivities: to the common unknown (n,).
        spread: prior standard deviation of the unknown; zero for none.
        leave: a joint that is left out, counted from 0; None for none.

    Returns:
        The unknown and its variance.
    """
    used = np.isfinite(deviations) & np.isfinite(variances) & (sensitivities != 0)
    if leave is not None:
        used[leave] = False
    if spread == 0 or not used.any():
        return 0.0, spread**2
    d, s, v = deviations[used], sensitivities[used], variances[used]
    # From the median: an iteration from zero would follow the joint that deviates most.
    found = float(np.median(d / s))
    precision = 0.0
    for _ in range(10):
        distance = np.abs(d - s * found) / np.sqrt(v)
        weight = np.where(distance < TOO_FAR, np.minimum(1.0, FAR / np.maximum(distance, FAR)) ** 2, 0.0) / v
        precision = float(weight @ s**2) + spread**-2
        found = float(weight @ (s * d)) / precision
    return found, 1.0 / precision
