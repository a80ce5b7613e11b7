"""A log made ready for regression: torque, positions on a grid, and which rows count."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from estimation.logs.known_setup import Load, load_of
from estimation.preprocessing import Cycle, LowPass, Resampled, Smoother, find_cycle, resample, rows_at_rest, smooth
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.parallel import threaded
from robots.robot import Robot
from robots.signals import Log, Motion

# Below this share of a joint's RMS speed its friction is not known to have a sign: those rows are left out of its fit.
SIGN_SPEED_SHARE = 0.008
# A joint whose range in a log is below this share of its range elsewhere is at rest there, but for a tremble by some
# steps of its encoder.
TREMBLE_SHARE = 3e-4
# A longer log is smoothed piece by piece, so that its intermediate signals never stand in memory together. Pieces
# overlap by so many periods of the cut-off: the filter has forgotten their ends by then, to a part in 10^7.
SMOOTHED_ROWS = 200_000
OVERLAP_PERIODS = 4.0


@dataclass(frozen=True)
class Rows:
    """Data of a log, or of a part of a long one, for a fit.

    Attributes:
        motion: smoothed, at the log's own times.
        tau: measured torque (N, n), as it was logged, minus that of a known payload.
        mask: (N, n), zero where a row of a joint does not count.
        gravity: (3,) in the base frame [m/s2]; None as the robot's description says.
        rest: rows (N, n) in which the joint stands: friction may hold it with any torque, so that no prediction is
            judged by them; None for none.
    """

    motion: Motion
    tau: Array
    mask: Array
    gravity: Array | None = None
    rest: NDArray[np.bool_] | None = None

    @property
    def judged(self) -> NDArray[np.bool_]:
        """Rows (N, n) by which a prediction is judged."""
        return np.ones(self.tau.shape, dtype=bool) if self.rest is None else ~self.rest


@dataclass(frozen=True)
class Prepared:
    """A log with torque, and its positions on a uniform grid.

    Attributes:
        log: as it was recorded.
        tau: joint torque (N, n) [N m or N].
        positions: on the grid.
        load: the log's known payload; None without.
        still: joints (n,) that stand here, but for a tremble, and move in another log; None for none.
        held: those of them whose rows do not count, for friction holds them with any torque; None for none.
        silent: joints (n,) whose torque never changes though they move: their rows do not count; None for none.
    """

    log: Log
    tau: Array
    positions: Resampled
    load: Load | None = None
    still: NDArray[np.bool_] | None = None
    held: NDArray[np.bool_] | None = None
    silent: NDArray[np.bool_] | None = None

    @cached_property
    def cycle(self) -> Cycle | None:
        """Where the motion repeats itself, in rows of the grid; None where it does not."""
        return find_cycle(self.positions.q, self.positions.period)

    @property
    def period(self) -> float | None:
        """The period with which the motion repeats itself all through the log [s]; None where it does not."""
        return self.cycle.period if self.cycle is not None and self.cycle.whole else None

    @property
    def even(self) -> bool:
        """Whether the samples themselves are a uniform grid."""
        return self.positions.q is self.positions.fresh_q

    def rows(self, by: float | Smoother, *, ends: bool = False) -> Rows:
        """Smooths the log and leaves out its ends, where the smoothing has data on one side only.

        Args:
            by: the smoothing; a number is the cut-off of a low-pass [Hz].
            ends: whether the ends stay, as rows that do not count.
        """
        smoother = _smoother(by)
        return self._seen(smooth(self.positions, smoother), smoother, ends)

    def _seen(self, motion: Motion, smoother: Smoother, ends: bool) -> Rows:
        """The smoothed log as regression data."""
        if not ends:
            (rows,) = self._masked([self._inside(motion, smoother)])
            return rows
        (rows,) = self._masked([(motion, self.tau)])
        return replace(rows, mask=rows.mask * smoother.inside(motion.t)[:, None])

    def pieces(self, by: float | Smoother) -> list[Rows]:
        """Smooths the log as `rows` does, a long one in pieces that follow each other."""
        smoother = _smoother(by)
        count = len(self.log)
        if count <= SMOOTHED_ROWS or not isinstance(smoother, LowPass):
            return [self.rows(smoother)]
        bounds = np.linspace(0, count, -(-count // SMOOTHED_ROWS) + 1).astype(int)
        margin = round(OVERLAP_PERIODS / (smoother.cutoff * self.positions.period))
        edge = smoother.edge(self.log.duration)
        t = self.log.t

        def piece(ends: tuple[int, int]) -> tuple[Motion, Array]:
            first, stop = max(ends[0] - margin, 0), min(ends[1] + margin, count)
            inside = self.cut(slice(first, stop))
            motion = smooth(inside.positions, smoother)
            begin = max(ends[0], int(np.searchsorted(t, t[0] + edge)))
            end = min(ends[1], int(np.searchsorted(t, t[-1] - edge, side="right")))
            return motion.slice(begin - first, end - first), self.tau[begin:end]

        return self._masked(list(threaded(piece, zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True))))

    def cut(self, part: slice) -> Prepared:
        """Takes some rows."""
        positions = resample(self.log.t[part], self.log.q[part])
        return Prepared(
            _window(self.log, part), self.tau[part], positions, self.load, self.still, self.held, self.silent
        )

    def stretches(self, count: int, rows: int) -> Iterator[Prepared]:
        """Gives `count` evenly spread stretches of so many rows each, or the log where that is all of it."""
        if count * rows >= len(self.log):
            yield self
            return
        for start in np.linspace(0, len(self.log) - rows, count).astype(int).tolist():
            yield self.cut(slice(start, start + rows))

    def _inside(self, motion: Motion, smoother: Smoother) -> tuple[Motion, Array]:
        rows = np.flatnonzero(smoother.inside(motion.t))
        begin, end = int(rows[0]), int(rows[-1]) + 1
        return (motion.slice(begin, end) if end - begin < len(motion) else motion), self.tau[begin:end]

    def _masked(self, parts: list[tuple[Motion, Array]]) -> list[Rows]:
        """Leaves out the rows (N, n) in which a joint is almost at rest, by its speed in all parts together.

        The torque of a known payload is taken off, by the smoothed motion.
        """
        total = sum(len(motion) for motion, _ in parts)
        speed = np.sqrt(sum(np.einsum("tj,tj->j", motion.dq, motion.dq) for motion, _ in parts) / total)
        return [self.counted(motion, tau, speed) for motion, tau in parts]

    def counted(self, motion: Motion, tau: Array, speed: Array) -> Rows:
        """Gives smoothed rows (N, n) with those that count, and without the torque of a known payload.

        Args:
            motion: smoothed.
            tau: torque (N, n).
            speed: each joint's RMS speed (n,) in the whole log.
        """
        none = np.zeros(len(speed), dtype=bool)
        still, held, silent = (none if joints is None else joints for joints in (self.still, self.held, self.silent))
        # A joint with less RMS speed than this [rad/s or m/s] stands: what is left is rounding, not to be taken for
        # motion.
        moves = (speed >= 1e-9) & ~still
        if not moves.all():
            motion = Motion(motion.t, motion.q, motion.dq * moves, motion.ddq * moves)
        fast = np.abs(motion.dq) >= SIGN_SPEED_SHARE * speed
        first = int(np.searchsorted(self.log.t, motion.t[0]))
        logged = slice(first, first + len(motion))
        rest = rows_at_rest(self.log.t[logged], self.log.q[logged], speed) & moves | held
        if self.load is not None:
            tau = tau - self.load.torque(motion)
        mask = ((fast | ~moves) & ~held & ~silent).astype(float)
        return Rows(motion, tau, mask, self.log.gravity, rest if rest.any() else None)


def prepare(robot: Robot, log: Log) -> Prepared:
    """Finds the torque of a log and puts its positions on a grid.

    Raises:
        InputError: another number of joints, currents without torque constants, or too few rows.
    """
    file = log.metadata.get("file", log.name or None)
    if log.n != robot.n:
        raise InputError(f"{log.n} joints", file=file, allowed=f"{robot.n}, as {robot.name} has")
    try:
        tau = torque_of(robot, log)
        varies = np.ptp(tau, axis=0) > 0
        silent = ~varies & (np.ptp(log.q, axis=0) > 0) if varies.any() and not varies.all() else None
        return Prepared(log, tau, resample(log.t, log.q), load_of(robot, log), silent=silent)
    except InputError as error:
        raise InputError(
            error.problem, file=file, joint=error.joint, allowed=error.allowed, remedy=error.remedy
        ) from error


def prepare_all(robot: Robot, logs: Sequence[Log]) -> list[Prepared]:
    """Prepares several logs, and marks joints that rest in one log but move in another.

    The rows of those do not count where some log moves all joints. Without, they are all that shows how joints feel
    each other's accelerations, friction or not.
    """
    prepared = [prepare(robot, log) for log in logs]
    still = still_joints([log.positions.q for log in prepared])
    whole = not still.any(axis=1).all()
    return [
        replace(log, still=own, held=own if whole else None) if own.any() else log
        for log, own in zip(prepared, still, strict=True)
    ]


def still_joints(positions: Sequence[Array], travel: Array | float = 0.0) -> NDArray[np.bool_]:
    """Finds which joints stand in each of several logs, but for a tremble, while they move in another (logs, n).

    Args:
        positions: of each log (N, n).
        travel: their ranges (n,) in logs besides.
    """
    ranges = np.array([np.ptp(q, axis=0) for q in positions])
    still: NDArray[np.bool_] = ranges < TREMBLE_SHARE * np.maximum(ranges.max(axis=0), travel)
    return still


def rows_of(logs: Sequence[Prepared], by: float | Smoother, *, ends: bool = False) -> list[Rows]:
    """Smooths logs as `Prepared.rows` does one.

    Stretches of a long log, alike in length and period, are smoothed as columns of one signal: a smoother's set-up
    takes longer than a short stretch.

    Args:
        logs: some.
        by: the smoothing; a number is the cut-off of a low-pass [Hz].
        ends: whether the ends stay, as rows that do not count.
    """
    smoother = _smoother(by)
    first = logs[0]
    alike = all(
        log.even and len(log.tau) == len(first.tau) and np.isclose(log.positions.period, first.positions.period, 1e-9)
        for log in logs
    )
    groups = 1 if alike else len(logs)
    bounds = np.linspace(0, len(logs), groups + 1).astype(int).tolist()

    def group(place: tuple[int, int]) -> list[Rows]:
        some = logs[slice(*place)]
        if len(some) == 1:
            return [some[0].rows(smoother, ends=ends)]
        q = np.hstack([log.positions.q for log in some])
        motion = smooth(replace(some[0].positions, q=q, fresh_q=q), smoother)
        parts = zip(*(np.split(signal, len(some), axis=1) for signal in (motion.q, motion.dq, motion.ddq)), strict=True)
        pairs = zip(some, parts, strict=True)
        return [log._seen(Motion(log.positions.original, *signals), smoother, ends) for log, signals in pairs]

    return [rows for found in (threaded if groups > 1 else map)(group, pairwise(bounds)) for rows in found]


def torque_of(robot: Robot, log: Log) -> Array:
    """Gives the measured torque (N, n), from currents by the robot's torque constants where there is none.

    Raises:
        InputError: neither torque nor current, or a current whose torque constant is not known.
    """
    if log.tau is not None:
        return log.tau
    if log.current is None:
        raise InputError(
            "neither torque nor current",
            allowed="tau1.. [N m] or i1.. [A]",
            remedy="identify logs of commands with oed actuators (estimation.identify_actuators)"
            if log.command is not None
            else "",
        )
    constant = np.asarray(robot.torque_constant)
    if not np.isfinite(constant).all():
        source = log.metadata.get("torque_source")
        instead = source.get("instead") if isinstance(source, dict) else None
        raise InputError(
            "has currents, but the robot's description has no torque constant",
            joint=int(np.argmin(np.isfinite(constant))) + 1,
            remedy="state torque_constant under drives in the robot YAML" + (f", or {instead}" if instead else ""),
        )
    return log.current * constant


def _smoother(by: float | Smoother) -> Smoother:
    return by if isinstance(by, Smoother) else LowPass(by)


def _window(log: Log, part: slice) -> Log:
    # Only what the fit needs: other signals of a long log need not be copied.
    return Log(t=log.t[part], q=log.q[part], name=log.name, gravity=log.gravity)
