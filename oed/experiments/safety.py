"""Limits that are not linear in the coefficients, in the design and in the whole experiment around it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from oed.constraints import PointwiseLimit, TorqueLimit
from oed.constraints.feasibility import check_feasible, nearest_feasible
from oed.constraints.geometric import CollisionLimit, GeometricLimits
from oed.experiments.assembly import assemble
from oed.trajectories import FourierSeries, Sequence
from robots.base_parameters import BaseParameters
from robots.collision import CollisionModel, CollisionReport, check_motion, collision_model
from robots.common.errors import InfeasibleError
from robots.limits import Limits
from robots.robot import Robot
from robots.signals import Motion

Array = NDArray[np.float64]

# Shares of the limits of speed and its derivatives that strokes and moves try in turn to keep the torque limits.
SLOWER = (1.0, 0.85, 0.7, 0.5, 0.35, 0.2)


@dataclass(frozen=True, kw_only=True)
class Safety:
    """What an experiment must keep besides position, velocity, acceleration and jerk.

    Attributes:
        torque: the torque limit, where it is known.
        collision: bodies and obstacles, where they are to be watched.
        spatial: the same as rows for the solver.
        home: pose (n,) at both ends.
    """

    home: Array
    torque: TorqueLimit | None = None
    collision: CollisionModel | None = None
    spatial: GeometricLimits | None = None

    @property
    def pointwise(self) -> tuple[PointwiseLimit, ...]:
        """The limits for the solver."""
        return tuple(limit for limit in (self.torque, self.spatial) if limit is not None)

    def report(self, motion: Motion) -> CollisionReport | None:
        """Proves a whole motion free of collisions, or finds where it is not."""
        return None if self.collision is None else check_motion(self.collision, motion, confirm=False)

    def assembled(
        self, series: FourierSeries, limits: Limits, period: float, strokes: bool
    ) -> tuple[Sequence, CollisionReport | None, tuple[int, ...]]:
        """Assembles an experiment that keeps these limits.

        Strokes and moves become slower until they keep the torque limits; strokes on which the arm would collide are
        left out.

        Returns:
            The experiment, the proof of its clearance, and the joints whose stroke was left out.

        Raises:
            InfeasibleError: moves that pass a torque limit however slow, or collide.
        """
        joints = tuple(range(1, limits.n + 1)) if strokes else ()
        left_out: tuple[int, ...] = ()
        for factor in SLOWER:
            gentle = limits.scaled(velocity=factor, acceleration=factor, jerk=factor)
            while True:
                kept = tuple(joint for joint in joints if joint not in left_out)
                sequence = assemble(series, gentle, period=period, home=self.home, strokes=kept)
                motion = sequence.motion()
                report = self.report(motion)
                if report is None or not report.collides:
                    break
                left_out += (_culprit(sequence, report),)
            if self.torque is None or self.torque.excess(motion.q, motion.dq, motion.ddq).max() <= 0:
                return sequence, report, left_out
        raise InfeasibleError(
            "the moves pass a torque limit however slow they are",
            remedy="state another home pose, or leave out the strokes",
        )


def collision_data(report: CollisionReport) -> dict[str, object]:
    """Writes what comes closest when, and whether that is proved, as plain data."""
    worst = report.worst
    return {
        "clearance": float(report.clearance[worst]) if worst is not None else None,
        "pair": report.names[worst] if worst is not None else None,
        "time": float(report.time[worst]) if worst is not None else None,
        "certified": report.certified,
    }


def _culprit(sequence: Sequence, report: CollisionReport) -> int:
    """The joint whose stroke, or the move to or from it, collides first."""
    worst = report.worst
    assert worst is not None
    time = float(report.time[worst])
    table = sequence.table()
    here = next(i for i, s in enumerate(table) if time <= float(s["end"]) + 1e-9)  # type: ignore[arg-type]
    for neighbour in (here, here + 1, here - 1):
        if 0 <= neighbour < len(table) and table[neighbour]["kind"] == "sinusoid":
            return int(table[neighbour]["joint"])  # type: ignore[call-overload]
    raise InfeasibleError(
        f"the move at {time:.2f} s collides: {report.names[worst]} by {-1e3 * report.clearance[worst]:.0f} mm",
        remedy="state another home pose",
    )


def choose_safety(
    robot: Robot,
    base: BaseParameters,
    home: Array,
    *,
    movable: bool,
    torque: bool,
    torque_margin: float,
    collision: bool,
    clearance: float,
) -> Safety:
    """Collects the limits that are to be kept, and checks the home pose against them.

    Args:
        robot: the robot.
        base: whose model gives the torques.
        home: pose (n,) at both ends.
        movable: whether another home pose may be taken where this one is in collision.
        torque: keep torque limits, where they and the nominal dynamics are described.
        torque_margin: share of them kept in reserve.
        collision: watch the arm's own bodies, and the obstacles of the robot's file.
        clearance: between them [m].

    Raises:
        InfeasibleError: a home pose that cannot be held, or is in collision.
    """
    model = spatial = None
    if collision:
        model = collision_model(robot)
        spatial = GeometricLimits(robot=robot, limits=(CollisionLimit(model=model, margin=clearance),))
        try:
            check_feasible(robot, spatial, home)
        except InfeasibleError:
            nearest = nearest_feasible(spatial, home) if movable else None
            if nearest is None:
                raise
            home = nearest
    limit = None
    bound = np.asarray(robot.limits.torque)
    if torque and np.isfinite(base.model.nominal).all() and np.isfinite(bound).any():
        limit = TorqueLimit(base.model, base.model.nominal, bound, margin=torque_margin)
        limit.check_holding(home)
    return Safety(home=home, torque=limit, collision=model, spatial=spatial)
