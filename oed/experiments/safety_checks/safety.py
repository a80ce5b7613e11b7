"""Limits that are not linear in the coefficients, in the design and in the whole experiment around it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from oed.constraints import PointwiseLimit, StateLimits, TorqueLimit, TorqueRms, VelocityRampLimit
from oed.constraints.feasibility import check_feasible, roomy_pose
from oed.constraints.geometric import CollisionLimit, GeometricLimits
from oed.experiments.assembly import assemble
from oed.experiments.options import LimitOptions
from oed.experiments.safety_checks.spatial_check import SpatialCheck
from oed.trajectories import Sequence as Experiment
from oed.trajectories import Trajectory
from robots.base_parameters import BaseParameters
from robots.collision import CollisionModel, CollisionReport, check_motion
from robots.common.arrays import Array
from robots.common.errors import InfeasibleError
from robots.limits import Limits
from robots.robot import Robot
from robots.signals import Motion

# Shares of the limits of speed and its derivatives that strokes and moves try in turn to keep the torque limits.
SLOWER = (1.0, 0.85, 0.7, 0.5, 0.35, 0.2)


@dataclass(frozen=True, kw_only=True)
class Safety:
    """Limits of an experiment besides position, velocity, acceleration and jerk.

    Attributes:
        torque: the torque limit, where it is known.
        torque_rms: that of its root mean square.
        collision: bodies and obstacles, where they are to be watched.
        spatial: the same as rows for the solver, and further limits in space.
        check: judges those on a whole motion; None where there are none.
        motion: further limits of position, velocity and acceleration; None where there are none.
        home: pose (n,) at both ends.
        moved: whether that is not the pose that was asked for, because it breaks a limit in space.
        movable: whether another home pose may be used.
    """

    home: Array
    torque: TorqueLimit | None = None
    torque_rms: TorqueRms | None = None
    collision: CollisionModel | None = None
    spatial: GeometricLimits | None = None
    check: SpatialCheck | None = None
    motion: StateLimits | None = None
    moved: bool = False
    movable: bool = False

    @property
    def pointwise(self) -> tuple[PointwiseLimit, ...]:
        """The limits for the solver."""
        return tuple(limit for limit in (self.torque, self.spatial, self.motion) if limit is not None)

    @property
    def averaged(self) -> tuple[TorqueRms, ...]:
        """The limits on root mean squares for the solver."""
        rms = self.torque_rms
        if rms is None:
            return ()
        # Fraction of an RMS limit that the optimised part may use; the moves to and from it need the rest.
        return (TorqueRms(rms.model, rms.parameters, 0.98 * rms.limit, margin=rms.margin, effects=rms.effects),)

    def report(self, motion: Motion) -> CollisionReport | None:
        """Proves a whole motion free of collisions, or finds where it is not."""
        return None if self.collision is None else check_motion(self.collision, motion, confirm=False)

    def assembled(
        self, excitation: Trajectory, kind: str, limits: Limits, period: float, strokes: bool
    ) -> tuple[Experiment, CollisionReport | None, tuple[int, ...], Safety]:
        """Assembles an experiment that keeps these limits.

        Strokes and moves become slower until they keep the limits of torque and motion; strokes on which the arm would
        collide or break another limit in space are left out. Where the way from home to the optimised part is blocked,
        and home may move, the experiment begins and ends where that part does.

        Returns:
            The experiment, the proof of its clearance, the joints whose stroke was left out, and these limits with the
            home pose that was taken.

        Raises:
            InfeasibleError: moves that pass a limit of torque or motion however slow, or collide.
        """
        try:
            return (*self._assembled(excitation, kind, limits, period, strokes), self)
        except InfeasibleError:
            if not self.movable:
                raise
        here = replace(self, home=excitation.sample(np.zeros(1)).q[0], moved=True)
        return (*here._assembled(excitation, kind, limits, period, strokes), here)

    def _assembled(
        self, excitation: Trajectory, kind: str, limits: Limits, period: float, strokes: bool
    ) -> tuple[Experiment, CollisionReport | None, tuple[int, ...]]:
        joints = tuple(range(1, limits.n + 1)) if strokes else ()
        left_out: tuple[int, ...] = ()
        while True:
            for factor in SLOWER:
                gentle = limits.scaled(velocity=factor, acceleration=factor, jerk=factor)
                while True:
                    kept = tuple(joint for joint in joints if joint not in left_out)
                    sequence = assemble(excitation, gentle, period=period, home=self.home, kind=kind, strokes=kept)
                    motion = sequence.motion()
                    report = self.report(motion)
                    wrong = self._broken(motion, report)
                    if wrong is None or _segment_at(sequence, wrong[0])["kind"] == kind:
                        break  # Another stroke or move does not help the optimised part: the report says what it does.
                    left_out += (_culprit(sequence, *wrong),)
                hardest = self._hardest(motion)
                if hardest is None:
                    return sequence, report, left_out
            assert hardest is not None
            left_out += (_culprit(sequence, hardest, "exceeds a limit of torque or motion, even at low speed"),)

    def _hardest(self, motion: Motion) -> float | None:
        """The time at which a limit of torque or motion is passed most; None where all are kept [s]."""
        states = (motion.q, motion.dq, motion.ddq)
        found = [limit.excess(*states).max(axis=1) for limit in (self.torque, self.motion) if limit is not None]
        excess = np.max([np.full(len(motion), -np.inf), *found], axis=0)
        if excess.max() > 0.0:
            return float(motion.t[int(excess.argmax())])
        rms = self.torque_rms
        if rms is None or rms.values(*states).max() <= 1.0:
            return None
        joint = int(rms.values(*states).argmax())
        return float(motion.t[int(np.abs(rms.torque.values(*states)[:, joint]).argmax())])

    def _broken(self, motion: Motion, report: CollisionReport | None) -> tuple[float, str] | None:
        """The time and the kind of the largest workspace violation; None without any."""
        if report is not None and report.collides:
            if report.meetings:
                pair, time = report.meetings[0]
                return time, f"collides: {pair}, by their drawn shapes"
            worst = report.worst
            assert worst is not None
            depth = -1e3 * report.clearance[worst]
            return float(report.time[worst]), f"collides: {report.names[worst]} by {depth:.0f} mm"
        return None if self.check is None else self.check.broken(motion)


def _segment_at(sequence: Experiment, time: float) -> dict[str, object]:
    return next(s for s in sequence.table() if time <= float(s["end"]) + 1e-9)  # type: ignore[arg-type]


def _culprit(sequence: Experiment, time: float, what: str) -> int:
    """The joint whose stroke, or the move before or after it, causes the violation."""
    table = sequence.table()
    here = table.index(_segment_at(sequence, time))
    for neighbour in (here, here + 1, here - 1):
        if 0 <= neighbour < len(table) and table[neighbour]["kind"] == "sinusoid":
            return int(table[neighbour]["joint"])  # type: ignore[call-overload]
    raise InfeasibleError(
        f"the move at {time:.2f} s {what}",
        remedy="choose another home pose (--home)",
    )


def choose_safety(robot: Robot, base: BaseParameters, home: Array, limits: LimitOptions, *, movable: bool) -> Safety:
    """Collects the limits that are to be kept, and checks the home pose against them.

    Args:
        robot: the robot.
        base: whose model gives the torques.
        home: pose (n,) at both ends.
        limits: the limits to keep.
        movable: whether another home pose may be used if this one cannot.

    Raises:
        InfeasibleError: a home pose that cannot be held, is in collision or breaks another limit; a tool box that the
            robot cannot enter.
    """
    model = limits.collision_model(robot)
    bodies = () if model is None or not model.pairs else (CollisionLimit(model=model, margin=limits.clearance),)
    space = tuple(limits.space)
    spatial = GeometricLimits(robot=robot, limits=(*bodies, *space))
    torque, torque_rms = _torque_limits(robot, base, limits)
    ramp = () if robot.limits.ramp is None else (VelocityRampLimit(limits=robot.limits),)
    own = (*ramp, *limits.motion)
    motion = StateLimits(robot=robot, limits=own) if own else None

    def check(pose: Array) -> None:
        check_feasible(robot, spatial, pose)
        for holding in (torque, torque_rms):
            if holding is not None:
                holding.check_holding(pose)
        if motion is not None:
            _check_rest(motion, pose)

    moved = False
    try:
        check(home)
    except InfeasibleError:
        pose = roomy_pose(spatial, home, torque=torque) if movable else None
        if pose is None:
            raise
        check(pose)
        home, moved = pose, True
    return Safety(
        home=home,
        torque=torque,
        torque_rms=torque_rms,
        collision=model,
        spatial=spatial if spatial.size else None,
        check=SpatialCheck(GeometricLimits(robot=robot, limits=space)) if space else None,
        motion=motion,
        moved=moved,
        movable=movable,
    )


def _torque_limits(
    robot: Robot, base: BaseParameters, limits: LimitOptions
) -> tuple[TorqueLimit | None, TorqueRms | None]:
    """The limits of torque and of its root mean square, where they and the nominal dynamics are described."""
    peak = rms = None
    model, effects = base.model, limits.static_effects
    known = limits.torque and model.described
    if known and np.isfinite(robot.limits.torque).any():
        peak = TorqueLimit(model, model.nominal, robot.limits.torque, margin=limits.torque_margin, effects=effects)
    if known and np.isfinite(robot.limits.torque_rms).any():
        rms = TorqueRms(model, model.nominal, robot.limits.torque_rms, margin=limits.torque_margin, effects=effects)
    return peak, rms


def _check_rest(motion: StateLimits, home: Array) -> None:
    q = np.atleast_2d(home)
    values = motion.values(q, np.zeros_like(q), np.zeros_like(q))[0]
    wrong = np.flatnonzero(~(np.abs(values) <= 1))
    if wrong.size:
        row = int(wrong[0])
        raise InfeasibleError(
            f"at rest in the home pose the limit {motion.labels[row]!r} is at {values[row]:.3g} times its bound",
            allowed="-1 to 1",
        )
