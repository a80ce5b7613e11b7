"""Limits that are not linear in the coefficients, in the design and in the whole experiment around it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from oed.constraints import PointwiseLimit, TorqueLimit, TorqueRms
from oed.constraints.feasibility import check_feasible, nearest_feasible
from oed.constraints.geometric import CollisionLimit, GeometricLimit, GeometricLimits
from oed.experiments.assembly import assemble
from oed.experiments.safety_checks.spatial_check import SpatialCheck
from oed.trajectories import FourierSeries
from oed.trajectories import Sequence as Experiment
from robots.base_parameters import BaseParameters
from robots.collision import CollisionModel, CollisionReport, check_motion, collision_model
from robots.common.errors import InfeasibleError
from robots.limits import Limits
from robots.plants import PlantEffect
from robots.robot import Robot
from robots.signals import Motion

Array = NDArray[np.float64]

# Shares of the limits of speed and its derivatives that strokes and moves try in turn to keep the torque limits.
SLOWER = (1.0, 0.85, 0.7, 0.5, 0.35, 0.2)
# From each bound in space [m], of a home pose that had to be moved.
HOME_ROOM = 0.008
# Fraction of an RMS limit that the optimised part may use; the moves to and from it need the rest.
MOVES = 0.98


@dataclass(frozen=True, kw_only=True)
class Safety:
    """Limits of an experiment besides position, velocity, acceleration and jerk.

    Attributes:
        torque: the torque limit, where it is known.
        torque_rms: that of its root mean square.
        collision: bodies and obstacles, where they are to be watched.
        spatial: the same as rows for the solver, and further limits in space.
        check: judges those on a whole motion; None where there are none.
        home: pose (n,) at both ends.
        moved: whether that is not the pose that was asked for, because it breaks a limit in space.
    """

    home: Array
    torque: TorqueLimit | None = None
    torque_rms: TorqueRms | None = None
    collision: CollisionModel | None = None
    spatial: GeometricLimits | None = None
    check: SpatialCheck | None = None
    moved: bool = False

    @property
    def pointwise(self) -> tuple[PointwiseLimit, ...]:
        """The limits for the solver."""
        return tuple(limit for limit in (self.torque, self.spatial) if limit is not None)

    @property
    def averaged(self) -> tuple[TorqueRms, ...]:
        """The limits on root mean squares for the solver."""
        rms = self.torque_rms
        if rms is None:
            return ()
        return (TorqueRms(rms.model, rms.parameters, MOVES * rms.limit, margin=rms.margin, effects=rms.effects),)

    def report(self, motion: Motion) -> CollisionReport | None:
        """Proves a whole motion free of collisions, or finds where it is not."""
        return None if self.collision is None else check_motion(self.collision, motion, confirm=False)

    def assembled(
        self, series: FourierSeries, limits: Limits, period: float, strokes: bool
    ) -> tuple[Experiment, CollisionReport | None, tuple[int, ...]]:
        """Assembles an experiment that keeps these limits.

        Strokes and moves become slower until they keep the torque limits; strokes on which the arm would collide or
        break another limit in space are left out.

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
                wrong = self._broken(motion, report)
                if wrong is None:
                    break
                left_out += (_culprit(sequence, *wrong),)
            if self._strong_enough(motion):
                return sequence, report, left_out
        raise InfeasibleError(
            "the moves between the segments exceed a torque limit, even at low speed",
            remedy="choose another home pose (--home), or leave out the strokes (--no-strokes)",
        )

    def _strong_enough(self, motion: Motion) -> bool:
        states = (motion.q, motion.dq, motion.ddq)
        peak = self.torque is None or self.torque.excess(*states).max() <= 0
        return peak and (self.torque_rms is None or self.torque_rms.values(*states).max() <= 1)

    def _broken(self, motion: Motion, report: CollisionReport | None) -> tuple[float, str] | None:
        """The time and the kind of the largest workspace violation; None without any."""
        if report is not None and report.collides:
            worst = report.worst
            assert worst is not None
            depth = -1e3 * report.clearance[worst]
            return float(report.time[worst]), f"collides: {report.names[worst]} by {depth:.0f} mm"
        return None if self.check is None else self.check.broken(motion)


def collision_data(report: CollisionReport) -> dict[str, object]:
    """Writes what comes closest when, and whether that is proved, as plain data."""
    worst = report.worst
    return {
        "clearance": float(report.clearance[worst]) if worst is not None else None,
        "pair": report.names[worst] if worst is not None else None,
        "time": float(report.time[worst]) if worst is not None else None,
        "certified": report.certified,
    }


def _culprit(sequence: Experiment, time: float, what: str) -> int:
    """The joint whose stroke, or the move before or after it, causes the violation."""
    table = sequence.table()
    here = next(i for i, s in enumerate(table) if time <= float(s["end"]) + 1e-9)  # type: ignore[arg-type]
    for neighbour in (here, here + 1, here - 1):
        if 0 <= neighbour < len(table) and table[neighbour]["kind"] == "sinusoid":
            return int(table[neighbour]["joint"])  # type: ignore[call-overload]
    raise InfeasibleError(
        f"the move at {time:.2f} s {what}",
        remedy="choose another home pose (--home)",
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
    space: Sequence[GeometricLimit] = (),
    effects: Sequence[PlantEffect] = (),
) -> Safety:
    """Collects the limits that are to be kept, and checks the home pose against them.

    Args:
        robot: the robot.
        base: whose model gives the torques.
        home: pose (n,) at both ends.
        movable: whether another home pose may be used if this one is in collision.
        torque: keep torque limits, where they and the nominal dynamics are described.
        torque_margin: share of them kept in reserve.
        collision: watch the arm's own bodies, and the obstacles of the robot's file.
        clearance: between them [m].
        space: further limits in space.
        effects: effects beyond the robot's description; their torque counts in the torque limits.

    Raises:
        InfeasibleError: a home pose that cannot be held, is in collision or breaks another limit in space; a tool box
            that the robot cannot enter.
    """
    model = collision_model(robot) if collision else None
    bodies = () if model is None else (CollisionLimit(model=model, margin=clearance),)
    spatial, moved = None, False
    if bodies or space:
        spatial = GeometricLimits(robot=robot, limits=(*bodies, *space))
        try:
            check_feasible(robot, spatial, home)
        except InfeasibleError:
            # The solver keeps a little from each bound, and so must the pose to which it may have to shrink a motion.
            nearest = nearest_feasible(spatial, home, room=HOME_ROOM) if movable else None
            if nearest is None:
                raise
            home, moved = nearest, True
    limit = rms = None
    bound = np.asarray(robot.limits.torque)
    if torque and np.isfinite(base.model.nominal).all() and np.isfinite(bound).any():
        limit = TorqueLimit(base.model, base.model.nominal, bound, margin=torque_margin, effects=effects)
        limit.check_holding(home)
    continuous = np.asarray(robot.limits.torque_rms)
    if torque and np.isfinite(base.model.nominal).all() and np.isfinite(continuous).any():
        rms = TorqueRms(base.model, base.model.nominal, continuous, margin=torque_margin, effects=effects)
        rms.check_holding(home)
    check = SpatialCheck(GeometricLimits(robot=robot, limits=tuple(space))) if space else None
    return Safety(home=home, torque=limit, torque_rms=rms, collision=model, spatial=spatial, check=check, moved=moved)
