"""One kind of finding on a log, explained."""

from __future__ import annotations

from dataclasses import dataclass

from robots.common.records import Record


@dataclass(frozen=True, kw_only=True)
class Explanation(Record):
    """One kind of finding.

    Attributes:
        number: of its code; it never changes, and none is used twice.
        name: as `Finding.name` has it.
        meaning: what it says of the log.
        example: a log that causes it.
        remedy: what to do.
    """

    ENTRIES = ("code", "name", "meaning", "example", "remedy")

    number: int
    name: str
    meaning: str
    example: str
    remedy: str

    @property
    def code(self) -> str:
        """Its code, such as OED-L014."""
        return f"OED-L{self.number:03d}"

    def text(self) -> str:
        """Writes the explanation as a paragraph for each part."""
        parts = (f"{self.code} {self.name}", self.meaning, f"A log that causes it: {self.example}", self.remedy)
        return "\n".join(parts)
