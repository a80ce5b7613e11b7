"""Intermittent torques, independent of the motion: a brake that drags for some time, a machine with a cycle."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from robots.robot import Robot
from robots.terms.base import force_unit
from robots.terms.discrepancies.gain_drift import OverTime
from robots.terms.effect_bases.states import spells
from robots.terms.effects import Coefficient, JointEffect, Shape, Situation
from robots.terms.effects.external_contact import HOLD, pulse

Array = NDArray[np.float64]

SPELLS = (1.5, 3.0, 6.0, 12.0)
"""Durations of a spell [s], no more than the second share of the data: what lasts longer is a change for good."""
MOST = 0.4
SHARES = (0.05, 0.15, 0.4)
"""Shares of its period for which a push lasts."""
TIMES = 5.0
"""So often it must come in the data; that and the least time it lasts [s] bound the periods."""
BRIEFEST, SHORTEST = 0.15, 1.5
PAUSED = 2.0
"""Logs that are so many times as long from first to last as what was recorded lie apart."""
BIN = 0.05
"""[s] over which forces are summed before they are folded."""
LIKE_MOTION, HIGHEST = 0.9, 5.0
"""With a period whose harmonics have this share of the motion, up to a frequency [Hz], the motion repeats as well."""


class IntermittentTorque(JointEffect):
    """tau = c sign(dq) p(t), p a pulse: friction that is there for a while."""

    name: ClassVar[str] = "pattern:spell:0:odd"
    title: ClassVar[str] = "temporary additional friction of a joint"
    depends_on: ClassVar[Literal["state", "time"]] = "time"
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("start", "s", -np.inf, np.inf, "linear", inexact=0.03),
        Shape("duration", "s", 0.5, np.inf, "log", SPELLS, 0.05),
    )

    def parameters(self, robot: Robot, joint: int | None) -> tuple[Coefficient, ...]:
        """Describes the friction."""
        assert joint is not None
        return (Coefficient("friction", force_unit(robot, joint - 1)),)

    def grid(self, situation: Situation, joint: int | None) -> tuple[tuple[float, ...], ...]:
        """Lists durations, each starting every half of it."""
        longest = self.bounds(situation, joint)[1][1]
        return spells(situation, [duration for duration in SPELLS if duration <= longest])

    def bounds(self, situation: Situation, joint: int | None) -> tuple[tuple[float, float], ...]:
        """Keeps the spell within the data, and a spell."""
        first, last = float(situation.t[0]), float(situation.t[-1])
        return (first, last), (self.shapes[1].lower, max(MOST * len(situation) * situation.period, 1.0))

    def propose(
        self, situation: Situation, joint: int | None, residual: Array, count: int = 8
    ) -> tuple[tuple[float, ...], ...]:
        """Ranks all spells at once, by the sum of what the residual has of the joint's direction in each."""
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
        return np.asarray((pulse(situation.t, (*shape, HOLD)) * situation.sign[:, joint - 1])[:, None])

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
    """J(q)' f p(t - k T - t_0) for all k: a force on the flange, constant in the base frame, that comes every T s.

    Its period distinguishes it from the motion; a period of the motion itself is excluded.
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
        """Lists periods, durations and moments, so near that a push is hardly missed by half of what it lasts."""
        return tuple(
            (period, float(_middle(situation) + phase), share * period)
            for share in SHARES
            for period in self._periods(situation, share)
            for phase in np.arange(0.0, period, share * period / 2)
        )

    def bounds(self, situation: Situation, joint: int | None) -> tuple[tuple[float, float], ...]:
        """Bounds the period and the duration of a push."""
        first, last = float(situation.t[0]), float(situation.t[-1])
        longest = max((last - first) / (TIMES - 1.0), 2 * SHORTEST)
        return (0.5 * SHORTEST, longest), (first, last), (0.5 * BRIEFEST, 0.6 * longest)

    def propose(
        self, situation: Situation, joint: int | None, residual: Array, count: int = 8
    ) -> tuple[tuple[float, ...], ...]:
        """Ranks the grid by the force that the residual shows, folded over each period."""
        force = np.einsum("tin,tn->ti", situation.sensitivity("jacobian")[:, :3], residual)
        bins = ((situation.t - situation.t[0]) / BIN).astype(int)
        sums = np.column_stack([np.bincount(bins, weights=column) for column in force.T])
        noise = np.maximum(np.mean(sums**2, axis=0), 1e-300)
        t = situation.t[0] + (np.arange(len(sums)) + 0.5) * BIN - _middle(situation)
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
            shortest, longest = max(SHORTEST, BRIEFEST / share), duration / TIMES
            # Between neighbouring periods, the last push moves by its own duration.
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
    """Whether logs have longer pauses between them than they are: over those nothing keeps its time."""
    return float(situation.t[-1] - situation.t[0]) > PAUSED * len(situation) * situation.period


def _middle(situation: Situation) -> float:
    """The middle of the data [s]: about it a period turns without moving the pushes as a whole."""
    return float(situation.t[0] + situation.t[-1]) / 2


def _with_motion(situation: Situation, rate: float) -> bool:
    """Whether the motion repeats at a rate [Hz], too: most of its power is at harmonics of it."""
    f, power, duration = situation.cached("power of the motion", lambda: _power(situation))
    lines = np.abs(f - np.round(f / rate) * rate) <= 1.0 / duration
    return bool(power[lines].sum() > LIKE_MOTION)


def _power(situation: Situation) -> tuple[Array, Array, float]:
    """Frequencies (K,) up to the highest, the shares of the joints' velocity there (K,), and the data's duration."""
    rows = len(situation)
    f = np.fft.rfftfreq(rows, max(situation.period, 1e-9))
    power = np.abs(np.fft.rfft(situation.dq - situation.dq.mean(axis=0), axis=0)) ** 2
    low = f <= HIGHEST
    power = (power[low] / np.maximum(power[low].sum(axis=0), 1e-300)).mean(axis=1)
    shares = np.asarray(power / max(float(power.sum()), 1e-300))
    return np.asarray(f[low]), shares, rows * situation.period
