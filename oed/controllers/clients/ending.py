"""When a motion is over: the robot stands at the last point, and has been on its way."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from oed.controllers.errors import ControllerError
from oed.controllers.recording.recorder import Recorder
from robots.common.arrays import Array
from robots.signals import Motion

STANDING_TIME = 0.3
"""How long the robot must stand at the end [s]."""

STANDING_TIME_WITHOUT_STATUS = 1.0
"""How long it must stand where the controller reports no state of motion [s]: points may be left in its buffer."""


class Ending:
    """Watches for the end of a motion.

    Args:
        motion: the trajectory.
        recorder: its feedback.
        tolerance: distance from the last point [rad or m].
        patience: longest standstill before the end [s].
    """

    def __init__(self, motion: Motion, recorder: Recorder, tolerance: float, patience: float) -> None:
        self._recorder, self._tolerance, self._patience = recorder, tolerance, patience
        self._final = motion.q[-1]
        self._first = motion.q[0]
        self._travels = bool(np.abs(motion.q - motion.q[0]).max() > 2 * tolerance)
        self._longest_rest = patience + _longest_rest(motion)

    def wait(self, turn: Callable[[], None]) -> None:
        """Returns when the robot has stopped at the last point.

        Args:
            turn: is called all the time; it raises where the motion ends for another reason.

        Raises:
            ControllerError: the robot stopped elsewhere, or never began to move.
        """
        begin = time.monotonic()
        while True:
            turn()
            now = time.monotonic()
            rest = now - max(self._recorder.rest_since, begin)
            status = self._recorder.status
            reports = status is not None and status.in_motion >= 0
            there = self._away(self._final) <= self._tolerance
            begun = self._moved or not self._travels
            stands = rest > (STANDING_TIME if reports else STANDING_TIME_WITHOUT_STATUS)
            if there and begun and stands and not (status is not None and status.in_motion == 1):
                return
            if rest > self._longest_rest:
                joint = int(np.abs(self._positions() - self._final).argmax())
                raise ControllerError(
                    f"the robot has stood for {rest:.1f} s at {self._positions()[joint]:.5g}, the trajectory ends at "
                    f"{self._final[joint]:.5g}"
                    if self._moved
                    else f"the robot has not begun to move for {rest:.1f} s",
                    joint=joint + 1 if self._moved else None,
                    remedy="check drives, mode and the running program at the controller",
                )
            time.sleep(0.02)

    @property
    def _moved(self) -> bool:
        """Whether any feedback so far was away from the first point."""
        n, recorder = len(self._first), self._recorder
        extremes = [pose[:n] for pose in (recorder.lowest, recorder.highest) if pose is not None]
        return any(float(np.abs(pose - self._first).max()) > self._tolerance for pose in extremes)

    def _positions(self) -> Array:
        assert self._recorder.positions is not None
        return self._recorder.positions[: len(self._final)]

    def _away(self, pose: Array) -> float:
        return float(np.abs(self._positions() - pose).max())


def _longest_rest(motion: Motion) -> float:
    """Finds the longest time for which a trajectory stands still [s]."""
    moves = np.flatnonzero(np.abs(np.diff(motion.q, axis=0)).max(axis=1) > 1e-6)
    if not moves.size:
        return motion.duration
    times = motion.t[[0, *moves + 1, -1]]
    return float(np.diff(times).max())
