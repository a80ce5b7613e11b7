"""A large log piece by piece: smoothed rows, ready for sums, one piece in memory at a time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from estimation.identifications.streams.survey import Segment, Survey
from estimation.logs.parquet_streams import LogStream
from estimation.preprocessing import LowPass, smooth
from estimation.regressions.preparation import OVERLAP_PERIODS, SMOOTHED_ROWS, TREMBLE_SHARE, Prepared, Rows, prepare
from estimation.regressions.torque_meanings import as_joint_torque
from robots.common.arrays import Array
from robots.robot import Robot
from robots.signals import Motion


class Pieces:
    """The usable rows of a large log.

    Attributes:
        robot: the robot.
        stream: the log.
        survey: of the first reading.
    """

    def __init__(self, robot: Robot, stream: LogStream, survey: Survey) -> None:
        self.robot, self.stream, self.survey = robot, stream, survey
        ranges = np.array([segment.upper - segment.lower for segment in survey.segments])
        self._still = ranges < TREMBLE_SHARE * ranges.max(axis=0)
        self._whole = not self._still.any(axis=1).all()

    def stretches(self, count: int, rows: int) -> list[Prepared]:
        """Reads evenly spread stretches of so many rows each; all segments where that is all of the log."""
        segments = self.survey.segments
        ends = np.cumsum([segment.stop - segment.first for segment in segments])
        if count * rows >= ends[-1]:
            return [self._prepared(k, part.first, part.stop) for k, part in enumerate(segments)]
        found = []
        for place in np.linspace(0, ends[-1] - rows, count).astype(int).tolist():
            k = int(np.searchsorted(ends, place, side="right"))
            part = segments[k]
            # A stretch stays inside its segment.
            first = max(part.first, min(part.stop - (int(ends[k]) - place), part.stop - rows))
            found.append(self._prepared(k, first, min(first + rows, part.stop)))
        return found

    def moved(self, smoother: LowPass) -> Iterator[tuple[int, Prepared, Motion, Array]]:
        """Gives each piece's segment, the prepared piece, its smoothed motion and its torque, ends left out."""
        for k, segment in enumerate(self.survey.segments):
            for first, stop in self._bounds(segment):
                found = self._piece(k, segment, first, stop, smoother)
                if found is not None:
                    yield (k, *found)

    def rows(self, smoother: LowPass, speeds: Array) -> Iterator[Rows]:
        """Gives the pieces as regression data.

        Args:
            smoother: of the positions.
            speeds: each joint's RMS speed in each segment (segments, n).
        """
        for k, ready, motion, tau in self.moved(smoother):
            yield ready.counted(motion, tau, speeds[k])

    def speeds(self, smoother: LowPass) -> Iterator[tuple[int, Array, int]]:
        """Gives each piece's segment, its sums of squared speeds (n,), and its rows."""
        for k, _, motion, _ in self.moved(smoother):
            yield k, np.einsum("tj,tj->j", motion.dq, motion.dq), len(motion)

    def _bounds(self, segment: Segment) -> Iterator[tuple[int, int]]:
        count = segment.stop - segment.first
        yield from pairwise(np.linspace(0, count, -(-count // SMOOTHED_ROWS) + 1).astype(int).tolist())

    def _piece(
        self, k: int, segment: Segment, first: int, stop: int, smoother: LowPass
    ) -> tuple[Prepared, Motion, Array] | None:
        margin = round(OVERLAP_PERIODS / (smoother.cutoff * segment.period))
        edge = smoother.edge(segment.end - segment.start)
        count = segment.stop - segment.first
        ready = self._prepared(k, segment.first + max(first - margin, 0), segment.first + min(stop + margin, count))
        t = ready.log.t
        if len(t) < 20:
            return None
        # Rows that were left out have shifted the others.
        read = segment.first + max(first - margin, 0)
        begin, end = (self._kept(read, segment.first + place) for place in (first, stop))
        begin = max(begin, int(np.searchsorted(t, segment.start + edge)))
        end = min(end, int(np.searchsorted(t, segment.end - edge, side="right")))
        if begin >= end:
            return None
        motion = smooth(ready.positions, smoother)
        return ready, motion.slice(begin, end), ready.tau[begin:end]

    def _kept(self, first: int, stop: int) -> int:
        """Number of rows in a range that are not left out."""
        low, high = np.searchsorted(self.survey.dropped, [first, stop])
        return stop - first - int(high - low)

    def _prepared(self, k: int, first: int, stop: int) -> Prepared:
        log = as_joint_torque(self.robot, self.stream.rows(first, stop), self.stream.torque_is, estimate=False)
        low, high = np.searchsorted(self.survey.dropped, [first, stop])
        if low < high:
            kept = np.ones(len(log), dtype=bool)
            kept[self.survey.dropped[low:high] - first] = False
            log = log.rows(np.flatnonzero(kept))
        still = self._still[k]
        ready = prepare(self.robot, log)
        return replace(ready, still=still, held=still if self._whole else None) if still.any() else ready
