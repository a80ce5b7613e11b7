"""One stored log of a monitor: when it was, what was found in it, or why it was left out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robots.common.records import Record

UNFIT = "does not fit the model: a log of another robot, or a robot after major service"


@dataclass(frozen=True, kw_only=True)
class LogRow(Record):
    """One log.

    Attributes:
        name: of the log.
        start: on the monitor's clock [s]; NaN of a log that was left out.
        end: likewise.
        used: whether it counts.
        findings: kinds that were detected in it.
        note: why it was left out.
        digest: of its rows, by which it is known again; empty for a log on which nothing was decided.
    """

    name: str
    start: float = np.nan
    end: float = np.nan
    used: bool = True
    findings: tuple[str, ...] = ()
    note: str = ""
    digest: str = ""

    @classmethod
    def left_out(cls, name: str, note: str, digest: str = "") -> LogRow:
        """A log that does not count."""
        return cls(name=name, used=False, note=note, digest=digest)

    @property
    def undecided(self) -> bool:
        """Whether it does not fit the model, and no later log shows why."""
        return not self.used and not self.digest and self.note == UNFIT
