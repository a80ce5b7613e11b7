"""The search for the reading of a log under which its torques follow from its motion."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimation.gate.meanings.any_arm import any_arm
from estimation.gate.meanings.changes import SAME, Change, angle_between, columns, couplings, gravities, torque_units
from estimation.gate.meanings.comparison import STANDARD, Comparison, mean_log
from estimation.gate.meanings.described import JointEvidence
from estimation.gate.meanings.hypotheses import hypotheses
from estimation.gate.quick_fits.fitted import Fitted
from estimation.gate.quick_fits.reading import Reading
from estimation.gate.quick_fits.whole_fit import POORLY_EXPLAINED, WholeFit
from estimation.recordings.rows.motion import HARDLY, beyond_limits, travel_shares
from robots.common.arrays import Array
from robots.robot import Robot

# Held-out error over the torque's standard deviation (geometric mean of the joints), below which columns and units are
# right, and below which gravity is right as well.
WELL, VERY_WELL = 0.1, 0.04
# Held-out error of a single joint over its torque's standard deviation, from which columns and units are doubted.
DOUBTFUL = 0.2
# Decrease of the error (mean log) from which a change is followed up, and by which a simpler one may be worse than the
# best.
FOLLOWED, SNAP = 0.05, 0.02
# Least decrease of the held-out error by a change: the mean log of all joints by another gravity or unit of all
# torques, and the sum of all joints by other columns.
BETTER, OTHER_COLUMNS = 0.15, 0.8
# Standard errors of the decrease over the folds, from which it is no chance.
SURE = 5.0
# What a joint beyond its limits adds to the sum of the errors (log).
OUTSIDE = 2.0
# Angle [rad] up to which another direction of gravity is a tilt of the base.
TILTED = 0.2
# Log of the odds against joint torques from which other readings are tried.
UNLIKELY = 8.0


@dataclass(frozen=True, eq=False)
class Found:
    """The most likely reading.

    Attributes:
        reading: of the log.
        changes: its parts; none for a log that is read as it was logged.
        before: fit of the log as it was logged.
        after: fit of the log as it is read.
        certain: whether the log fits with this reading only.
        likewise: what explains the log as well, and is no other reading: an effect of the catalogue; empty without.
    """

    reading: Reading
    changes: tuple[Change, ...]
    before: WholeFit
    after: WholeFit
    certain: bool = False
    likewise: str = ""

    @property
    def better(self) -> float:
        """Decrease of the held-out error (mean log)."""
        return mean_log(np.minimum(self.before.unexplained, 1.0)) - mean_log(self.after.unexplained)


def find_reading(logged: Fitted, evidence: Sequence[JointEvidence]) -> Found:
    """Finds the reading with the smallest held-out error of all joints together, change by change.

    All readings are compared by this number. A change that does not bring its least decrease is left out again. A
    reading is certain if the log does not fit as it was logged, and fits well with it in all parts of the log.

    Args:
        logged: the log as it was logged.
        evidence: of its torques, see `joint_evidence`; empty without described links.
    """
    fits = Comparison(logged)
    before = fits.fit(Reading())
    as_logged = Found(Reading(), (), before, before)
    suspects = set(np.flatnonzero(beyond_limits(fits.robot, logged.rows.q)).tolist())
    sizes = list(_sizes(fits.robot, evidence))
    suspects |= {joint for change in sizes if change.odds > UNLIKELY for joint in change.reading.moved(fits.robot.n)}
    if mean_log(before.unexplained) < np.log(VERY_WELL) and not _is_doubtful(before) and not suspects:
        return as_logged
    path = _path(logged, fits, before, suspects, sizes)
    reading = joined(path)
    after = fits.fit(reading)
    while path:
        losses = [_worth(path, place, fits, after) for place in range(len(path))]
        if min(losses) >= 1.0:
            break
        path.pop(int(np.argmin(losses)))
        reading = joined(path)
        after = fits.fit(reading)
    inside = _outside(fits, reading) < _outside(fits, Reading())
    if not path or not (inside or is_sure(before.by_fold, after.by_fold)):
        return as_logged
    # Torques of another size are named by their description, and may be noise beside.
    named = [change for change in path if change.kind != "size"]
    left = after.unexplained[joined(named).moved(fits.robot.n)]
    if named and not named[0].whole and np.nanmax(left) > POORLY_EXPLAINED:
        return as_logged
    likewise = _likewise(fits, path, after)
    fits_well = bool(named) and mean_log(left) < np.log(WELL) and float(np.nanmax(left)) < DOUBTFUL
    misread = any(not change.whole for change in path) or _is_doubtful(before)
    certain = not likewise and misread and fits_well
    return Found(reading, tuple(path), before, after, certain, likewise)


def _is_doubtful(fit: WholeFit) -> bool:
    return mean_log(fit.unexplained) > np.log(WELL) or float(np.nanmax(fit.unexplained, initial=0.0)) > DOUBTFUL


def _path(logged: Fitted, fits: Comparison, before: WholeFit, suspects: set[int], sizes: list[Change]) -> list[Change]:
    """Follows the change with the smallest error, as long as there is one."""
    path: list[Change] = []
    cost, now = fits.cost(Reading(), few=True) + _outside(fits, Reading()), before
    while len(path) < fits.robot.n + 1:
        reading = joined(path)
        tried = [
            (fits.cost(after, few=True) + _outside(fits, after), change)
            for change in _changes(fits, reading, now, set() if path else suspects, sizes)
            for after in [reading.then(change.reading)]
            if _is_possible(fits.robot, logged.rows.q, after)
        ]
        if not tried or min(one[0] for one in tried) > cost - FOLLOWED:
            break
        cost, change = min(tried, key=lambda one: one[0])
        path.append(_refined(fits, reading, change, tried))
        now = fits.fit(joined(path))
    return path


def _changes(
    fits: Comparison, reading: Reading, now: WholeFit, suspects: set[int], sizes: list[Change]
) -> Iterator[Change]:
    robot = fits.robot
    if reading.gravity is None and not reading.compensated:
        yield from gravities(fits)
    if not _is_doubtful(now) and not suspects:
        return
    if reading.coupling is None:
        bad = sorted(suspects | set(np.flatnonzero(now.unexplained > DOUBTFUL).tolist()))
        yield from columns(robot, np.flatnonzero(np.isfinite(now.unexplained)).tolist(), bad)
        yield from couplings(fits, bad)
    if reading.tau_factor is None:
        yield from sizes if robot.has_masses else torque_units(robot)


def _sizes(robot: Robot, evidence: Sequence[JointEvidence]) -> Iterator[Change]:
    """Gives torques of the described size, if the description has links and some joints are far from it."""
    for best in hypotheses(robot, evidence)[:1] if evidence else []:
        if best.odds > 0 and best.kind in ("current", "motor", "percent", "unit"):
            factors = np.ones(robot.n)
            factors[list(best.joints)] = 1.0 / np.array(best.factors)
            yield Change("size", Reading(tau_factor=factors), odds=best.odds)


def joined(path: Iterable[Change]) -> Reading:
    """Gives the reading that applies changes one after the other."""
    reading = Reading()
    for change in path:
        reading = reading.then(change.reading)
    return reading


def _is_possible(robot: Robot, q: Array, reading: Reading) -> bool:
    """Whether a reading leaves the joints in their ranges, and moves them, as far as the logged positions do both."""
    if reading.q_from is None and reading.q_factor is None:
        return True
    logged, read = q, reading.motion(q)
    more = beyond_limits(robot, read).sum() > beyond_limits(robot, logged).sum()
    less = (travel_shares(robot, read) < HARDLY).sum() > (travel_shares(robot, logged) < HARDLY).sum()
    return not more and not less


def _worth(path: list[Change], place: int, fits: Comparison, after: WholeFit) -> float:
    """Gives the decrease of the error that one change of a path brings, over the least that it must bring."""
    before = joined(path[:place] + path[place + 1 :])
    better = mean_log(fits.fit(before).unexplained) - mean_log(after.unexplained)
    better += _outside(fits, before) - _outside(fits, joined(path))
    return better / BETTER if path[place].whole else better * fits.robot.n / OTHER_COLUMNS


def _outside(fits: Comparison, reading: Reading) -> float:
    """Gives what joints beyond their limits add to the error: such positions are wrong, whatever the torques say."""
    return OUTSIDE * float(beyond_limits(fits.robot, reading.motion(fits.q)).mean())


def is_sure(before: Array, after: Array) -> bool:
    """Whether the mean log error of the joints in the folds (n, F) decreases by many standard errors.

    A fold is a sixth of the log, which is much longer than the errors are correlated.
    """
    gains = np.log(np.clip(before, 1e-9, 1.0)) - np.log(np.clip(after, 1e-9, 1.0))
    known = np.isfinite(gains)
    mean = np.where(known, gains, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    mean = mean[known.any(axis=0)]
    return len(mean) > 1 and float(mean.mean()) > SURE * float(mean.std(ddof=1)) / np.sqrt(len(mean))


def _refined(fits: Comparison, reading: Reading, change: Change, tried: list[tuple[float, Change]]) -> Change:
    """Refines a direction of gravity; one along an axis of the base, or none, is preferred if it explains as much.

    Gravity along the axes of a planar arm acts on no joint, and is not made up.
    """
    if change.kind != "gravity":
        return change
    gravity = change.reading.gravity
    assert gravity is not None
    weightless = [one for one in tried if one[1].kind == "weightless"]
    if weightless:
        other = min(weightless, key=lambda one: one[0])[1]
        if fits.cost(reading.then(other.reading)) < fits.cost(replace(reading, gravity=gravity)) + SNAP:
            return other
    axes = [sign * STANDARD * axis for axis in np.eye(3) for sign in (1.0, -1.0)]
    free = [fits.refined_gravity(gravity, reading), gravity]
    costs = [fits.cost(replace(reading, gravity=direction)) for direction in (*free, *axes)]
    along = min(costs[2:]) < min(costs[:2]) + SNAP
    chosen = axes[int(np.argmin(costs[2:]))] if along else free[int(np.argmin(costs[:2]))]
    return Change("gravity", Reading(gravity=chosen))


def _likewise(fits: Comparison, path: list[Change], after: WholeFit) -> str:
    """Names the effect of the catalogue that explains the log as well as a path of one change."""
    (change, *more) = path
    if more:
        return ""
    if change.kind == "coupled":
        assert change.reading.coupling is not None
        row = change.reading.coupling[change.joint]
        (other,) = (k for k in np.flatnonzero(row) if k != change.joint)
        drives = fits.with_coupled_drives(change.joint, int(other))
        if mean_log(drives.unexplained) < mean_log(after.unexplained) + SNAP:
            return "joint_coupling"
    if change.kind == "gravity":
        assert change.reading.gravity is not None
        if SAME < angle_between(change.reading.gravity, np.asarray(fits.robot.chain.gravity)) < TILTED:
            return "base_tilt"
    return ""


def other_robot(logged: Fitted, found: Found) -> tuple[NDArray[np.intp], Array, Array] | None:
    """Finds out whether the best reading does not explain the log, but any other arm does.

    A single joint may have an effect of its position, as a spring, that the robot's model lacks and that of any arm
    has. It is no other robot.

    Returns:
        The joints, and the unexplained shares of all with this robot and with any (n,); None for this robot.
    """
    left = np.minimum(found.after.unexplained, 1.0)
    # Factors on the torques may hide that positions or masses are wrong.
    doubtful = left >= (0.0 if any(change.kind == "size" for change in found.changes) else DOUBTFUL)
    if not doubtful.any():
        return None
    any_ = any_arm(logged)
    order = np.arange(len(left)) if found.reading.tau_from is None else found.reading.tau_from
    other = np.minimum(any_.unexplained, 1.0)[order]
    wrong = np.flatnonzero(other < 0.5 * left)
    better = mean_log(left) - mean_log(other) > BETTER and is_sure(found.after.by_fold, any_.by_fold[order])
    if len(wrong) < 2 or not doubtful[wrong].any() or not better:
        return None
    return wrong, left, other
