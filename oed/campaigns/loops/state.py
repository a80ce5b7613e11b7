"""Which experiments of a loop were made, and what they showed: a file that is replaced as a whole."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from oed.controllers.recording.clock import ClockAnchor
from robots.common.errors import InputError
from robots.common.records import Record, read_json, write_json
from robots.robot import Robot

LOOP = "loop.json"


@dataclass(kw_only=True)
class Recorded:
    """What was recorded of a run.

    Attributes:
        log: its file.
        recording: where the log was written before the run had ended.
        rows: of the log.
        lost: feedback messages that did not arrive; None where the feedback carries no time.
        delay: of a message to the controller [s]; None without pings.
        end: end of the log, for the clock of the next one.
    """

    log: str
    recording: str
    rows: int
    lost: int | None
    delay: float | None
    end: ClockAnchor


@dataclass(kw_only=True)
class LoopRun:
    """A motion that is played once.

    Attributes:
        trajectory: its file.
        pause: rest before it [s].
        recorded: its log; None where it was not played yet.
    """

    trajectory: str
    pause: float
    recorded: Recorded | None = None


@dataclass(kw_only=True)
class Verdict:
    """What the logs up to an experiment show.

    Attributes:
        folder: of the diagnosis.
        verdict: ``none``, ``named``, ``ambiguous`` or ``unexplained``.
        findings: as in diagnosis.json.
        before: held-out error of the base model per joint, as a share of the torque RMS.
        after: the same of the extended model.
        summary: the whole in words.
    """

    folder: str
    verdict: str
    findings: list[dict[str, Any]]
    before: list[float | None]
    after: list[float | None]
    summary: str

    @property
    def causes(self) -> list[str]:
        """The findings in words."""
        return [name_of(finding) for finding in self.findings]


@dataclass(kw_only=True)
class Experiment:
    """An experiment and what was learned from it.

    Attributes:
        kind: ``excitation``, or a kind that separates causes.
        why: why it is made.
        resolves: probability that it leaves one cause; None for the first one.
        runs: its motions, in order.
        diagnosis: of all logs up to it; None where it was not made yet.
    """

    kind: str
    why: str
    resolves: float | None
    runs: list[LoopRun]
    diagnosis: Verdict | None = None


@dataclass(kw_only=True)
class LoopState(Record, format="robot-oed loop"):
    """The loop so far.

    Attributes:
        robot: name and SHA-256 of the description.
        settings: choices that must stay the same.
        home: pose at which all motions begin and end.
        experiments: in order.
        ended: why the loop ended; empty while it goes on.
        success: whether nothing was ambiguous or unexplained at the end.
    """

    robot: dict[str, Any]
    settings: dict[str, Any]
    home: list[float] = field(default_factory=list)
    experiments: list[Experiment] = field(default_factory=list)
    ended: str = ""
    success: bool = False

    @property
    def runs(self) -> list[LoopRun]:
        """Runs of all experiments, in order."""
        return [run for experiment in self.experiments for run in experiment.runs]

    def has(self, kind: str) -> bool:
        """Whether an experiment of this kind was made."""
        return any(experiment.kind == kind for experiment in self.experiments)

    @property
    def last(self) -> Recorded | None:
        """What was recorded last."""
        recorded = [run.recorded for run in self.runs if run.recorded is not None]
        return recorded[-1] if recorded else None

    def save(self, folder: Path) -> None:
        """Replaces the file."""
        write_json(folder / LOOP, self.to_dict(), force=True)

    @classmethod
    def load(cls, folder: Path) -> LoopState | None:
        """Reads the file; None where there is none.

        Raises:
            InputError: a file of another kind, or a damaged one.
        """
        file, remedy = folder / LOOP, "choose another folder"
        if not file.exists():
            return None
        data = read_json(file, cls.FORMAT, cls.FORMAT_VERSION, remedy=remedy)
        return cls.from_dict(data, file=file, remedy=remedy)

    def require_same(self, robot: Robot, settings: Mapping[str, Any], folder: Path) -> None:
        """Refuses to go on with another robot or other choices.

        Raises:
            InputError: naming the difference.
        """
        if self.robot != identity(robot):
            raise InputError(
                f"the loop is of {self.robot.get('name')}, or of another description of it",
                file=folder / LOOP,
                remedy="choose another folder",
            )
        for name, value in settings.items():
            if self.settings.get(name) != value:
                raise InputError(
                    f"the loop began with {name} = {self.settings.get(name)}, not {value}",
                    file=folder / LOOP,
                    remedy="use the same options to go on, or choose another folder",
                )


def identity(robot: Robot) -> dict[str, Any]:
    """Gives what identifies a robot."""
    return {"name": robot.name, "sha256": robot.digest}


def name_of(finding: Mapping[str, Any]) -> str:
    """Names a finding in words."""
    joint = finding["joint"]
    return str(finding["effect"]).replace("_", " ") + ("" if joint is None else f" of joint {joint}")


def remove_loop(folder: Path) -> None:
    """Removes what a loop wrote into a folder, and nothing else."""
    for path in (*folder.glob("experiment_*"), folder / "interrupted"):
        shutil.rmtree(path, ignore_errors=True)
    for name in (LOOP, "diagnosis.json", "model.json", "report.html"):
        (folder / name).unlink(missing_ok=True)
