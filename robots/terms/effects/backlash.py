"""Gear backlash: the link moves to the other tooth flank when the gear's load changes sign."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from robots.terms.base import force_unit, length_unit
from robots.terms.effect_bases.base import Coefficient, Effect, Place, Shape, Situation
from robots.terms.effect_bases.capabilities import AboveBand, AtReversals, GearLoad
from robots.terms.effect_bases.unknown_rotor import (
    KNOWN,
    ROTOR,
    is_sure,
    load_beside,
    rotor_bounds,
    rotor_grid,
    rotors_between,
)
from robots.terms.effects.joint_elasticity import link_inertia, windup

if TYPE_CHECKING:
    from robots.robot import Robot

Array = NDArray[np.float64]

QUICKEST, SLOWEST = 0.004, 0.3
"""Shortest and longest time [s] in which the link crosses the gap; the sample period is a lower limit, too."""
SCANNED = (0.006, 0.012, 0.025, 0.05, 0.1, 0.2)
"""Crossing times [s] of a scan."""
ASIDE = (-0.03, -0.015, 0.0, 0.015, 0.03)
"""Loads of a scan at which the link changes sides, as fractions of the load's RMS."""
FARTHEST = 0.1
"""Largest such fraction: a base model whose zero load is less certain cannot show backlash."""
BRIEFEST, LANDS = 0.012, 0.02
"""Shortest and default time [s] in which a flank stops the link. The time of an impact is known to some milliseconds,
so predicting a shorter impact would increase the error."""
REBOUND, SETTLES = 0.2, 2.0
"""Fraction of its speed with which a link rebounds from the flank, and the decay time of that in landing times."""
LEAST, MOST = 1 / 8, 8.0
"""Factors on the gap from the crossing time: the gap grows with the cube of that time, which is known to a factor of
two."""

HOVERS = 0.05
"""Fraction of its RMS that a load must exceed on the new side to have changed sign."""

INEXACT = 0.2
"""Relative error of the formula, because links rebound differently and drives yield to the impact."""
SMALLEST = 5e-7
"""Half backlash below which it counts as zero [rad or m]: the roughness of teeth at a radius of 0.1 m."""


class Backlash(Effect):
    """The link lags its encoder by (b / 2) side; the side changes within T + L after the load changes sign.

    A load that grows by r per second moves the link's inertia M over the gap b in T = (6 b M / r)^(1/3). T is at most
    the parameter `longest`, because the motor moves, too. The motion in the gap grows with the third power of time, so
    the link is fastest when it lands. The other flank stops it within a time L by a half wave of force. L is half a
    period of the link on the stiffness of teeth and drive. The torque is therefore slightly too small during the
    crossing; then it shows a short and large impact. It follows from the lag as for an elastic gear, at zero crossings
    of the load, not of the velocity.

    Size and duration of the impacts both determine the gap, but only roughly, because real crossings vary. The zero of
    the load is known to some per cent, because a log separates offset and load poorly. It is a shape parameter.
    """

    name: ClassVar[str] = "backlash"
    title: ClassVar[str] = "gear backlash"
    at_reversals: ClassVar[AtReversals] = AtReversals.IMPACT
    gear_load: ClassVar[GearLoad] = GearLoad.FEELS
    above_band: ClassVar[AboveBand] = AboveBand.COUNTS
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("gap_crossed", "rad", 1e-7, 0.2, "log"),
        Shape("longest", "s", 0.01, SLOWEST, "log", (SLOWEST,), default=SLOWEST),
        Shape("crossed_at", "N m", -np.inf, np.inf, "linear", (0.0,), default=0.0),
        ROTOR,
        Shape("landing", "s", BRIEFEST, 0.1, "log", (LANDS,), default=LANDS),
    )
    rivals: ClassVar[tuple[str, ...]] = ("joint_elasticity", "presliding_hysteresis", "load_dependent_friction")
    experiments: ClassVar[tuple[str, ...]] = ("payload", "micro_reversals")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes half the backlash."""
        assert joint is not None
        return (Coefficient("half_play", length_unit(robot, joint - 1), 0.0, 0.05, INEXACT, SMALLEST),)

    def ranges(self, robot: Robot, joint: Place, shape: tuple[float, ...]) -> tuple[tuple[float, float], ...]:
        """Bounds the backlash from the torque's size to within a factor of the gap from the crossing times."""
        ((lower, upper),) = super().ranges(robot, joint, shape)
        return ((max(lower, LEAST * shape[0] / 2), min(upper, MOST * shape[0] / 2)),)

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
            points += [(gap, SLOWEST, aside * size, rotor, LANDS) for gap in able for aside in ASIDE]
        return tuple(points)

    def bounds(self, situation: Situation, joint: Place) -> tuple[tuple[float, float], ...]:
        """Bounds the load at which sides change to values near zero, and the rotor inertia to its known range."""
        assert joint is not None
        gap, longest, *_, landing = self.shapes
        most = FARTHEST * _size(situation, joint)
        return (
            (gap.lower, gap.upper),
            (longest.lower, longest.upper),
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
        rotors = (KNOWN,) if is_sure(situation, joint) else (KNOWN, None)
        either = ((LANDS, None), rotors, (0.0, None), (SLOWEST, None), (gap, None))
        return tuple((g, s, z, r, lands) for lands, r, z, s, g in product(*either))[:-1]

    def other_optima(
        self, situation: Situation, joint: Place, shape: tuple[float, ...], coefficients: Array
    ) -> tuple[tuple[tuple[float, ...], ...], ...]:
        """Lists starts with the gap that follows from the torque's size, and starts with other rotor inertias.

        The first start keeps the present crossing time as `longest`; free motion in that time means a smaller gap.
        Another rotor inertia makes the load change sign at other times. Its optimum is narrow, so that a joint search
        over rotor inertia and load misses it.
        """
        assert joint is not None
        gap = float(np.clip(2.0 * coefficients[0], self.shapes[0].lower, self.shapes[0].upper))
        _, _, quickness = _crossings(situation, joint, *shape[2:4])
        if not len(quickness):
            return ()
        now = float(np.median(_flights(situation, shape, quickness)))
        slower = ((gap, max(now, self.shapes[1].lower), *shape[2:]),) if gap > shape[0] else ()
        rotors = rotors_between(situation, joint)
        turned = tuple((size * shape[0], SLOWEST, 0.0, rotor, shape[4]) for size in (1.0, 2.0) for rotor in rotors)
        return tuple(starts for starts in (slower, turned) if starts)

    def columns(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque of all joints per half backlash of one joint (N, n, 1)."""
        assert joint is not None
        _, _, at, rotor, landing = shape
        times, ways, quickness = _crossings(situation, joint, at, rotor)
        flights = _flights(situation, shape, quickness)
        side, rate, curve = (np.zeros(len(situation)) for _ in range(3))
        load = load_beside(situation, joint, rotor) - at
        for run in situation.runs:
            t = situation.t[run]
            inside = (times >= t[0]) & (times <= t[-1])
            start, jump, flight = times[inside], 2 * ways[inside], flights[inside]
            begins, last = np.searchsorted(t, (start, start + flight + (1 + SETTLES) * landing))
            # Rows of all crossings, concatenated; crossings may overlap.
            count = last - begins
            of = np.repeat(np.arange(len(start)), count)
            rows = np.arange(len(of)) + np.repeat(begins - np.cumsum(count) + count, count)
            crossed, speed, push = (jump[of] * part for part in _course(t[rows] - start[of], flight[of], landing))
            curve[run], rate[run], crossed = (np.bincount(rows, part, len(t)) for part in (push, speed, crossed))
            first = -ways[inside][0] if inside.any() else np.sign(np.sum(load[run]))
            side[run] = first + np.cumsum(np.bincount(last, jump, len(t) + 1)[: len(t)]) + crossed
        return windup(situation, joint, side, rate, curve, rotor)[:, :, None]

    def describe(
        self,
        joint: Place,
        coefficients: Array,
        shape: tuple[float, ...] = (),
        *,
        force: str = "N m",
        length: str = "rad",
    ) -> str:
        """Describes the values in one sentence."""
        return (
            f"The gear of joint {joint} has {2 * coefficients[0]:.3g} {length} of backlash; the link moves through it "
            f"when "
            "the load changes sign."
        )

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Returns the gear's load."""
        assert joint is not None
        unit = force_unit(situation.robot, joint - 1)
        return f"load of joint {joint} [{unit}]", load_beside(situation, joint, shape[3] if len(shape) > 3 else KNOWN)


def _course(since: Array, flight: Array, landing: float) -> tuple[Array, Array, Array]:
    """Evaluates the motion of a link through a gap of size one.

    A force that grows from zero accelerates the link. At the flank a half wave of force reverses its velocity to the
    fraction `REBOUND`, which decays within `SETTLES` landing times.

    Args:
        since: time since the start of the crossing (K,) [s].
        flight: time until the link reaches the flank (K,) [s].
        landing: time in which the flank stops the link [s].

    Returns:
        The position (K,), and its two derivatives [1/s] and [1/s2].
    """
    lost = SETTLES * landing
    grows = 1.0 / (flight**3 / 6 + flight**2 / 4 * ((1 - REBOUND) * landing - REBOUND * lost))  # of its acceleration
    speed, over = grows * flight**2 / 2, grows * flight**3 / 6
    u, k = np.pi * (since - flight) / landing, np.pi * np.clip((since - flight - landing) / lost, 0.0, 1.0)
    mean, swing, back = speed * (1 - REBOUND) / 2, speed * (1 + REBOUND) / 2, speed * REBOUND / 2
    when = [since < flight, since < flight + landing]
    there = over + mean * landing - back * lost * (k + np.sin(k)) / np.pi
    position = [grows * since**3 / 6, over + landing * (mean * u + swing * np.sin(u)) / np.pi]
    rate = [grows * since**2 / 2, mean + swing * np.cos(u)]
    curve = [grows * since, -swing * np.pi / landing * np.sin(u)]
    return (
        np.select(when, position, there),
        np.select(when, rate, -back * (1 + np.cos(k))),
        np.select(when, curve, back * np.pi / lost * np.sin(k)),
    )


def _flights(situation: Situation, shape: tuple[float, ...], quickness: Array) -> Array:
    """Computes the times [s] from each load reversal to the landing: that of free motion, at most `longest`."""
    return np.clip((6.0 * shape[0] / quickness) ** (1 / 3), max(QUICKEST, situation.period), shape[1])


def _size(situation: Situation, joint: int) -> float:
    return float(np.sqrt(np.mean(situation.load[:, joint - 1] ** 2)))


def _crossings(situation: Situation, joint: int, at: float, rotor: float) -> tuple[Array, Array, Array]:
    """Finds where the load crosses a value: times [s], the new sign, and its rate over the link's inertia [rad/s3].

    A crossing counts only if the load exceeds `HOVERS` before it returns. A load that stays near zero, as on a
    joint without gravity load at constant speed, crosses only because of errors of the motion.
    """
    load = load_beside(situation, joint, rotor) - at
    inertia = np.maximum(link_inertia(situation, joint, rotor)[:, joint - 1], 1e-12)
    beyond = HOVERS * float(np.sqrt(np.mean(load**2))) if len(load) else 0.0
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
