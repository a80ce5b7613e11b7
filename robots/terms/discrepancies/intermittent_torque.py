"""Intermittent torques that do not depend on the motion: a dragging brake, another machine with a cycle."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from robots.common.arrays import Array
from robots.robot import Robot
from robots.terms.base import force_unit
from robots.terms.discrepancies.gain_drift import OverTime
from robots.terms.effect_bases.capabilities import Persistence
from robots.terms.effect_bases.states import spells
from robots.terms.effects import Coefficient, JointEffect, Shape, Situation
from robots.terms.effects.external_contact import HOLD_HARDNESS, pulse

SPELLS = (1.5, 3.0, 6.0, 12.0)
"""Durations [s] of temporary friction in a scan."""
SHARES = (0.05, 0.15, 0.4)
"""Durations of a periodic force in a scan, as fractions of its period."""
FEWEST_FORCE_PERIODS = 5.0
"""Least number of periods in the data."""
BRIEFEST_FORCE, SHORTEST_FORCE_PERIOD = 0.15, 1.5
"""Least duration [s] of a periodic force, and its shortest period [s]."""


class IntermittentTorque(JointEffect):
    """tau = c sign(dq) p(t), p a pulse: temporary friction."""

    name: ClassVar[str] = "pattern:spell:0:odd"
    title: ClassVar[str] = "temporary additional friction of a joint"
    persistence: ClassVar[Persistence] = Persistence.TIME
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("start", "s", -np.inf, np.inf, "linear", inexact=0.03),
        Shape("duration", "s", 0.5, np.inf, "log", SPELLS, 0.05),
    )

    def parameters(self, robot: Robot, joint: int | None) -> tuple[Coefficient, ...]:
        """Describes the friction."""
        assert joint is not None
        return (Coefficient("friction", force_unit(robot, joint - 1)),)

    def grid(self, situation: Situation, joint: int | None) -> tuple[tuple[float, ...], ...]:
        """Lists windows of several durations, with starts half a duration apart."""
        longest = self.bounds(situation, joint)[1][1]
        return spells(situation, [duration for duration in SPELLS if duration <= longest])

    def bounds(self, situation: Situation, joint: int | None) -> tuple[tuple[float, float], ...]:
        """Bounds the start to the data, and the duration to a fraction of it."""
        first, last = float(situation.t[0]), float(situation.t[-1])
        # Longest temporary friction, as a fraction of the data; a longer one is a lasting change.
        return (first, last), (self.shapes[1].lower, max(0.4 * len(situation) * situation.period, 1.0))

    def propose(
        self, situation: Situation, joint: int | None, residual: Array, count: int = 8
    ) -> tuple[tuple[float, ...], ...]:
        """Ranks windows by the squared sum of residual times velocity sign, over the number of rows that count."""
        assert joint is not None
        grid = self.grid(situation, joint)
        if len(grid) <= count:
            return grid
        turned = residual[:, joint - 1] * situation.sign[:, joint - 1]
        sums = np.concatenate([[0.0], np.cumsum(turned)])
        rows = np.concatenate([[0.0], np.cumsum(turned != 0)])
        starts, durations = np.array(grid).T
        first, last = (np.searchsorted(situation.t, x) for x in (starts, starts + durations))
        counted = np.maximum(rows[last] - rows[first], 1.0)
        scores = (sums[last] - sums[first]) ** 2 / counted
        return tuple(grid[i] for i in np.argsort(-scores)[:count])

    def local(self, situation: Situation, joint: int, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque per unit of friction (N, 1)."""
        return np.asarray((pulse(situation.t, (*shape, HOLD_HARDNESS)) * situation.sign[:, joint - 1])[:, None])

    def describe(
        self,
        joint: int | None,
        coefficients: Array,
        shape: tuple[float, ...] = (),
        *,
        force: str = "N m",
        length: str = "rad",
    ) -> str:
        """Describes the finding in one sentence."""
        return (
            f"The residual torque of joint {joint} matches {coefficients[0]:.2g} {force} of additional "
            f"friction from t = {shape[0]:.1f} s for {shape[1]:.2g} s, and not before or after. Likely cause: a "
            f"dragging brake."
        )


class PeriodicTorque(OverTime):
    """tau = J(q)' f p(t - k T - t_0) for all k: a force on the flange, constant in the base frame, with a period T.

    Periods of the motion itself are excluded, because the force would not be distinguishable from the motion.
    """

    name: ClassVar[str] = "pattern:recurring:0:even"
    title: ClassVar[str] = "periodic force on the flange"
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("period", "s", 0.5, np.inf, "log", inexact=0.01),
        Shape("moment", "s", -np.inf, np.inf, "linear", inexact=0.03),
        Shape("duration", "s", 0.05, np.inf, "log", inexact=0.05),
    )

    def parameters(self, robot: Robot, joint: int | None) -> tuple[Coefficient, ...]:
        """Describes the force."""
        return tuple(Coefficient(f"force_{way}", "N") for way in ("x", "y", "z"))

    def grid(self, situation: Situation, joint: int | None) -> tuple[tuple[float, ...], ...]:
        """Lists periods, durations and times of the force, with times half a duration apart."""
        return tuple(
            (period, float(_middle(situation) + phase), share * period)
            for share in SHARES
            for period in self._periods(situation, share)
            for phase in np.arange(0.0, period, share * period / 2)
        )

    def bounds(self, situation: Situation, joint: int | None) -> tuple[tuple[float, float], ...]:
        """Bounds the period, the time and the duration of the force."""
        first, last = float(situation.t[0]), float(situation.t[-1])
        longest = max((last - first) / (FEWEST_FORCE_PERIODS - 1.0), 2 * SHORTEST_FORCE_PERIOD)
        return (0.5 * SHORTEST_FORCE_PERIOD, longest), (first, last), (0.5 * BRIEFEST_FORCE, 0.6 * longest)

    def propose(
        self, situation: Situation, joint: int | None, residual: Array, count: int = 8
    ) -> tuple[tuple[float, ...], ...]:
        """Ranks shapes by the force that the residual shows when folded over each period."""
        force = np.einsum("tin,tn->ti", situation.sensitivity("jacobian")[:, :3], residual)
        # Bin width [s] in which forces are summed before they are folded over a period.
        bin_width = 0.05
        bins = ((situation.t - situation.t[0]) / bin_width).astype(int)
        sums = np.column_stack([np.bincount(bins, weights=column) for column in force.T])
        noise = np.maximum(np.mean(sums**2, axis=0), 1e-300)
        t = situation.t[0] + (np.arange(len(sums)) + 0.5) * bin_width - _middle(situation)
        found: list[tuple[float, tuple[float, ...]]] = []
        for share in SHARES:
            parts = int(np.ceil(4 / share))
            width = round(share * parts)
            for period in self._periods(situation, share):
                phase = np.minimum((t / period % 1.0 * parts).astype(int), parts - 1)
                folded = np.column_stack(
                    [np.bincount(phase, minlength=parts), *(np.bincount(phase, x, parts) for x in sums.T)]
                )
                around = np.cumsum(np.concatenate([np.zeros((1, 4)), folded, folded[:width]]), axis=0)
                inside = around[width:-1] - around[: -width - 1]
                score = np.sum(inside[:, 1:] ** 2 / noise, axis=1) / np.maximum(inside[:, 0], 1.0)
                best = int(np.argmax(score))
                moment = float(_middle(situation) + best / parts * period)
                found.append((float(score[best]), (period, moment, share * period)))
        return tuple(shape for _, shape in sorted(found, reverse=True)[:count])

    def _periods(self, situation: Situation, share: float) -> tuple[float, ...]:
        def find() -> tuple[float, ...]:
            duration = max(float(situation.t[-1] - situation.t[0]), 1.0)
            if has_long_pauses(situation):
                return ()
            shortest, longest = max(SHORTEST_FORCE_PERIOD, BRIEFEST_FORCE / share), duration / FEWEST_FORCE_PERIODS
            # From one period to the next in the list, the last pulse moves by its own duration.
            rates = np.arange(1.0 / longest, 1.0 / shortest, share / duration) if longest > shortest else np.zeros(0)
            return tuple(float(1.0 / rate) for rate in rates if not _with_motion(situation, rate))

        return situation.cached(f"periods of what lasts {share}", find)

    def columns(self, situation: Situation, joint: int | None, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque of unit forces along the base's axes (N, n, 3)."""
        period, moment, duration = shape
        since = (situation.t - moment) % period
        arms = np.swapaxes(situation.sensitivity("jacobian")[:, :3], 1, 2)
        return np.asarray(arms * pulse(since, (0.0, min(duration, period)))[:, None, None])

    def describe(
        self,
        joint: int | None,
        coefficients: Array,
        shape: tuple[float, ...] = (),
        *,
        force: str = "N m",
        length: str = "rad",
    ) -> str:
        """Describes the finding in one sentence."""
        return (
            f"The residual torque of all joints matches a force of {np.linalg.norm(coefficients):.2g} N "
            f"on the flange that comes every {shape[0]:.3g} s for {shape[2]:.2g} s, independent of the motion. Likely "
            f"cause: another machine."
        )


def has_long_pauses(situation: Situation) -> bool:
    """Returns whether the pauses between the logs are longer than the logs; no phase persists over such pauses."""
    # Ratio of total to recorded time above which the logs have long pauses.
    return float(situation.t[-1] - situation.t[0]) > 2.0 * len(situation) * situation.period


def _middle(situation: Situation) -> float:
    """Returns the middle of the data [s]; with pulses timed from there, a period's error does not shift them all."""
    return float(situation.t[0] + situation.t[-1]) / 2


def _with_motion(situation: Situation, rate: float) -> bool:
    """Returns whether the motion repeats at a rate [Hz]: most of its power is at harmonics of that rate."""
    f, power, duration = situation.cached("power of the motion", lambda: _power(situation))
    lines = np.abs(f - np.round(f / rate) * rate) <= 1.0 / duration
    # A motion with 90 % of its power at the harmonics of a period has that period.
    return bool(power[lines].sum() > 0.9)


def _power(situation: Situation) -> tuple[Array, Array, float]:
    """Computes frequencies (K,) [Hz], the fraction of velocity power at each (K,), and the recorded duration [s]."""
    rows = len(situation)
    f = np.fft.rfftfreq(rows, max(situation.period, 1e-9))
    power = np.abs(np.fft.rfft(situation.dq - situation.dq.mean(axis=0), axis=0)) ** 2
    # Higher frequencies [Hz] do not count.
    low = f <= 5.0
    power = (power[low] / np.maximum(power[low].sum(axis=0), 1e-300)).mean(axis=1)
    shares = np.asarray(power / max(float(power.sum()), 1e-300))
    return np.asarray(f[low]), shares, rows * situation.period
