"""Gear backlash: the link moves to the other tooth flank when the gear's load changes sign."""

from __future__ import annotations

import math
from bisect import bisect_left
from itertools import product
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from scipy.integrate import cumulative_trapezoid

from robots.common.arrays import Array
from robots.terms.base import force_unit, length_unit
from robots.terms.effect_bases.base import Coefficient, Effect, Place, Shape, Situation
from robots.terms.effect_bases.capabilities import AboveBand, AtReversals, GearLoad
from robots.terms.effect_bases.unknown_rotor import (
    KNOWN_ROTOR,
    ROTOR,
    is_sure,
    load_beside,
    rotor_bounds,
    rotor_grid,
    rotors_between,
)
from robots.terms.effects.joint_elasticity import least_inertia, link_inertia, windup

if TYPE_CHECKING:
    from robots.robot import Robot


SCANNED = tuple(0.006 * 1.25**k for k in range(17))
"""Crossing times [s] of a scan, up to 0.2; steps of a quarter, because impacts at wrong times explain nothing."""
ASIDE = (-0.02, 0.0, 0.02)
"""Loads of a scan at which the link leaves its flank, as fractions of the load's RMS."""
LANDING_TIME = 0.02
"""Shortest and default time [s] in which a flank stops the link. The time of an impact is known to some milliseconds,
so predicting a shorter impact would increase the error."""
HOVERING_LOAD = 0.05
"""Fraction of its RMS that a load must exceed on the new side to count as a crossing of the scan."""


class Backlash(Effect):
    """The link lags its encoder by (b / 2) side; between the flanks it moves freely: M lag'' = load.

    The link leaves its flank when the gear's load changes sign, and is followed until it reaches the other flank, or
    its own one again if the load returns. A load that grows by r per second moves it over the gap b in
    (6 b M / r)^(1/3). The flank stops it within a time L by a half wave of force. L is the duration of the impact and
    the error of its time; the force is centred on that time. The link does not leave before it has settled, because the
    impact moves the motor, and that shows in the load by the motor's motion. The torque is therefore too small during
    the crossing; then it shows a short and large impact. It follows from the lag as for an elastic gear, at zero
    crossings of the load, not of the velocity.

    Size and duration of the impacts both determine the gap, but only roughly, because real crossings vary. The zero of
    the load is known to some per cent, because a log separates offset and load poorly. It is a shape parameter.
    """

    name: ClassVar[str] = "backlash"
    title: ClassVar[str] = "gear backlash"
    at_reversals: ClassVar[AtReversals] = AtReversals.IMPACT
    gear_load: ClassVar[GearLoad] = GearLoad.FEELS
    above_band: ClassVar[AboveBand] = AboveBand.COUNTS
    # The motor answers during the crossing, so that the gap by the crossing times has a relative error of its own.
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("gap_crossed", "rad", 1e-7, 0.2, "log", inexact=0.1),
        Shape("crossed_at", "N m", -np.inf, np.inf, "linear", (0.0,), default=0.0),
        ROTOR,
        Shape("landing", "s", 0.012, 0.1, "log", (LANDING_TIME,), default=LANDING_TIME),
    )
    rivals: ClassVar[tuple[str, ...]] = ("joint_elasticity", "presliding_hysteresis", "load_dependent_friction")
    experiments: ClassVar[tuple[str, ...]] = ("payload", "micro_reversals")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes half the backlash."""
        assert joint is not None
        # The formula errs by a fifth, because links rebound differently and drives yield to the impact. A half backlash
        # below the roughness of teeth at a radius of 0.1 m counts as zero.
        return (Coefficient("half_play", length_unit(robot, joint - 1), 0.0, 0.05, 0.2, 5e-7),)

    def ranges(self, robot: Robot, joint: Place, shape: tuple[float, ...]) -> tuple[tuple[float, float], ...]:
        """Bounds the backlash from the torque's size to within a factor of the gap from the crossing times."""
        ((lower, upper),) = super().ranges(robot, joint, shape)
        # The size of the impacts is known to a factor of two; the crossing time, which grows with the cube root of the
        # gap, is known better.
        return ((max(lower, shape[0] / 4), min(upper, shape[0])),)

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists gaps with crossing times of 6 to 200 ms, at loads near zero; empty if the load hardly changes sign."""
        assert joint is not None
        points = []
        size = _size(situation, joint)
        for rotor in rotor_grid(situation, joint):
            times, _, quickness = _crossings(situation, joint, 0.0, rotor)
            if len(times) < 2:
                continue
            gaps = [time**3 * float(np.median(quickness)) / 6.0 for time in SCANNED]
            able = [gap for gap in gaps if self.shapes[0].lower <= gap <= self.shapes[0].upper]
            # Landing time [s] of a scan: long, so that crossing times between those of the scan are found, too.
            points += [(gap, aside * size, rotor, 0.03) for gap in able for aside in ASIDE]
        return tuple(points)

    def bounds(self, situation: Situation, joint: Place) -> tuple[tuple[float, float], ...]:
        """Bounds the load at which sides change to values near zero, and the rotor inertia to its known range."""
        assert joint is not None
        gap, *_, landing = self.shapes
        # Largest load at which the link leaves its flank, as a fraction of the load's RMS: a base model whose zero load
        # is less certain cannot show backlash.
        most = 0.1 * _size(situation, joint)
        return (
            (gap.lower, gap.upper),
            (-most, most),
            rotor_bounds(situation, joint),
            (landing.lower, landing.upper),
        )

    def likely(
        self, situation: Situation, joint: Place, shape: tuple[float, ...], coefficients: Array
    ) -> tuple[tuple[float | None, ...], ...]:
        """Lists combinations of usual and refined values, such as the gap that follows from the torque's size."""
        gap = float(np.clip(2.0 * coefficients[0], self.shapes[0].lower, self.shapes[0].upper))
        # Each parameter has its usual or its refined value; the last combination is the refined shape itself.
        assert joint is not None
        rotors = (KNOWN_ROTOR,) if is_sure(situation, joint) else (KNOWN_ROTOR, None)
        either = ((LANDING_TIME, None), rotors, (0.0, None), (gap, None))
        return tuple((g, z, r, lands) for lands, r, z, g in product(*either))[:-1]

    def other_optima(
        self, situation: Situation, joint: Place, shape: tuple[float, ...], coefficients: Array
    ) -> tuple[tuple[tuple[float, ...], ...], ...]:
        """Lists starts with other rotor inertias.

        Another rotor inertia makes the load change sign at other times. Its optimum is narrow, so that a joint search
        over rotor inertia and load misses it.
        """
        assert joint is not None
        rotors = rotors_between(situation, joint)
        turned = tuple((size * shape[0], 0.0, rotor, shape[3]) for size in (1.0, 2.0) for rotor in rotors)
        return (turned,) if turned else ()

    def columns(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque of all joints per half backlash of one joint (N, n, 1)."""
        assert joint is not None
        gap, at, rotor, landing = shape
        load = load_beside(situation, joint, rotor) - at
        pushed = load / least_inertia(situation, joint, rotor) / (gap / 2)
        lag = np.empty(len(situation))
        for run in situation.runs:
            lag[run] = _spread(_lag(situation.t[run], pushed[run]), landing, situation.period)
        return windup(situation, joint, lag, *situation.derivatives(lag), rotor)[:, :, None]

    def leakage(self, robot: Robot, joint: int, shape: tuple[float, ...] = ()) -> float:
        """Returns a quarter: links rebound differently, and the motor yields to the impact."""
        return 0.25

    def describe(
        self,
        joint: Place,
        coefficients: Array,
        shape: tuple[float, ...] = (),
        *,
        force: str = "N m",
        length: str = "rad",
    ) -> str:
        """Describes the values in one sentence: the gap by its crossing times, which determine it best."""
        gap = shape[0] if shape else 2 * coefficients[0]
        return (
            f"The gear of joint {joint} has {gap:.3g} {length} of backlash; the link moves through it when the load "
            "changes sign."
        )

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Returns the gear's load."""
        assert joint is not None
        unit = force_unit(situation.robot, joint - 1)
        return f"load of joint {joint} [{unit}]", load_beside(
            situation, joint, shape[2] if len(shape) > 2 else KNOWN_ROTOR
        )


def _lag(t: Array, pushed: Array) -> Array:
    """Follows a link between two flanks at 1 and -1, which take all its speed.

    Args:
        t: times (N,) [s].
        pushed: acceleration of the lag while the link is free (N,) [1/s2].

    Returns:
        The lag (N,).
    """
    speed = cumulative_trapezoid(pushed, t, initial=0)
    way = cumulative_trapezoid(speed, t, initial=0)
    changes = np.flatnonzero(pushed[:-1] * pushed[1:] < 0) + 1
    rises = pushed[changes] > 0
    # Rows from which the load pushes the link off a flank, with a last one that is not there.
    leaving = {side: [*changes[rises == (side < 0)].tolist(), len(t)] for side in (1.0, -1.0)}
    lag = np.empty(len(t))
    side = 1.0 if np.sum(pushed[: max(len(t) // 100, 1)]) >= 0 else -1.0
    row = settled = 0
    while row < len(t):
        # The link stays until the load pushes it off its flank.
        leaves = row
        if side * pushed[row] >= 0:
            leaves = leaving[side][bisect_left(leaving[side], row)]
        lag[row:leaves] = side
        if leaves == len(t):
            break
        begins, v0, x0 = t[leaves], speed[leaves], way[leaves]
        if leaves > settled:
            before, after = pushed[leaves - 1], pushed[leaves]
            share = after / (after - before)
            begins, v0, x0 = (x[leaves] - share * (x[leaves] - x[leaves - 1]) for x in (t, speed, way))
        # Longest time [s] in which a link that left a flank is followed until it lands.
        last = t.searchsorted(t[leaves] + 1.0)
        free = side + way[leaves:last] - x0 - v0 * (t[leaves:last] - begins)
        outside = np.abs(free) > 1.0
        first = int(outside.argmax())
        landed = bool(outside[first])
        lands = leaves + (first if landed else len(free))
        lag[leaves:lands] = free[: lands - leaves]
        if lands == len(t):
            break
        side = math.copysign(1.0, free[first]) if landed else -side
        # Time [s] after a landing before the link can leave again: the controller's response to the impact.
        row = settled = max(int(t.searchsorted(t[lands] + 0.05)), lands + 1)
        lag[lands:row] = side
    return lag


def _spread(lag: Array, landing: float, period: float) -> Array:
    """Spreads each change of speed over the duration of a landing [s], as a half wave of force does."""
    reach = int(0.5 * landing / period) if period else 0
    kernel = np.cos(np.pi * period / landing * np.arange(-reach, reach + 1))
    padded = np.pad(lag, reach, mode="edge")
    return np.convolve(padded, kernel / kernel.sum(), mode="valid")


def _size(situation: Situation, joint: int) -> float:
    return float(np.sqrt(np.mean(situation.load[:, joint - 1] ** 2)))


def _crossings(situation: Situation, joint: int, at: float, rotor: float) -> tuple[Array, Array, Array]:
    """Finds where the load crosses a value: times [s], the new sign, and its rate over the link's inertia [rad/s3].

    A crossing counts only if the load exceeds `HOVERING_LOAD` before it returns. A load that stays near zero, as on a
    joint without gravity load at constant speed, crosses only because of errors of the motion.
    """
    load = load_beside(situation, joint, rotor) - at
    inertia = np.maximum(link_inertia(situation, joint, rotor)[:, joint - 1], 1e-12)
    beyond = HOVERING_LOAD * float(np.sqrt(np.mean(load**2))) if len(load) else 0.0
    found = []
    for run in situation.runs:
        part = load[run]
        sure = np.flatnonzero(np.abs(part) > beyond)
        last = sure[:-1][part[sure[:-1]] * part[sure[1:]] < 0]
        # The final sign change is the last one before the load is clearly on the new side.
        changes = np.flatnonzero(part[:-1] * part[1:] <= 0)
        after = sure[np.searchsorted(sure, last, side="right")]
        found.append(run.start + changes[np.searchsorted(changes, after, side="left") - 1])
    i = np.concatenate(found) if found else np.zeros(0, dtype=np.intp)
    step = situation.t[i + 1] - situation.t[i]
    change = load[i + 1] - load[i]
    times = situation.t[i] - load[i] / np.where(change == 0, 1.0, change) * step
    return times, np.sign(change), np.abs(change) / step / inertia[i]
