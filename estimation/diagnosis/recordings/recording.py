"""What a diagnosis knows of logs: one grid, motion free of noise, torque as measured."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from estimation.diagnosis.calibration import REST_TIME, REVERSAL_MARGIN
from estimation.diagnosis.recordings.periods import Cycle
from robots.common.stretches import spans

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Recording:
    """All logs, one after the other.

    Attributes:
        t: time [s], (N,), one clock.
        starts: row at which each log begins.
        q: positions (N, n), free of noise [rad or m].
        dq: velocities (N, n).
        ddq: accelerations (N, n).
        tau: torque as measured (N, n) [N m or N].
        step: sample period [s].
        cycles: per log the repeated part, in rows of the log; None where nothing repeats.
        cutoff: lowest frequency [Hz] above which positions are taken for noise.
        floor: power density of each joint's position noise (n,) [rad^2/Hz].
        sign_unknown: rows (N, n) in which the direction of motion is not known: friction may have either sign there.
        sign_known_from_velocity: those of them (N, n) in which the velocity tells the direction, if kicks at reversals
            do not show.
        reversal_acceleration_error: error of each joint's acceleration (n,) beside its reversals [rad/s2 or m/s2].
        names: of the logs.
        reversal_time_error: how late joints may turn round (N, n) [s] by their velocities' error; None where motion is
            known exactly.
        position_residual: what positions (N, n) as logged have besides `q`; None where not all were logged at these
            rows.
        cutoffs: of each log's joints (logs, n) [Hz], above which positions are taken for noise; None as
            `position_residual`.
        full_rate: the same logs at the rate of their samples, where this one is thinned: each log's first row and every
            so many; None where those are too many.
        payloads: per log a known body at the flange (10,), in its frame; empty where no log has one.
        gravity_fields: per log gravity (3,) in the base frame [m/s2], None as the robot is described; empty where all
            are so.
        trusted: joints (n,) whose clear rows count, and are `sign_unknown` no more; None before that is known.
    """

    t: Array
    starts: tuple[int, ...]
    q: Array
    dq: Array
    ddq: Array
    tau: Array
    step: float
    cycles: tuple[Cycle | None, ...]
    cutoff: float
    floor: Array
    sign_unknown: NDArray[np.bool_]
    sign_known_from_velocity: NDArray[np.bool_]
    reversal_acceleration_error: Array
    names: tuple[str, ...]
    reversal_time_error: Array | None = None
    position_residual: Array | None = None
    cutoffs: Array | None = None
    full_rate: Recording | None = None
    payloads: tuple[Array, ...] = ()
    gravity_fields: tuple[Array | None, ...] = ()
    trusted: NDArray[np.bool_] | None = None

    def __len__(self) -> int:
        return len(self.t)

    @property
    def n(self) -> int:
        """Number of joints."""
        return int(self.q.shape[1])

    @property
    def runs(self) -> tuple[slice, ...]:
        """Each log's rows."""
        return tuple(slice(a, b) for a, b in pairwise((*self.starts, len(self.t))))

    @property
    def bodies(self) -> tuple[Array, ...]:
        """Each log's known payload (10,), zeros for none."""
        return self.payloads or (np.zeros(10),) * len(self.starts)

    @property
    def gravities(self) -> tuple[Array | None, ...]:
        """Each log's gravity (3,) in the base frame [m/s2], None as the robot is described."""
        return self.gravity_fields or (None,) * len(self.starts)

    @property
    def duration(self) -> float:
        """Time recorded, without the pauses between logs [s]."""
        return len(self.t) * self.step

    @property
    def stride(self) -> int:
        """Rows of the finer recording that became one; 1 without any."""
        return 1 if self.full_rate is None else round(self.step / self.full_rate.step)

    @property
    def periodic(self) -> bool:
        """Whether every log repeats its motion."""
        return all(cycle is not None for cycle in self.cycles)

    @property
    def counted_rows(self) -> NDArray[np.bool_]:
        """Joints (n,) of which rows at reversals count."""
        return (
            np.zeros(self.n, dtype=bool)
            if self.trusted is None
            else self.trusted & self.sign_known_from_velocity.any(axis=0)
        )

    def far_from_reversals(self, stride: int = 1) -> NDArray[np.bool_]:
        """Marks every `stride`-th row of each log in which no joint turns round, comes to rest, or has just done so."""
        turns = np.zeros((len(self), 1), dtype=bool)
        for run in self.runs:
            for column in self.sign_unknown[run].T:
                for start, stop in spans(column):
                    at_rest = stop - start > rest_rows(self.step)
                    rows = [start, stop - 1] if at_rest else slice(start, stop)
                    turns[run][rows] = True
        away = self.distant_from(turns)[:, 0]
        return np.concatenate([away[run][::stride] for run in self.runs])

    def reversal_time_error_near(self, joint: int, stride: int = 1) -> Array:
        """How late a joint may turn round [s] by what is not known of its velocity, every `stride`-th row of each log.

        Zero in rows that are not beside reversals, and where those do not count.
        """
        late = np.zeros(len(self))
        if self.reversal_time_error is not None and self.trusted is not None and self.trusted[joint]:
            late = np.where(
                self.distant_from(self.sign_known_from_velocity[:, joint, None])[:, 0],
                0.0,
                self.reversal_time_error[:, joint],
            )
        return np.concatenate([late[run][::stride] for run in self.runs])

    def distant_from(self, rows: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Marks rows of each log farther than `REVERSAL_MARGIN` from marked ones, both (N, k)."""
        reach = 2 * round(REVERSAL_MARGIN / self.step) + 1
        return np.concatenate([maximum_filter1d(rows[run].astype(np.int8), reach, axis=0) == 0 for run in self.runs])

    def with_trusted(self, joints: NDArray[np.bool_] | None) -> Recording:
        """Lets the clear rows of some joints (n,) count too."""
        if joints is None:
            return self
        return replace(self, sign_unknown=self.sign_unknown & ~(self.sign_known_from_velocity & joints), trusted=joints)


def cut_recording(whole: Recording, rows: slice) -> Recording:
    """Takes rows of a recording, and the logs that begin in them."""
    begins = (0, *(start - rows.start for start in whole.starts if rows.start < start < rows.stop))
    first = sum(start <= rows.start for start in whole.starts) - 1
    logs = slice(first, first + len(begins))
    return replace(
        whole,
        t=whole.t[rows],
        starts=begins,
        q=whole.q[rows],
        dq=whole.dq[rows],
        ddq=whole.ddq[rows],
        tau=whole.tau[rows],
        sign_unknown=whole.sign_unknown[rows],
        sign_known_from_velocity=whole.sign_known_from_velocity[rows],
        reversal_time_error=None if whole.reversal_time_error is None else whole.reversal_time_error[rows],
        position_residual=None,
        cutoffs=None,
        full_rate=None if whole.full_rate is None else cut_recording(whole.full_rate, _at_all_samples(whole, rows)),
        cycles=(None,) * len(begins),
        names=whole.names[logs],
        payloads=whole.payloads[logs],
        gravity_fields=whole.gravity_fields[logs],
    )


def _at_all_samples(thinned: Recording, rows: slice) -> slice:
    """Gives the rows of the finer recording from the first to the last of some."""
    assert thinned.full_rate is not None
    starts, ends = np.array(thinned.starts), np.array([rows.start, rows.stop - 1])
    own = np.searchsorted(starts, ends, side="right") - 1
    first, last = np.array(thinned.full_rate.starts)[own] + thinned.stride * (ends - starts[own])
    return slice(int(first), int(last) + 1)


def join_recordings(first: Recording, second: Recording) -> Recording:
    """Joins two recordings of one sample period on one clock, the first before the second."""
    starts = (*first.starts, *(len(first) + start for start in second.starts))

    def both(name: str) -> Array:
        return np.concatenate([getattr(first, name), getattr(second, name)])

    return replace(
        first,
        t=both("t"),
        q=both("q"),
        dq=both("dq"),
        ddq=both("ddq"),
        tau=both("tau"),
        sign_unknown=both("sign_unknown").astype(bool),
        sign_known_from_velocity=both("sign_known_from_velocity").astype(bool),
        reversal_time_error=None
        if first.reversal_time_error is None or second.reversal_time_error is None
        else both("reversal_time_error"),
        position_residual=None,
        cutoffs=None,
        full_rate=None
        if first.full_rate is None or second.full_rate is None
        else join_recordings(first.full_rate, second.full_rate),
        starts=starts,
        cycles=(*first.cycles, *second.cycles),
        names=(*first.names, *second.names),
        payloads=(*first.bodies, *second.bodies) if first.payloads or second.payloads else (),
        gravity_fields=(*first.gravities, *second.gravities) if first.gravity_fields or second.gravity_fields else (),
    )


def rest_rows(step: float) -> int:
    """Number of rows of `step` [s] beyond which a joint whose direction is not known is at rest."""
    return max(8, round(REST_TIME / step))
