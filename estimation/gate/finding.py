"""One finding on a log."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from estimation.gate.explanations import CODES
from robots.common.records import Finding as Remark
from robots.common.records import Record

Severity = Literal["info", "warning", "refuse"]
SEVERITIES: tuple[Severity, ...] = get_args(Severity)


@dataclass(frozen=True, kw_only=True)
class Finding(Record):
    """One finding of a check.

    Attributes:
        name: kind of finding, such as ``gap`` or ``unit_of_position``.
        severity: ``info`` (no effect), ``warning`` (the result is less accurate), ``refuse`` (the fit would be wrong).
        text: what was found, in one clause.
        action: what was done about it, or what to do.
        value: the number on which it is based.
        unit: of the value.
        column: of the log, if the finding is about one.
        joint: counted from 1, if the finding is about one.
        row: at which it begins, counted from 1, if it has a place.
    """

    name: str
    severity: Severity
    text: str
    action: str
    value: float
    unit: str = ""
    column: str | None = None
    joint: int | None = None
    row: int | None = None

    @property
    def code(self) -> str | None:
        """Code under which `oed explain` explains it; None of a finding that has none."""
        return CODES.get(self.name)

    def remark(self, subject: str = "") -> Remark:
        """Gives the finding as reports show it.

        Args:
            subject: log that it is about, where there are several.
        """
        return Remark(code=f"log.{self.severity}", subject=subject, text=f"{self}.")

    def __str__(self) -> str:
        named = (("joint", self.joint), ("column", self.column), ("row", self.row))
        place = ", ".join(f"{word} {value}" for word, value in named if value is not None)
        return f"{place}: {self.text}; {self.action}" if place else f"{self.text}; {self.action}"
