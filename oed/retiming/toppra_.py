"""Retiming of a path by TOPP-RA: as fast as velocity, acceleration, jerk and torque limits allow."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from oed.retiming.limits import finite_limits, limit_usage, require_inside
from oed.retiming.paths import PathPiece, split_path
from oed.retiming.result import Retimed
from oed.retiming.timing import TimeLaw, kinematics
from robots.common.errors import InfeasibleError, InputError
from robots.limits import Limits
from robots.signals import Motion

Array = NDArray[np.float64]
InverseDynamics = Callable[[Array, Array, Array], Array]
Friction = Callable[[Array], Array]

_STRETCH_ROUNDS = 60


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

    The path is a cubic spline through the points given. It is split where it has to rest (see `split_path`). Each
    piece is timed by TOPP-RA (Pham and Pham 2018), the law averaged over a short window (`TimeLaw`) to end without
    acceleration and keep the jerk limits, sampled at the controller's period, and stretched until its own samples
    keep every limit. Friction enters at the speed of the solution before, for the algorithm knows torque that is
    quadratic in speed only.

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
    # Imported here because toppra brings in matplotlib.pyplot, which most commands do not need.
    from oed.retiming.path_speed import TorqueConstraint, path_speed

    choices = options or Toppra()
    usable = stated = finite_limits(limits)
    if not choices.limit_jerk:
        usable = dataclasses.replace(usable, jerk=np.full_like(usable.jerk, np.inf))
    pieces = split_path(path, usable.velocity)
    if not pieces:
        raise InfeasibleError("the path does not move: there is nothing to retime")

    def torque(motion: Motion) -> Array | None:
        if inverse_dynamics is None:
            return None
        rigid = inverse_dynamics(motion.q, motion.dq, motion.ddq)
        return rigid if friction is None else rigid + friction(motion.dq)

    timed = []
    for piece in pieces:
        require_inside(piece.spline(np.linspace(0.0, piece.length, 2001)), usable, tolerance=1e-6)
        constraint = None if inverse_dynamics is None else TorqueConstraint(inverse_dynamics, friction, usable.torque)
        grid, speed = path_speed(piece, usable, constraint, choices.grid)
        timed.append(_best_window(piece, grid, speed, usable, period, torque))
    motion = _join(timed, period)
    return Retimed(
        motion=motion,
        method="toppra",
        duration_before=path.duration if isinstance(path, Motion) else np.nan,
        duration_after=motion.duration,
        usage=limit_usage(motion, stated, torque(motion)),
        deviation=max(piece.deviation for piece in pieces),
        stops=len(pieces) - 1,
    )


def _best_window(
    piece: PathPiece,
    grid: Array,
    speed: Array,
    limits: Limits,
    period: float,
    torque: Callable[[Motion], Array | None],
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
        raise InfeasibleError("no slower timing of this path keeps the limits", remedy="check the torque limits")
    return best


def _stretched(
    piece: PathPiece,
    law: TimeLaw,
    limits: Limits,
    period: float,
    torque: Callable[[Motion], Array | None],
    give_up_at: float | None,
) -> Motion | None:
    """Stretches a law until its samples keep every limit; None where that fails or takes longer than `give_up_at`."""
    natural = law.duration
    count = int(np.ceil(natural / period - 1e-9))
    orders = {"velocity": 1.0, "acceleration": 2.0, "jerk": 3.0, "torque": 2.0}
    for _ in range(_STRETCH_ROUNDS):
        if give_up_at is not None and count * period >= give_up_at:
            return None
        t = period * np.arange(count + 1, dtype=np.float64)
        s, ds, dds = dataclasses.replace(law, stretch=count * period / natural).sample(t)
        motion = Motion(t, *kinematics(piece.spline, np.clip(s, 0.0, piece.length), ds, dds))
        usage = limit_usage(motion, limits, torque(motion))
        factor = max(float(usage[name].max()) ** (1.0 / orders[name]) for name in usage)
        if factor <= 1.0:
            return motion
        count = max(count + 1, int(np.ceil(count * min(factor, 2.0))))
    return None


def _join(motions: list[Motion], period: float) -> Motion:
    """Puts pieces end to end; the rest where two meet is one sample."""
    parts = [motions[0], *(motion.slice(1, None) for motion in motions[1:])]
    q, dq, ddq = (np.concatenate([getattr(part, name) for part in parts]) for name in ("q", "dq", "ddq"))
    return Motion(period * np.arange(q.shape[0], dtype=np.float64), q, dq, ddq)
