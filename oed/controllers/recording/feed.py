"""Which messages make rows of a log, at which time, and why others do not."""

from __future__ import annotations

import math

import numpy as np

from oed.controllers.errors import ControllerError
from oed.controllers.recording.feedback import RANKS, Layout, MessageForm, layout_of, missing_in, stamp_of
from oed.exports.simple_message import Message

BACKWARD_TIME = 0.5
"""If only messages older than the newest come for so long [s], the clock restarted. Late ones come between others."""


class Feed:
    """Takes the messages of a controller in the order of their arrival.

    Args:
        n: number of joints.
        form: of the messages.
    """

    def __init__(self, n: int, form: MessageForm) -> None:
        self._n, self._form = n, form
        self._last = -math.inf
        self._behind_since = math.inf
        self.layout: Layout | None = None
        """What is recorded; None before the first usable message."""
        self.late = 0
        """Messages that came late, or twice."""
        self.problem = ""
        """Why the last messages make no row."""

    def forget(self) -> None:
        """Begins to count; the next message is the first."""
        self.late, self._last, self._behind_since = 0, -math.inf, math.inf

    def time_of(self, message: Message, now: float, choosing: bool) -> float | None:
        """Gives the time of a message's row [s], or None if it makes none; `problem` then says why.

        Args:
            message: of any kind.
            now: our clock [s]; the row's time where messages carry none.
            choosing: whether another kind of message, which says more, may replace that of the layout.

        Raises:
            ControllerError: the controller's clock restarted.
        """
        if type(message) not in RANKS:
            return None
        if self.layout is None or (choosing and RANKS[type(message)] > RANKS[self.layout.kind]):
            found = layout_of(message, self._n, self._form)
            self.layout = self.layout if found is None else found
        if self.layout is not None and type(message) is not self.layout.kind:
            self.problem = self.problem or "another kind of message arrives than before"
            return None
        missing = missing_in(message, self.layout)
        if missing:
            self.problem = f"its messages do not state a valid {missing}"
            return None
        assert self.layout is not None
        stamp = stamp_of(message, self.layout, self._form)
        if stamp is None:
            return now
        if stamp > self._last:
            self._last, self._behind_since = stamp, math.inf
            return stamp
        self.late += 1
        if stamp < self._last:
            self._behind_since = min(self._behind_since, now)
            if now - self._behind_since > BACKWARD_TIME:
                raise ControllerError(f"the controller's clock went back by {self._last - stamp:.1f} s: it restarted")
        self.problem = f"its clock stands at {np.format_float_positional(self._last, trim='-')} s"
        return None
