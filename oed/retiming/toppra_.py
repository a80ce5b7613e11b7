"""Retiming of a path by TOPP-RA: as fast as velocity, acceleration, jerk and torque limits allow."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from oed.retiming.limits import finite_limits, limit_usage, require_inside, too_weak_to_hold
from oed.retiming.paths import PathPiece, split_path
from oed.retiming.refinement import ORDERS, Torque, refine
from oed.retiming.result import KEPT_LIMIT_USE, Retimed
from oed.retiming.timing import TimeLaw, kinematics
from oed.retiming.timing_problem import Friction, InverseDynamics
from robots.common.arrays import Array
from robots.common.errors import InfeasibleError, InputError
from robots.limits import Limits
from robots.signals import Motion

OVERSHOOT = (
    "the smooth path swings out between its points: add points near the limit, or stop at each (--method ruckig)"
)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Toppra:
    """Options of the retiming.

    Args:
        grid: cells of the path grid on each piece, at least 500: coarser ones let torque peak between the points.
        limit_jerk: whether finite jerk limits are kept too, which TOPP-RA by itself cannot do.

    Raises:
        InputError: a coarser grid.
    """

    grid: int = 1000
    limit_jerk: bool = True

    def __post_init__(self) -> None:
        if self.grid < 500:
            raise InputError(f"found a grid of {self.grid} cells", allowed="500 or more")


def retime(
    path: Motion | ArrayLike,
    limits: Limits,
    *,
    period: float,
    inverse_dynamics: InverseDynamics | None = None,
    friction: Friction | None = None,
    options: Toppra | None = None,
) -> Retimed:
    """Runs through the path of a motion as fast as the limits allow, at rest at both ends.

    The path is split where it has to rest (see `split_path`). Each piece, a cubic spline, is timed by TOPP-RA (Pham and
    Pham 2018). The time law is averaged over a short window (`TimeLaw`), to end without acceleration and to respect the
    jerk limits. It is sampled at the controller's period and stretched until its samples respect every limit. Friction
    uses the speed of the previous solution, because the algorithm allows only torques quadratic in speed.

    TOPP-RA has no jerk limits, and averaging costs time. Therefore `refine` improves the result and, between two rests
    of a motion, also the motion's own timing; the fastest is kept. A motion whose own timing respects the limits never
    becomes slower, and its path is kept exactly.

    Args:
        path: a motion, or waypoints (W, n) [rad].
        limits: bounds; infinite accelerations and jerks as in `finite_limits`; torque counts if `inverse_dynamics` is
            given.
        period: the controller's period [s].
        inverse_dynamics: (q, dq, ddq), (M, n) each, to the torque of the rigid body, rotors and offsets, (M, n) [N m].
        friction: dq (M, n) to the friction torque, (M, n) [N m]; any odd function of each joint's speed.
        options: of the algorithm.

    Returns:
        The new motion and how much of each limit it uses.

    Raises:
        InfeasibleError: a path outside the position limits, one that does not move, a zero limit, or torques that do
            not even hold the arm.
        InputError: waypoints that are no (W, n) array, or a joint without a velocity limit.
    """
    choices = options or Toppra()
    usable = stated = finite_limits(limits)
    if not choices.limit_jerk:
        usable = dataclasses.replace(usable, jerk=np.full_like(usable.jerk, np.inf))

    def torque(motion: Motion) -> Array | None:
        if inverse_dynamics is None:
            return None
        rigid = inverse_dynamics(motion.q, motion.dq, motion.ddq)
        return rigid if friction is None else rigid + friction(motion.dq)

    task = _Task(usable, period, inverse_dynamics, friction, torque, choices)
    if isinstance(path, Motion) and path.n == limits.n:
        chosen = [_fastest(stretch, task) for stretch in split_at_rests(path)]
    else:
        chosen = [_by_toppra(path, task)]
    if not any(len(timing.motion) > 1 for timing in chosen):
        raise InfeasibleError("the path contains no motion to retime")
    motion = _join([timing.motion for timing in chosen], period)
    return Retimed(
        motion=motion,
        method="toppra",
        duration_before=path.duration if isinstance(path, Motion) else np.nan,
        duration_after=motion.duration,
        usage=limit_usage(motion, stated, torque(motion)),
        usage_before=limit_usage(path, usable, torque(path)) if isinstance(path, Motion) else None,
        deviation=max(timing.deviation for timing in chosen),
        stops=sum(timing.stops for timing in chosen) + len(chosen) - 1,
        unit=limits.position_unit,
    )


@dataclasses.dataclass(frozen=True)
class _Task:
    """What all pieces of a path share."""

    limits: Limits
    period: float
    inverse_dynamics: InverseDynamics | None
    friction: Friction | None
    torque: Torque
    options: Toppra

    def refined(self, motion: Motion) -> Motion | None:
        return refine(
            motion,
            self.limits,
            period=self.period,
            inverse_dynamics=self.inverse_dynamics,
            friction=self.friction,
        )

    def keeps_limits(self, motion: Motion) -> bool:
        return (
            max(float(use.max()) for use in limit_usage(motion, self.limits, self.torque(motion)).values())
            <= KEPT_LIMIT_USE
        )


@dataclasses.dataclass(frozen=True)
class _Timing:
    """One way to run through a part of the path."""

    motion: Motion
    deviation: float = 0.0
    stops: int = 0


def _fastest(stretch: Stretch, task: _Task) -> _Timing:
    """Takes the fastest of the given timing, what refining makes of it, and TOPP-RA's."""
    given, timings = stretch.motion, []
    if stretch.smooth:
        require_inside(given.q, task.limits, tolerance=1e-6)
        if given.period is not None and abs(given.period / task.period - 1.0) < 1e-6 and task.keeps_limits(given):
            timings.append(_Timing(given))
        faster = task.refined(given)
        timings += [] if faster is None else [_Timing(faster)]
    try:
        found = _by_toppra(given, task)
    except InfeasibleError:
        # Its linear programmes can fail on paths that have a timing: the given one is proof.
        if not timings:
            raise
    else:
        # Deviation from the given path above which a timing that keeps the path exactly is preferred, however slow
        # [rad].
        if found.deviation <= 1e-4 or not timings:
            timings.append(found)
    return min(timings, key=lambda timing: len(timing.motion))


def _by_toppra(path: Motion | ArrayLike, task: _Task) -> _Timing:
    # Imported here because toppra brings in matplotlib.pyplot, which most commands do not need.
    try:
        from oed.retiming.path_speed import TorqueConstraint, path_speed
    except ModuleNotFoundError as error:
        raise InputError(
            f"this retiming needs the package {error.name}, which is not installed",
            remedy="use --method ruckig, or pip install toppra (a C++ compiler builds it where there is no wheel)",
        ) from error

    limits = task.limits
    pieces = split_path(path, limits.velocity)
    if not pieces:
        raise InfeasibleError("the path contains no motion to retime")
    require_inside(path.q if isinstance(path, Motion) else np.asarray(path), limits, tolerance=1e-6)
    timed = []
    for piece in pieces:
        require_inside(piece.spline(np.linspace(0.0, piece.length, 2001)), limits, 1e-6, OVERSHOOT)
        constraint = None
        if task.inverse_dynamics is not None:
            constraint = TorqueConstraint(task.inverse_dynamics, task.friction, limits.torque)
        grid, speed = path_speed(piece, limits, constraint, task.options.grid)
        motion = _best_window(piece, grid, speed, limits, task.period, task.torque)
        if np.isfinite(limits.jerk).any():
            faster = task.refined(motion)
            motion = faster if faster is not None and len(faster) < len(motion) else motion
        timed.append(motion)
    return _Timing(_join(timed, task.period), max(piece.deviation for piece in pieces), len(pieces) - 1)


def _best_window(
    piece: PathPiece,
    grid: Array,
    speed: Array,
    limits: Limits,
    period: float,
    torque: Torque,
) -> Motion:
    """Averages over several windows, stretches each result to the limits, and keeps the shortest."""
    natural = float((2.0 * limits.acceleration / limits.jerk).max())
    windows = sorted({max(2.0 * period, factor * natural) for factor in (0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0)})
    if not np.any(np.isfinite(limits.jerk)):
        windows = windows[:1]
    best: Motion | None = None
    for window in windows:
        law = TimeLaw.from_grid(grid, speed, window)
        motion = _stretched(piece, law, limits, period, torque, None if best is None else best.duration)
        if motion is not None and (best is None or motion.duration < best.duration):
            best = motion
    if best is None:
        raise _too_weak(piece, limits, torque)
    return best


def _too_weak(piece: PathPiece, limits: Limits, torque: Torque) -> InfeasibleError:
    """Names the joint that cannot even hold the arm, if that is why."""
    q = piece.spline(np.linspace(0.0, piece.length, 501))
    held = torque(Motion(np.arange(501.0), q, np.zeros_like(q), np.zeros_like(q)))
    if held is not None:
        weak = too_weak_to_hold(held, limits.torque, "gravity alone needs", limits)
        if weak is not None:
            return weak
    return InfeasibleError("no slower timing of this path respects the limits", remedy="check the torque limits")


def _stretched(
    piece: PathPiece,
    law: TimeLaw,
    limits: Limits,
    period: float,
    torque: Torque,
    give_up_at: float | None,
) -> Motion | None:
    """Stretches a law until its samples keep every limit; None where that fails or takes longer than `give_up_at`."""
    natural = law.duration
    count = int(np.ceil(natural / period - 1e-9))
    for _ in range(60):
        if give_up_at is not None and count * period >= give_up_at:
            return None
        t = period * np.arange(count + 1, dtype=np.float64)
        s, ds, dds = dataclasses.replace(law, stretch=count * period / natural).sample(t)
        motion = Motion(t, *kinematics(piece.spline, np.clip(s, 0.0, piece.length), ds, dds))
        usage = limit_usage(motion, limits, torque(motion))
        factor = max(float(usage[name].max()) ** (1.0 / ORDERS[name]) for name in usage)
        if factor <= 1.0:
            return motion
        count = max(count + 1, int(np.ceil(count * min(factor, 2.0))))
    return None


def _join(motions: list[Motion], period: float) -> Motion:
    """Puts pieces end to end; the rest where two meet is one sample."""
    parts = [motions[0], *(motion.slice(1, None) for motion in motions[1:])]
    q, dq, ddq = (np.concatenate([getattr(part, name) for part in parts]) for name in ("q", "dq", "ddq"))
    return Motion(period * np.arange(q.shape[0], dtype=np.float64), q, dq, ddq)


@dataclass(frozen=True, kw_only=True, eq=False)
class Stretch:
    """Samples from one rest to the next.

    Args:
        motion: the samples.
        smooth: whether it begins and ends without velocity and acceleration, and its derivatives belong to its
            positions: then its own timing is of use.
    """

    motion: Motion
    smooth: bool


def split_at_rests(motion: Motion) -> list[Stretch]:
    """Cuts a motion at samples where no joint has velocity or acceleration, and leaves out pauses.

    Args:
        motion: N samples of n joints.

    Returns:
        The stretches in order; one for a motion whose velocities do not belong to its positions; none for one that
        does not move.
    """
    if len(motion) < 2 or np.ptp(motion.q, axis=0).max() <= 1e-12:
        return []
    if not _consistent(motion):
        return [Stretch(motion=motion, smooth=False)]
    rests = _rests(motion)
    cuts = np.unique(np.concatenate([[0], np.flatnonzero(rests), [len(motion) - 1]]))
    return [
        Stretch(motion=motion.slice(a, b + 1), smooth=bool(rests[a] and rests[b]))
        for a, b in pairwise(cuts)
        if b - a > 1 or np.abs(motion.q[b] - motion.q[a]).max() > 1e-9
    ]


def _rests(motion: Motion) -> NDArray[np.bool_]:
    share = np.zeros(len(motion))
    for values in (motion.dq, motion.ddq):
        largest = np.abs(values).max(axis=0)
        share = np.maximum(share, (np.abs(values) / np.where(largest > 0.0, largest, 1.0)).max(axis=1))
    # Velocity and acceleration over their largest magnitudes below which a joint rests.
    return share <= 1e-6


def _consistent(motion: Motion) -> bool:
    h = np.diff(motion.t)[:, None]
    mean = (motion.dq[1:] + motion.dq[:-1]) / 2
    expected = h * mean - h**2 / 12 * np.diff(motion.ddq, axis=0)
    # Difference of a step from what velocity and acceleration make of it [rad or m] above which they are of no use.
    return bool(np.abs(np.diff(motion.q, axis=0) - expected).max() <= 1e-5)
