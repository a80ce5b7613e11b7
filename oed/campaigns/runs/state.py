"""Which stages of a campaign are recorded: a file that is replaced as a whole after each stage."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from oed.controllers.recording.clock import ClockAnchor
from robots.common.errors import InputError
from robots.common.files import remove_partial_files
from robots.common.locks import close_locked, lock
from robots.common.records import Record, read_json, write_json

RUN, LOCK = "run.json", ".run.lock"
LOGS = "logs"


@dataclass(frozen=True, kw_only=True)
class RecordedStage:
    """A stage that was played to its end.

    Attributes:
        number: of the stage in the order of the timetable, from 1.
        stage: its name.
        cycle: of the campaign, from 1.
        file: its log, in the folder of the campaign.
        recording: where the log was written before the stage had ended.
        rows: of the log.
        lost: feedback messages that did not arrive; None where the feedback carries no time.
        delay: of a message to the controller [s]; None without pings.
        end: the end of the log, for the clock of the next one.
    """

    number: int
    stage: str
    cycle: int
    file: str
    recording: str
    rows: int
    lost: int | None
    delay: float | None
    end: ClockAnchor


@dataclass(kw_only=True)
class RunState(Record, format="robot-oed campaign run"):
    """What was done of a campaign.

    Attributes:
        campaign: SHA-256 of its campaign.json.
        recorded: stages in the order in which they were played.
        starts: how often the run was started.
    """

    campaign: str
    recorded: list[RecordedStage] = field(default_factory=list)
    starts: int = 0

    @property
    def last(self) -> RecordedStage | None:
        """The stage that was recorded last."""
        return self.recorded[-1] if self.recorded else None

    def save(self, folder: Path) -> None:
        """Replaces the file."""
        write_json(folder / RUN, self.to_dict(), force=True)

    @classmethod
    def load(cls, folder: Path) -> RunState | None:
        """Reads the file; None where there is none.

        Raises:
            InputError: a file of another kind, or a damaged one.
        """
        file, remedy = folder / RUN, "choose another folder"
        if not file.exists():
            return None
        data = read_json(file, cls.FORMAT, cls.FORMAT_VERSION, remedy=remedy)
        return cls.from_dict(data, file=file, remedy=remedy)


@contextmanager
def run_lock(folder: Path, what: str) -> Iterator[None]:
    """Keeps a second program out of a folder; the system lifts the lock of a killed program.

    What a killed program left unfinished is removed.

    Args:
        folder: the folder, which exists.
        what: is done in it, for the message.

    Raises:
        InputError: another program works there, or the folder cannot be written to.
    """
    path = folder / LOCK
    try:
        number = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise InputError(f"cannot be written to ({reason})", file=folder, remedy="choose another folder") from error
    try:
        try:
            lock(number)
        except OSError as error:
            raise InputError(
                f"another program {what} in this folder", file=folder, remedy="wait for its end, or end it"
            ) from error
        remove_partial_files(folder)
        yield
    finally:
        close_locked(number)
