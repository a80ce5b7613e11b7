"""Motions that separate rivals, for a robot without logs: a reference within its limits, and what follows it.

The kinds of experiment are those of the diagnosis (`estimation.diagnosis.experiment_plans.experiment_motions`).
Here each becomes what a controller plays: stages within the limits, joined by jerk-limited moves, at rest at both ends.
"""

from __future__ import annotations

from collections.abc import Sequence as Items
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from estimation.diagnosis.experiment_plans.experiment_motions import MotionRange
from estimation.diagnosis.experiment_plans.experiment_motions import Stage as Part
from oed.experiments.assembly import rest_pose
from oed.experiments.safety_checks.margins import measured_margins
from oed.retiming import plan_move
from oed.retiming.limits import finite_limits
from oed.trajectories import FourierSeries, PiecewisePolynomial, Segment, Sequence
from oed.trajectories.base import round_up
from oed.trajectories.fourier import rest_basis
from robots.base_parameters import BaseParameters
from robots.common.arrays import Array
from robots.common.errors import InfeasibleError
from robots.limits import Limits, Margin
from robots.robot import Robot
from robots.signals import Motion

USED_LIMIT_SHARE = 0.9
"""Share of each limit that stages use: the rest is for what a controller makes of the samples."""
SLOWDOWN, SLOWDOWN_TRIES = 1.15, 12
"""A stage that passes a limit of torque is made slower by this factor, so often at most."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Run:
    """A motion that is played without a hand on the robot.

    Attributes:
        sequence: its segments.
        names: what each is: approach, reference, move, rest, or the kind of experiment.
        motion: at the controller's period, at rest at home at both ends.
        payload: mass of the known payload at the flange [kg].
        gravity: (3,) in the base frame where the base stands otherwise; None as described.
        margins: the closest approach to each limit.
    """

    sequence: Sequence
    names: tuple[str, ...]
    motion: Motion
    payload: float
    gravity: Array | None
    margins: tuple[Margin, ...]

    def table(self) -> list[dict[str, object]]:
        """Lists the segments as design files do, and what each of them is (`part`)."""
        return [{**entry, "part": name} for entry, name in zip(self.sequence.table(), self.names, strict=True)]

    def parts(self, step: float) -> tuple[Part, ...]:
        """Gives its data as the diagnosis judges them: about every `step` seconds, without long rests."""
        every = max(round(step / self.sequence.period), 1)
        edges, table = self.sequence.boundary_indices, self.table()
        parts: list[Part] = []
        begin, pause = 0, 0.0
        for number, entry in enumerate([*table, None]):
            length = 0.0 if entry is None else float(edges[number + 1] - edges[number]) * self.sequence.period
            # A rest of more seconds is not counted as data: nothing but heat changes in it.
            if entry is not None and (entry["part"] != "rest" or length <= 10.0):
                continue
            m = self.motion.slice(begin, int(edges[number]) + 1)
            if len(m) > 2 * every:
                t = m.t[::every] - m.t[0]
                thin = Motion(t, m.q[::every], m.dq[::every], m.ddq[::every])
                parts.append(Part(motion=thin, pause=pause, payload=self.payload, gravity=self.gravity))
            pause = length
            begin = int(edges[min(number + 1, len(table))])
        return tuple(parts)


class ExperimentBuilder:
    """Makes runs for one robot."""

    def __init__(
        self,
        base: BaseParameters,
        *,
        home: ArrayLike | None = None,
        velocity_fraction: float = 1.0,
        seed: int = 0,
        share: float = 1.0,
    ) -> None:
        """Finds the reference motion.

        Args:
            base: base parameters of the model.
            home: pose (n,) at both ends of all motions; by default `Limits.home`.
            velocity_fraction: share of the velocity limits to use.
            seed: of the reference motion.
            share: part of each joint's range, about the home pose, that the motions use.

        Raises:
            InputError: a home pose outside the limits, a joint without a velocity limit.
            InfeasibleError: no motion keeps the limits.
        """
        self.base, self.seed, self.share = base, seed, share
        self.robot: Robot = base.model.robot
        self.period = self.robot.period
        self.limits = replace(self.robot.limits, velocity=velocity_fraction * self.robot.limits.velocity)
        self.home = rest_pose(self.limits, home)
        self.usable = finite_limits(self.limits).scaled(
            velocity=USED_LIMIT_SHARE, acceleration=USED_LIMIT_SHARE, jerk=USED_LIMIT_SHARE / 2, torque=USED_LIMIT_SHARE
        )
        lower, upper = self._range()
        self.series = self._reference(lower, upper, np.random.default_rng(seed))
        # About the distance of the knots of stages [s].
        step = self.period * max(round(0.01 / self.period), 1)
        self.room = MotionRange(
            robot=self.robot,
            lower=lower,
            upper=upper,
            speed=self.usable.velocity,
            acceleration=self.usable.acceleration,
            reference=self.series.motion(step) if self._divides(step) else self.series.motion(self.period),
            step=step,
            payload=self._payload(),
        )

    def runs(self, parts: Items[Part] = (), kind: str = "reference") -> tuple[Run, ...]:
        """Makes runs of the stages of an experiment, the reference first; a change by hand begins a new one.

        Raises:
            InfeasibleError: a stage that no speed brings within the limits.
        """
        opening = Part(motion=self.room.reference)
        # Kinds that repeat the reference begin with it; `repeat` itself is the one that does not yet.
        again = len(parts) > 1 and parts[0].motion is self.room.reference
        groups: list[list[Part]] = []
        for part in parts if again else [opening, *parts]:
            before = groups[-1][0] if groups else None
            if before is None or before.payload != part.payload or before.gravity is not part.gravity:
                groups.append([])
            groups[-1].append(part)
        return tuple(self._run(group, kind) for group in groups)

    def run_alone(self, part: Part, kind: str) -> Run:
        """Makes a run of one stage, without the reference; it raises as `runs` does."""
        return self._run([part], kind)

    def _run(self, parts: Items[Part], kind: str) -> Run:
        segments: list[Segment] = []
        names: list[str] = []
        here = self.home
        for number, part in enumerate(parts):
            segment = self._segment(part, kind)
            first, last = segment.trajectory.sample([0.0, segment.trajectory.duration]).q
            way = "move" if number else "approach"
            move = self._move(way, here, first)
            segments += move
            names += [way] * len(move)
            rest = round_up(part.pause, self.period)
            if number and rest:
                segments.append(Segment(kind="move", trajectory=PiecewisePolynomial.hold(first, rest)))
                names.append("rest")
            segments.append(segment)
            names.append("reference" if segment.kind == "fourier" else kind)
            here = last
        back = self._move("move", here, self.home)
        segments += back
        names += ["move"] * len(back)
        sequence = Sequence(segments=tuple(segments), period=self.period)
        motion = sequence.motion()
        margins = measured_margins(replace(self.robot, limits=self.limits), motion, self.base)
        passed = next((margin for margin in margins if margin.violated), None)
        if passed is not None:
            raise InfeasibleError(
                f"the {passed.quantity} is {passed.value:.4g} at {passed.time:.2f} s",
                joint=passed.joint,
                allowed=f"{passed.limit:.4g}",
            )
        return Run(
            sequence=sequence,
            names=tuple(names),
            motion=motion,
            payload=parts[0].payload,
            gravity=parts[0].gravity,
            margins=margins,
        )

    def _segment(self, part: Part, kind: str) -> Segment:
        if part.motion is self.room.reference:
            return Segment(kind="fourier", trajectory=self.series)
        trajectory = self._fitted(part.motion)
        moving = np.flatnonzero(np.ptp(part.motion.q, axis=0) > 1e-9)
        joint = int(moving[0]) + 1 if len(moving) == 1 else None
        # The two kinds of design files that these resemble.
        return Segment(kind="friction" if kind == "sweep" else "sinusoid", trajectory=trajectory, joint=joint)

    def _fitted(self, motion: Motion) -> PiecewisePolynomial:
        """Makes a stage as slow as its limits ask for."""
        step = float(motion.t[1] - motion.t[0])
        # Knots of rest at either end of a stage: its spline's ringing falls by 3.7 a knot, to nothing.
        still = 30
        q = np.concatenate([np.repeat(motion.q[:1], still, axis=0), motion.q, np.repeat(motion.q[-1:], still, axis=0)])
        t = step * np.arange(len(q))
        spline = CubicSpline(t, q, bc_type="clamped")
        u = self.usable
        needed = [np.abs(spline(t, order)).max(axis=0) for order in (1, 2, 3)]
        slower = max(
            1.0,
            float(np.max(needed[0] / u.velocity)),
            float(np.max(needed[1] / u.acceleration)) ** 0.5,
            float(np.max(needed[2] / u.jerk)) ** (1 / 3),
        )
        for _ in range(SLOWDOWN_TRIES):
            duration = round_up(slower * float(t[-1]), self.period)
            scaled: Array = np.asarray(t * (duration / float(t[-1])), dtype=np.float64)
            pieces = CubicSpline(scaled, q, bc_type="clamped").c  # (4, K, n), highest power first
            trajectory = PiecewisePolynomial(
                breakpoints=scaled, coefficients=np.ascontiguousarray(np.transpose(pieces[::-1], (1, 2, 0)))
            )
            if self._torque_kept(trajectory.motion(self.period)):
                break
            slower *= SLOWDOWN
        return trajectory

    def _move(self, kind: str, start: Array, end: Array) -> list[Segment]:
        speed = 1.0
        for _ in range(SLOWDOWN_TRIES):
            limits = self.usable.scaled(velocity=speed, acceleration=speed**2, jerk=speed**3)
            planned = plan_move(limits, start, end, period=self.period)
            if planned is None:
                return []
            pieces = PiecewisePolynomial(breakpoints=planned.breakpoints, coefficients=planned.coefficients)
            if self._torque_kept(pieces.motion(self.period)):
                break
            speed /= SLOWDOWN
        return [Segment(kind=kind, trajectory=pieces)]

    def _torque_kept(self, motion: Motion) -> bool:
        model = self.base.model
        if not np.isfinite(self.usable.torque).any() or not model.described:
            return True
        tau = model.torque(motion.q, motion.dq, motion.ddq, model.nominal)
        return bool((np.abs(tau) <= self.usable.torque).all())

    def _reference(self, lower: Array, upper: Array, random: np.random.Generator) -> FourierSeries:
        """Draws a Fourier series at rest at its ends, each joint as large as its limits allow."""
        # A period of about 10 s.
        frequency = 1.0 / round_up(10.0, self.period)
        harmonics = 5
        rest = rest_basis(harmonics, frequency)
        free = random.standard_normal((self.robot.n, rest.shape[1]))
        free[:, 0] = 0.0
        repeats = 2
        wave = FourierSeries.from_coefficients(free @ rest.T, frequency, repeats)
        count = 50 * harmonics
        k = wave.sample(np.arange(count) / (count * frequency))
        u = self.usable
        scale = np.min(
            [
                (upper - lower) / np.ptp(k.q, axis=0),
                u.velocity / np.abs(k.dq).max(axis=0),
                u.acceleration / np.abs(k.ddq).max(axis=0),
                u.jerk / np.abs(k.dddq).max(axis=0),
            ],
            axis=0,
        )
        # A hundredth less: extremes lie between the samples.
        scale *= 0.99
        middle = (upper + lower) / 2 - scale * (k.q.max(axis=0) + k.q.min(axis=0)) / 2
        for _ in range(3 * SLOWDOWN_TRIES):
            rows = scale[:, None] * (free @ rest.T)
            rows[:, 0] = middle
            series = FourierSeries.from_coefficients(rows, frequency, repeats)
            if self._torque_kept(series.motion(self.period)):
                return series
            scale = scale / SLOWDOWN
            middle = self.home + (middle - self.home) / SLOWDOWN
        raise InfeasibleError(
            "no reference motion around the home pose respects the torque limits of the nominal dynamics",
            remedy="choose another home pose (--home), or correct the robot's torque limits or dynamics",
        )

    def _divides(self, step: float) -> bool:
        count = self.series.duration / step
        return abs(count - round(count)) < 1e-6

    def _range(self) -> tuple[Array, Array]:
        limits: Limits = self.limits
        # Half the range [rad] that is used of a joint that turns without end.
        widest = np.pi
        lower = np.where(np.isfinite(limits.lower), limits.lower, self.home - widest)
        upper = np.where(np.isfinite(limits.upper), limits.upper, self.home + widest)
        inset = (1 - USED_LIMIT_SHARE) / 2 * (upper - lower)
        lower, upper = lower + inset, upper - inset
        middle = np.clip(self.home, lower, upper)
        return middle + self.share * (lower - middle), middle + self.share * (upper - middle)

    def _payload(self) -> float:
        """The mass of a payload that the robot carries well [kg], as the diagnosis chooses it."""
        if self.robot.payload:
            return 0.8 * self.robot.payload
        # Payload as a share of the arm's mass, where its rating is not known.
        return max(0.05 * float(np.nansum(self.robot.inertia[:, 0])), 0.1)
