"""Play in a gear: the link changes sides when its load changes sign."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from robots.terms.base import length_unit
from robots.terms.effect_bases.base import Coefficient, Effect, Place, Shape, Situation
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
"""Times [s] between which a crossing of the gap takes; a log shows nothing quicker than a sample."""
SCANNED = (0.006, 0.012, 0.025, 0.05, 0.1, 0.2)
"""Times [s] of a scan."""
ASIDE = (-0.03, -0.015, 0.0, 0.015, 0.03)
"""Loads of a scan at which the link changes sides, as shares of the load's root mean square."""
FARTHEST = 0.1
"""Largest such share: of a base model whose zero is less sure nothing follows."""
BRIEFEST, LANDS = 0.012, 0.02
"""Shortest and default time [s] in which a flank stops the link. The time of an impact is known to some milliseconds:
the prediction of a shorter impact would be worse than none."""
REBOUND, SETTLES = 0.2, 2.0
"""Share of its speed with which a link comes back from the flank, and in how many times its landing it loses that."""
LEAST, MOST = 1 / 8, 8.0
"""Uncertainty of the gap from its crossing time: the time, whose cube it is, is correct to a factor of two."""

HOVERS = 0.05
"""Share of its root mean square that a load must get beyond zero to have changed sides."""

INEXACT = 0.2
"""Share by which a play errs besides: links bounce otherwise, and drives give way to the kick, by as much."""
SMALLEST = 5e-7
"""Half a backlash below which it counts as zero [rad or m]: the roughness of teeth at a radius of 0.1 m."""


class Backlash(Effect):
    """The link lags its encoder by (b / 2) side: the side changes from where the load changes sign, in T + L.

    A load that grows by r per second moves the link's inertia M over the gap b in T = (6 b M / r)^(1/3), or in the
    longest time that the moving motor leaves. The motion in the gap grows with the third power of time, so the link is
    fastest when it lands. The far flank stops it with a half wave of force over a time L: half a period of the link on
    the stiffness of teeth and drive. The torque first lacks the load slightly for a long time, then shows a short and
    large impact. It follows from the lag as for an elastic gear: bursts at zero crossings of the load, not of the
    velocity. Size and duration of the bursts both determine the gap, each only roughly, because real crossings and
    landings vary. The zero of the load is known from the base model to some per cent; a log separates offset and load
    poorly, and a slow load crosses late.
    """

    name: ClassVar[str] = "backlash"
    title: ClassVar[str] = "gear backlash"
    depends_on_gear_load: ClassVar[bool] = True
    acceleration_driven: ClassVar[bool] = True
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("gap_crossed", "rad", 1e-7, 0.2, "log"),
        Shape("longest", "s", 0.01, SLOWEST, "log", (SLOWEST,), default=SLOWEST),
        Shape("crossed_at", "N m", -np.inf, np.inf, "linear", (0.0,), default=0.0),
        ROTOR,
        Shape("landing", "s", BRIEFEST, 0.1, "log", (LANDS,), default=LANDS),
    )
    rivals: ClassVar[tuple[str, ...]] = ("joint_elasticity", "presliding_hysteresis", "load_dependent_friction")
    independent_of_acceleration: ClassVar[bool] = True
    experiments: ClassVar[tuple[str, ...]] = ("payload", "micro_reversals")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes half the play."""
        assert joint is not None
        return (Coefficient("half_play", length_unit(robot, joint - 1), 0.0, 0.05, INEXACT, SMALLEST),)

    def ranges(self, robot: Robot, joint: Place, shape: tuple[float, ...]) -> tuple[tuple[float, float], ...]:
        """Links the backlash from the size of the torque to the gap from the crossing times."""
        ((lower, upper),) = super().ranges(robot, joint, shape)
        return ((max(lower, LEAST * shape[0] / 2), min(upper, MOST * shape[0] / 2)),)

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists gaps that take 6 to 50 ms, at loads near zero; none for a load that hardly ever changes sign."""
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
        """Keeps the load at which sides change near zero, and the rotor near what is known of it."""
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
        """Gives the gap from the size of the torque, for free motion, and the base model's zero."""
        gap = float(np.clip(2.0 * coefficients[0], self.shapes[0].lower, self.shapes[0].upper))
        # All but what was refined itself: each as it should be, or not.
        assert joint is not None
        rotors = (KNOWN,) if is_sure(situation, joint) else (KNOWN, None)
        either = ((LANDS, None), rotors, (0.0, None), (SLOWEST, None), (gap, None))
        return tuple((g, s, z, r, lands) for lands, r, z, s, g in product(*either))[:-1]

    def other_optima(
        self, situation: Situation, joint: Place, shape: tuple[float, ...], coefficients: Array
    ) -> tuple[tuple[tuple[float, ...], ...], ...]:
        """Gives the gap from the size of the torque with the present crossing time, limited by the motor.

        Free flight in the time that was seen asks for a smaller gap, and goes astray where loads change more slowly.
        Another rotor, where it is not sure, makes the load change sign at other times: a narrow summit on the right
        one, which a search along rotor and load together misses.
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
        """Evaluates the torque of all joints per half play of one."""
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
            # The rows of all crossings, one after the other; they may overlap.
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
        """Gives the gear's load."""
        assert joint is not None
        return f"load of joint {joint} [N m]", load_beside(situation, joint, shape[3] if len(shape) > 3 else KNOWN)


def _course(since: Array, flight: Array, landing: float) -> tuple[Array, Array, Array]:
    """Gives how far a link has crossed a gap of one, with both derivatives [1/s, 1/s2], some time [s] after its start.

    It flies under a force that grows from nothing. Half a wave of force takes what speed it has then and throws it back
    with a share of that, which it loses over some times as long.
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
    """Gives the times [s] that crossings take before they land: of free flight, or the longest."""
    return np.clip((6.0 * shape[0] / quickness) ** (1 / 3), max(QUICKEST, situation.period), shape[1])


def _size(situation: Situation, joint: int) -> float:
    return float(np.sqrt(np.mean(situation.load[:, joint - 1] ** 2)))


def _crossings(situation: Situation, joint: int, at: float, rotor: float) -> tuple[Array, Array, Array]:
    """Finds where the load passes a value: times [s], the new side, and its rate over the link's inertia [rad/s3].

    A crossing counts only if the load gets beyond `HOVERS` before it comes back. A load that stays near zero, as on a
    horizontal axis at constant speed, would cross only by errors of the motion.
    """
    load = load_beside(situation, joint, rotor) - at
    inertia = np.maximum(link_inertia(situation, joint, rotor)[:, joint - 1], 1e-12)
    beyond = HOVERS * float(np.sqrt(np.mean(load**2))) if len(load) else 0.0
    found = []
    for run in situation.runs:
        part = load[run]
        sure = np.flatnonzero(np.abs(part) > beyond)
        last = sure[:-1][part[sure[:-1]] * part[sure[1:]] < 0]
        # The load changes sign for good in the last row before the new side.
        changes = np.flatnonzero(part[:-1] * part[1:] <= 0)
        after = sure[np.searchsorted(sure, last, side="right")]
        found.append(run.start + changes[np.searchsorted(changes, after, side="left") - 1])
    i = np.concatenate(found) if found else np.zeros(0, dtype=np.intp)
    step = situation.t[i + 1] - situation.t[i]
    change = load[i + 1] - load[i]
    times = situation.t[i] - load[i] / np.where(change == 0, 1.0, change) * step
    return times, np.sign(change), np.abs(change) / step / inertia[i]
