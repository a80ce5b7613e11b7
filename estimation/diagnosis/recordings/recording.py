"""What a diagnosis knows of logs: one grid, motion free of noise, torque as measured."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from estimation.diagnosis.recordings.periods import Cycle
from robots.common.stretches import spans

Array = NDArray[np.float64]

# A joint that has not moved on for so long [s] is at rest.
REST_TIME = 0.3

BESIDE = 0.05
"""Time [s] about a row of unknown direction in which accelerations are not known to all of their kicks."""


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
        unsure: rows (N, n) in which the direction of motion is not known: friction may have either sign there.
        clear: those of them (N, n) in which the velocity tells the direction, if kicks at reversals do not show.
        jolts: error of each joint's acceleration (n,) beside its reversals [rad/s2 or m/s2].
        names: of the logs.
        late: how late joints may turn round (N, n) [s] by their velocities' error; None where motion is known exactly.
        rest: what positions (N, n) as logged have besides `q`; None where not all were logged at these rows.
        cutoffs: of each log's joints (logs, n) [Hz], above which positions are taken for noise; None as `rest`.
        finer: the same logs at the rate of their samples, where this one is thinned: each log's first row and every so
            many; None where those are too many.
        payloads: per log a known body at the flange (10,), in its frame; empty where no log has one.
        fields: per log gravity (3,) in the base frame [m/s2], None as the robot is described; empty where all are so.
        trusted: joints (n,) whose clear rows count, and are `unsure` no more; None before that is known.
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
    unsure: NDArray[np.bool_]
    clear: NDArray[np.bool_]
    jolts: Array
    names: tuple[str, ...]
    late: Array | None = None
    rest: Array | None = None
    cutoffs: Array | None = None
    finer: Recording | None = None
    payloads: tuple[Array, ...] = ()
    fields: tuple[Array | None, ...] = ()
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
        return self.fields or (None,) * len(self.starts)

    @property
    def duration(self) -> float:
        """Time recorded, without the pauses between logs [s]."""
        return len(self.t) * self.step

    @property
    def stride(self) -> int:
        """Rows of the finer recording that became one; 1 without any."""
        return 1 if self.finer is None else round(self.step / self.finer.step)

    @property
    def periodic(self) -> bool:
        """Whether every log repeats its motion."""
        return all(cycle is not None for cycle in self.cycles)

    @property
    def counting(self) -> NDArray[np.bool_]:
        """Joints (n,) of which rows at reversals count."""
        return np.zeros(self.n, dtype=bool) if self.trusted is None else self.trusted & self.clear.any(axis=0)

    def calm(self, stride: int = 1) -> NDArray[np.bool_]:
        """Marks every `stride`-th row of each log in which no joint turns round, comes to rest, or has just done so."""
        turns = np.zeros((len(self), 1), dtype=bool)
        for run in self.runs:
            for column in self.unsure[run].T:
                for start, stop in spans(column):
                    at_rest = stop - start > rest_rows(self.step)
                    rows = [start, stop - 1] if at_rest else slice(start, stop)
                    turns[run][rows] = True
        away = self.away(turns)[:, 0]
        return np.concatenate([away[run][::stride] for run in self.runs])

    def late_beside(self, joint: int, stride: int = 1) -> Array:
        """How late a joint may turn round [s] by what is not known of its velocity, every `stride`-th row of each log.

        Zero in rows that are not beside reversals, and where those do not count.
        """
        late = np.zeros(len(self))
        if self.late is not None and self.trusted is not None and self.trusted[joint]:
            late = np.where(self.away(self.clear[:, joint, None])[:, 0], 0.0, self.late[:, joint])
        return np.concatenate([late[run][::stride] for run in self.runs])

    def away(self, rows: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Marks rows of each log farther than `BESIDE` from marked ones, both (N, k)."""
        reach = 2 * round(BESIDE / self.step) + 1
        return np.concatenate([maximum_filter1d(rows[run].astype(np.int8), reach, axis=0) == 0 for run in self.runs])

    def trusting(self, joints: NDArray[np.bool_] | None) -> Recording:
        """Lets the clear rows of some joints (n,) count too."""
        if joints is None:
            return self
        return replace(self, unsure=self.unsure & ~(self.clear & joints), trusted=joints)


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
        unsure=whole.unsure[rows],
        clear=whole.clear[rows],
        late=None if whole.late is None else whole.late[rows],
        rest=None,
        cutoffs=None,
        finer=None if whole.finer is None else cut_recording(whole.finer, _at_all_samples(whole, rows)),
        cycles=(None,) * len(begins),
        names=whole.names[logs],
        payloads=whole.payloads[logs],
        fields=whole.fields[logs],
    )


def _at_all_samples(thinned: Recording, rows: slice) -> slice:
    """Gives the rows of the finer recording from the first to the last of some."""
    assert thinned.finer is not None
    starts, ends = np.array(thinned.starts), np.array([rows.start, rows.stop - 1])
    own = np.searchsorted(starts, ends, side="right") - 1
    first, last = np.array(thinned.finer.starts)[own] + thinned.stride * (ends - starts[own])
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
        unsure=both("unsure").astype(bool),
        clear=both("clear").astype(bool),
        late=None if first.late is None or second.late is None else both("late"),
        rest=None,
        cutoffs=None,
        finer=None if first.finer is None or second.finer is None else join_recordings(first.finer, second.finer),
        starts=starts,
        cycles=(*first.cycles, *second.cycles),
        names=(*first.names, *second.names),
        payloads=(*first.bodies, *second.bodies) if first.payloads or second.payloads else (),
        fields=(*first.gravities, *second.gravities) if first.fields or second.fields else (),
    )


def rest_rows(step: float) -> int:
    """Number of rows of `step` [s] beyond which a joint whose direction is not known is at rest."""
    return max(8, round(REST_TIME / step))
