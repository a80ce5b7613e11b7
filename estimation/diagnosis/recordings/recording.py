"""The recording: all logs on one grid, with low-passed motion and measured torque."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from estimation.diagnosis.calibration import REST_TIME, REVERSAL_MARGIN
from estimation.preprocessing import Cycle
from robots.common.arrays import Array
from robots.common.stretches import spans

PER_ROW = (
    "t",
    "q",
    "dq",
    "ddq",
    "tau",
    "sign_unknown",
    "sign_known_from_velocity",
    "reversal_time_error",
    "position_residual",
)
"""Fields of a recording with one value per row; the last two may be missing."""


@dataclass(frozen=True, eq=False)
class Recording:
    """All logs, one after the other.

    Attributes:
        t: time (N,) [s], on one clock.
        starts: first row of each log.
        q: positions (N, n), noise removed [rad or m].
        dq: velocities (N, n) [rad/s or m/s].
        ddq: accelerations (N, n) [rad/s2 or m/s2].
        tau: measured torque (N, n) [N m or N].
        step: sample period [s].
        cycles: periodic part of each log, in rows of that log; None if its motion does not repeat.
        cutoff: lowest frequency [Hz] above which positions count as noise.
        floor: power density of each joint's position noise (n,) [rad^2/Hz or m^2/Hz].
        sign_unknown: rows (N, n) in which the direction of motion, and so the sign of friction, is unknown.
        sign_known_from_velocity: those of them (N, n) in which the velocity determines the sign, provided that
            acceleration jumps at reversals are small against the noise.
        reversal_acceleration_error: error of each joint's acceleration (n,) near its reversals [rad/s2 or m/s2].
        names: names of the logs.
        reversal_time_error: error of the reversal times (N, n) [s] by the error of the velocities; None if the motion
            is known exactly.
        position_residual: logged positions minus `q` (N, n) [rad or m]; None unless all were logged at these rows.
        cutoffs: cut-off of each joint's position in each log (logs, n) [Hz]; None as for `position_residual`.
        full_rate: the same logs at their own sampling rate, if this recording is decimated from them; None if it is
            not, or if there are too many rows.
        payloads: inertial parameters of the known payload of each log (10,), in the flange frame; empty if no log has
            one.
        gravity_fields: gravity of each log (3,) in the base frame [m/s2], or None for the robot's description; empty if
            this holds for all logs.
        trusted: joints (n,) whose rows in `sign_known_from_velocity` count and were taken out of `sign_unknown`; None
            before this is decided.
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
        """Rows of each log."""
        return tuple(slice(a, b) for a, b in pairwise((*self.starts, len(self.t))))

    @property
    def bodies(self) -> tuple[Array, ...]:
        """Known payload of each log (10,); zeros if there is none."""
        return self.payloads or (np.zeros(10),) * len(self.starts)

    @property
    def gravities(self) -> tuple[Array | None, ...]:
        """Gravity of each log (3,) in the base frame [m/s2]; None for the robot's description."""
        return self.gravity_fields or (None,) * len(self.starts)

    @property
    def duration(self) -> float:
        """Recorded time, without the pauses between logs [s]."""
        return len(self.t) * self.step

    @property
    def stride(self) -> int:
        """Decimation: rows of `full_rate` per row; 1 without `full_rate`."""
        return 1 if self.full_rate is None else round(self.step / self.full_rate.step)

    @property
    def periodic(self) -> bool:
        """Whether every log repeats its motion."""
        return all(cycle is not None for cycle in self.cycles)

    @property
    def counted_rows(self) -> NDArray[np.bool_]:
        """Joints (n,) whose rows near reversals count."""
        return (
            np.zeros(self.n, dtype=bool)
            if self.trusted is None
            else self.trusted & self.sign_known_from_velocity.any(axis=0)
        )

    def far_from_reversals(self, stride: int = 1) -> NDArray[np.bool_]:
        """Marks every `stride`-th row of each log in which no joint reverses, comes to rest or leaves rest nearby."""
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
        """Returns the error of a joint's reversal time [s] in every `stride`-th row of each log.

        The error is zero in rows that are not near reversals, and if rows near reversals do not count.

        Args:
            joint: the joint, counted from 0.
            stride: rows per row returned.
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
        """Marks the rows of each log that are farther than `REVERSAL_MARGIN` from marked ones, both (N, k)."""
        reach = 2 * round(REVERSAL_MARGIN / self.step) + 1
        return np.concatenate([maximum_filter1d(rows[run].astype(np.int8), reach, axis=0) == 0 for run in self.runs])

    def with_trusted(self, joints: NDArray[np.bool_] | None) -> Recording:
        """Lets rows near reversals count for some joints (n,), where the velocity determines the sign."""
        if joints is None:
            return self
        return replace(self, sign_unknown=self.sign_unknown & ~(self.sign_known_from_velocity & joints), trusted=joints)


def cut_recording(whole: Recording, rows: slice) -> Recording:
    """Selects rows of a recording, and the logs to which they belong."""
    begins = (0, *(start - rows.start for start in whole.starts if rows.start < start < rows.stop))
    first = sum(start <= rows.start for start in whole.starts) - 1
    logs = slice(first, first + len(begins))
    own: dict[str, Any] = {name: None if (of := getattr(whole, name)) is None else of[rows] for name in PER_ROW}
    return replace(
        whole,
        **own,
        starts=begins,
        cutoffs=None if whole.cutoffs is None else whole.cutoffs[logs],
        full_rate=None if whole.full_rate is None else cut_recording(whole.full_rate, _at_all_samples(whole, rows)),
        cycles=(None,) * len(begins),
        names=whole.names[logs],
        payloads=whole.payloads[logs],
        gravity_fields=whole.gravity_fields[logs],
    )


def _at_all_samples(thinned: Recording, rows: slice) -> slice:
    """Returns the rows of `full_rate` from the first to the last of some decimated rows."""
    assert thinned.full_rate is not None
    starts, ends = np.array(thinned.starts), np.array([rows.start, rows.stop - 1])
    own = np.searchsorted(starts, ends, side="right") - 1
    first, last = np.array(thinned.full_rate.starts)[own] + thinned.stride * (ends - starts[own])
    return slice(int(first), int(last) + 1)


def join_recordings(parts: Sequence[Recording]) -> Recording:
    """Joins recordings of the same sample period and clock, in the order of time."""

    def joined(name: str) -> Any:
        values = [getattr(part, name) for part in parts]
        return None if any(value is None for value in values) else np.concatenate(values)

    before = np.cumsum([0, *(len(part) for part in parts)])
    finer = [part.full_rate for part in parts if part.full_rate is not None]
    return replace(
        parts[0],
        **{name: joined(name) for name in (*PER_ROW, "cutoffs")},
        starts=tuple(int(rows + start) for rows, part in zip(before, parts, strict=False) for start in part.starts),
        cutoff=min(part.cutoff for part in parts),
        floor=np.max([part.floor for part in parts], axis=0),
        reversal_acceleration_error=np.max([part.reversal_acceleration_error for part in parts], axis=0),
        full_rate=join_recordings(finer) if len(finer) == len(parts) else None,
        cycles=tuple(cycle for part in parts for cycle in part.cycles),
        names=tuple(name for part in parts for name in part.names),
        payloads=tuple(b for part in parts for b in part.bodies) if any(part.payloads for part in parts) else (),
        gravity_fields=tuple(g for part in parts for g in part.gravities)
        if any(part.gravity_fields for part in parts)
        else (),
    )


def rest_rows(step: float) -> int:
    """Returns the number of rows of `step` [s] beyond which a joint with an unknown direction is at rest."""
    return max(8, round(REST_TIME / step))
