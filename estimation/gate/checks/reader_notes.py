"""Changes that the reader of the file made."""

from __future__ import annotations

from typing import ClassVar

from estimation.gate.check import Check
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding


class ReaderNotes(Check):
    """Reports what was changed when the file was read."""

    name: ClassVar[str] = "reader_notes"
    stage: ClassVar[Stage] = Stage.RECORDED
    order: ClassVar[int] = 80

    def run(self, context: Context) -> list[Finding]:
        """Lists the changes that the log's metadata name."""
        return [
            Finding(
                name=str(note["name"]),
                severity=note.get("severity", "info"),
                text=str(note["text"]),
                action=str(note["action"]),
                value=float(note["value"]),
                unit=str(note.get("unit", "rows")),
            )
            for note in context.recorded.log.metadata.get("repairs", ())
        ]
