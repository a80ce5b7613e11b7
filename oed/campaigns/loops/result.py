"""What a loop of experiments found."""

from __future__ import annotations

from dataclasses import dataclass

from estimation.diagnosis.results.actions import action_for
from oed.campaigns.loops.state import Experiment, Verdict, name_of
from robots.common.plain import several
from robots.common.records import Finding, Result, effect_code, findings_of
from robots.robot import Robot
from robots.terms.effects import EFFECTS


@dataclass(frozen=True, kw_only=True, eq=False)
class LoopResult(Result):
    """A loop that has ended.

    Attributes:
        robot: the robot.
        place: the controller.
        folder: of all files.
        experiments: in order, each with what it showed.
        ended: why the loop ended.
        success: whether nothing was ambiguous or unexplained at the end.
        duration: from the beginning of this start [s].
    """

    ENTRIES = (
        "robot=robot.name",
        "place",
        "folder",
        "verdict=diagnosis.verdict",
        "causes=diagnosis.causes",
        "ended",
        "success",
        "duration",
        "experiments",
    )

    robot: Robot
    place: str
    folder: str
    experiments: tuple[Experiment, ...]
    ended: str
    success: bool
    duration: float

    @property
    def diagnosis(self) -> Verdict:
        """The last diagnosis."""
        last = self.experiments[-1].diagnosis
        assert last is not None
        return last

    @property
    def conclusion(self) -> str:
        """Why the loop ended."""
        return f"{self.ended[:1].upper()}{self.ended[1:]}."

    @property
    def remarks(self) -> tuple[Finding, ...]:
        """The findings of the last diagnosis, and whether the loop ended early."""
        found = [
            Finding(
                code=effect_code(item["effect"]) if item["effect"] in EFFECTS else "diagnosis.unexplained",
                subject=f"{name_of(item)}:",
                text=str(item.get("sentence", "")),
                action=action_for(item["effect"], [item["joint"]]) if item["effect"] in EFFECTS else "",
            )
            for item in self.diagnosis.findings
        ]
        return (
            *found,
            *findings_of("loop.unfinished", [] if self.success else [f"The loop ended early: {self.ended}."]),
        )

    def summary(self) -> str:
        """Gives the course in a few lines."""
        lines = [f"{self.robot.name}: {self.ended}"]
        for number, experiment in enumerate(self.experiments, start=1):
            seen = experiment.diagnosis
            assert seen is not None
            rows = sum(run.recorded.rows for run in experiment.runs if run.recorded is not None)
            causes = ", ".join(seen.causes) or "no cause"
            lines += [
                f"  experiment {number}, {experiment.kind.replace('_', ' ')}: {experiment.why}",
                f"    {several(len(experiment.runs), 'run')}, {rows} rows; then {seen.verdict}: {causes}",
                f"    held-out error per joint [% of torque RMS]: {percent(seen.before)} -> {percent(seen.after)}",
            ]
        return "\n".join(lines)


def percent(shares: list[float | None]) -> str:
    """Writes shares in per cent."""
    return " ".join("-" if share is None else f"{100 * share:.2f}" for share in shares)
