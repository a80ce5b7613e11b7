"""What a stream did."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from oed.controllers.recording.clock import ClockAnchor
from oed.controllers.recording.recording import loss
from robots.common.records import Record


@dataclass(frozen=True, kw_only=True)
class StreamResult(Record):
    """How a trajectory was played.

    Attributes:
        robot: its name.
        place: the controller.
        points: of the trajectory.
        sent: points that the controller confirmed, or that were downloaded.
        resent: how often a point was sent again.
        unexpected: replies that were late, came twice, or were no messages.
        duration: of the stream, until the robot stood [s].
        delay: see `Traffic.delay` [s].
        stopped: whether the stop at the end was confirmed.
        log: the file; empty for a dry run.
        rows: of the log.
        feedback: rate, loss and jitter.
        status: what the controller reports; empty where it reports nothing.
        dry_run: whether no point was sent.
        note: what went wrong without harm.
        anchor: end of the log, for one that continues its clock.
    """

    robot: str
    place: str
    points: int
    sent: int
    resent: int
    unexpected: int
    duration: float
    delay: float | None
    stopped: bool
    log: str
    rows: int
    feedback: dict[str, Any]
    status: dict[str, int]
    dry_run: bool
    note: str = ""
    anchor: ClockAnchor | None = None

    def summary(self) -> str:
        """Says in a few lines what happened."""
        if self.dry_run:
            sent = "nothing was sent" if self.delay is None else "only pings were sent"
            return f"{self.points} points of {self.robot} may be played at {self.place}; {sent} (dry run)"
        rate = self.sent / self.duration if self.duration else 0.0
        lines = [
            f"{self.sent} of {self.points} points played at {self.place} in {self.duration:.1f} s "
            f"({rate:.0f} points/s)",
            f"{self.rows} rows of feedback in {self.log}, {loss(self.feedback)}",
        ]
        if self.resent or self.unexpected:
            lines.append(f"{self.resent} points sent again, {self.unexpected} late or repeated replies")
        if self.delay is not None:
            lines.append(f"delay of a message {1e3 * self.delay:.2g} ms")
        if not self.stopped:
            lines.append("the controller did not confirm the stop message after the motion")
        return "\n".join([*lines, *([self.note] if self.note else [])])
