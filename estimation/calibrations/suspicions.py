"""Poses that are not what their file says: each suspicion is another reading of the numbers that fits much better."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from estimation.calibrations.fit import fit_geometry
from robots.common.errors import InputError, NotIdentifiableError, OedError
from robots.common.plain import several
from robots.geometry_errors.measurements.base import affine_fit
from robots.geometry_errors.model import GeometryModel
from robots.geometry_errors.poses import MeasuredPoses
from robots.robot import Robot

FULL_TURNS = 2.5 * 2.0 * np.pi  # rad; no joint of an arm turns farther
BETTER = 5.0  # times smaller an error has to become before another reading of the numbers is believed
GOOD = 0.03  # of the spread of the measurement: a robot whose description is right to this is read correctly
FAR = 1.5  # ranges of the joint, by which degrees leave it
FROZEN = 3  # rows with the same measurement at different poses
LOOSE = 2.0  # a tracker's unit that is off by this factor is another unit
ENOUGH = 60  # poses, evenly chosen, on which other readings are tried
LEAST = 6  # poses below which nothing is fitted: they give the setup, and leave no pose to check it
CLOSE = 1e-3  # rad or m; poses nearer than this are one


def refuse_suspicious(robots: Sequence[Robot], poses: MeasuredPoses) -> None:
    """Refuses poses that are in another unit, order or frame than stated, that repeat, or whose marker was lost.

    Args:
        robots: one per arm.
        poses: as they were read.

    Raises:
        InputError: with the cause and what to do.
    """
    _refuse_repeated(poses)
    require_enough(robots, poses)
    _refuse_degrees(robots[0], poses)
    _refuse_lost(poses)
    if poses.measurement.kind in ("markers", "poses"):
        _refuse_frame(robots[0], poses)
    _refuse_other_readings(robots, poses)


def require_enough(robots: Sequence[Robot], poses: MeasuredPoses) -> None:
    """Refuses poses that cannot even register the setup.

    Args:
        robots: one per arm.
        poses: the measured poses.

    Raises:
        NotIdentifiableError: naming how many there are and how many are needed.
    """
    observed, units = poses.observed, poses.measurement.units
    rows = np.isfinite(observed).any(axis=1) if observed.shape[1] else np.ones(len(poses), dtype=bool)
    # Visits of one pose are one pose.
    seen = len(np.unique(np.round(poses.q[rows] / CLOSE), axis=0))
    needed = LEAST
    if seen >= LEAST:
        setup = GeometryModel(robots, [], poses).start().values()
        needed = max(LEAST, int(np.ceil((sum(part.size for part in setup if not part.known) + 1) / len(units))))
    if seen < needed:
        raise NotIdentifiableError(
            several(seen, "measured pose") if seen == rows.sum() else f"{rows.sum()} rows of {several(seen, 'pose')}",
            file=poses.source.get("file"),
            allowed=f"at least {needed} for {poses.measurement.title}, and 30 or more for links",
            remedy="measure more poses; oed design --for calibration chooses them",
        )


def _error(poses: MeasuredPoses, problem: str, remedy: str, **place: object) -> InputError:
    return InputError(problem, file=poses.source.get("file"), remedy=remedy, **place)  # type: ignore[arg-type]


def _refuse_degrees(robot: Robot, poses: MeasuredPoses) -> None:
    largest = np.abs(poses.q).max(axis=0, initial=0.0)
    limits = robot.limits
    for j, kind in enumerate(robot.chain.kinds):
        if kind == "prismatic":
            continue
        span = limits.upper[j] - limits.lower[j]
        bound = max(abs(limits.lower[j]), abs(limits.upper[j])) + FAR * span if np.isfinite(span) else FULL_TURNS
        if largest[j] > min(bound, FULL_TURNS):
            raise _error(
                poses,
                f"positions of up to {largest[j]:.4g} rad: they are probably degrees",
                "read them as degrees: --angles deg",
                column=f"q{j + 1}",
                joint=j + 1,
            )


def _refuse_lost(poses: MeasuredPoses) -> None:
    """A marker that the tracker lost is written as zeros, or stays where it was last seen."""
    if poses.measurement.kind not in ("markers", "poses", "camera"):
        return
    block = 3 if poses.measurement.kind != "camera" else 2
    count = len(poses.measurement.units) // block if poses.measurement.kind == "markers" else 1
    assert poses.line is not None
    for k in range(count):
        own = poses.observed[:, 3 * k : 3 * k + 3] if poses.measurement.kind != "camera" else poses.observed[:, :2]
        name = poses.measurement.columns[3 * k] if count > 1 else poses.measurement.columns[0]
        zero = np.flatnonzero((own == 0.0).all(axis=1))
        if zero.size:
            raise _error(
                poses,
                f"{several(zero.size, 'row')} with the position 0, 0, 0: the marker was lost",
                "leave the cells of a lost marker empty",
                column=name,
                row=int(poses.line[zero[0]]),
            )
        moved = np.abs(np.diff(poses.q, axis=0)).max(axis=1, initial=0.0) > CLOSE
        with np.errstate(invalid="ignore"):
            frozen = (np.diff(own, axis=0) == 0.0).all(axis=1) & moved
        run = np.flatnonzero(frozen)
        if run.size:
            raise _error(
                poses,
                f"{several(run.size, 'row')} with the measurement of the row before, to the last digit, although the "
                "robot moved: the marker was lost",
                "leave the cells of a lost marker empty, or measure these poses again",
                column=name,
                row=int(poses.line[run[0] + 1]),
            )


def _refuse_repeated(poses: MeasuredPoses) -> None:
    if len(poses) > 1 and np.ptp(poses.q, axis=0).max(initial=0.0) < CLOSE:
        raise _error(
            poses,
            f"all {len(poses)} rows are one pose: no joint moves by more than {CLOSE:g} rad or m",
            "measure different poses; oed design --for calibration chooses them",
        )


def _refuse_frame(robot: Robot, poses: MeasuredPoses) -> None:
    """The best affine map from the measurement to the robot shows another unit and a mirrored frame."""
    if len(poses) < 8:
        return
    flange = robot.chain.flange(poses.q)
    affine, shift, marker = affine_fit(flange, poses.observed[:, :3])
    seen = np.isfinite(poses.observed[:, :3]).all(axis=1)
    target = flange[seen, :3, 3] + flange[seen, :3, :3] @ marker
    left = target - poses.observed[seen, :3] @ affine.T - shift
    if np.linalg.norm(left) > 0.3 * np.linalg.norm(target - target.mean(0)):
        return
    sizes = np.linalg.svd(affine, compute_uv=False)
    unit = 1.0 / float(np.exp(np.mean(np.log(np.maximum(sizes, 1e-12)))))
    if not 1.0 / LOOSE < unit < LOOSE:
        word = "millimetres" if 300.0 < unit < 3000.0 else f"units of 1/{unit:.3g} m"
        raise _error(
            poses,
            f"measured positions move {unit:.4g} times as far as the robot: they are probably {word}",
            "read them as millimetres: --lengths mm" if word == "millimetres" else "write them in m or mm",
            column=poses.measurement.columns[0],
        )
    if np.linalg.det(affine) < 0.0 and sizes[-1] > 0.5 * sizes[0]:
        raise _error(
            poses,
            "the measured positions are a mirror image of the robot's: the tracker's frame is left-handed",
            "export the tracker's data in a right-handed frame, or change the sign of one axis",
            column=poses.measurement.columns[0],
        )


@dataclass(frozen=True)
class _Reading:
    """Another reading of the numbers."""

    problem: str
    remedy: str
    change: Callable[[MeasuredPoses], MeasuredPoses]


def _refuse_other_readings(robots: Sequence[Robot], poses: MeasuredPoses) -> None:
    """Tries other readings where the poses do not fit the description."""
    if len(poses) > ENOUGH:
        poses = poses.part(np.linspace(0, len(poses) - 1, ENOUGH).astype(int))
    own = _misfit(robots, poses)
    if own < GOOD:
        return
    best, found = own / BETTER, None
    for reading in _readings(robots[0], poses):
        misfit = _misfit(robots, reading.change(poses))
        if misfit < best:
            best, found = misfit, reading
        if misfit < GOOD / BETTER:
            break
    if found is not None:
        raise _error(poses, found.problem, found.remedy)
    if own > 10.0 * GOOD:
        raise _error(
            poses,
            f"the poses do not fit {robots[0].name}: errors are {100.0 * own:.2g} % of the spread of the measurement",
            "check that the robot, the order and signs of its joints, and the tool are those of the file",
        )


def _misfit(robots: Sequence[Robot], poses: MeasuredPoses) -> float:
    """Error of the description with the setup fitted, as a share of the spread of what was measured."""
    try:
        fit = fit_geometry(GeometryModel(robots, [], poses))
    except (OedError, np.linalg.LinAlgError):
        return np.inf
    measurement = poses.measurement
    total = 0.0
    for unit in dict.fromkeys(measurement.units):
        own = fit.residual[:, [u == unit for u in measurement.units]]
        scale = {"m": _spread(robots[0], poses), "rad": 1.0, "px": 200.0}[unit]
        total = max(total, float(np.sqrt(np.nanmedian(own**2))) / scale)
    return total


def _spread(robot: Robot, poses: MeasuredPoses) -> float:
    places = robot.chain.flange(poses.q)[:, :3, 3]
    return max(float(np.sqrt(np.mean((places - places.mean(0)) ** 2))), 1e-3)


def _readings(robot: Robot, poses: MeasuredPoses) -> Iterator[_Reading]:
    if poses.measurement.kind == "poses":

        def reordered(given: MeasuredPoses) -> MeasuredPoses:
            observed = given.observed.copy()
            observed[:, 3:] = observed[:, [4, 5, 6, 3]]
            return replace(given, observed=observed)

        yield _Reading(
            "the quaternions fit much better in another order: the column qx holds w",
            "read them so: --quaternion wxyz",
            reordered,
        )

        def inverted(given: MeasuredPoses) -> MeasuredPoses:
            observed = given.observed.copy()
            turns = Rotation.from_quat(np.where(np.isfinite(observed[:, 3:]), observed[:, 3:], [0.0, 0.0, 0.0, 1.0]))
            observed[:, 3:] = turns.inv().as_quat()
            return replace(given, observed=observed)

        yield _Reading(
            "the turns fit much better inverted: they give the tracker in the body's axes",
            "invert the quaternions, or transpose the matrices",
            inverted,
        )
    degrees = np.array([1.0 if kind == "prismatic" else np.pi / 180.0 for kind in robot.chain.kinds])
    yield _Reading(
        "the joint positions fit much better as degrees",
        "read them as degrees: --angles deg",
        lambda given: replace(given, q=given.q * degrees),
    )
    if poses.measurement.kind == "distances":
        yield _Reading(
            "the distances fit much better as millimetres",
            "read them as millimetres: --lengths mm",
            lambda given: replace(given, observed=1e-3 * given.observed),
        )
    for i in range(robot.n):
        for j in range(i + 1, robot.n):
            if robot.chain.kinds[i] == robot.chain.kinds[j]:
                yield _swapped(i, j)
    for i in range(robot.n):
        yield _Reading(
            f"the poses fit much better with the sign of joint {i + 1} changed",
            f"change the sign of column q{i + 1}",
            _sign(i),
        )


def _swapped(i: int, j: int) -> _Reading:
    def change(given: MeasuredPoses) -> MeasuredPoses:
        q = given.q.copy()
        q[:, [i, j]] = q[:, [j, i]]
        return replace(given, q=q)

    return _Reading(
        f"the poses fit much better with joints {i + 1} and {j + 1} swapped",
        f"swap the columns q{i + 1} and q{j + 1}",
        change,
    )


def _sign(i: int) -> Callable[[MeasuredPoses], MeasuredPoses]:
    def change(given: MeasuredPoses) -> MeasuredPoses:
        q = given.q.copy()
        q[:, i] = -q[:, i]
        return replace(given, q=q)

    return change
