"""Result: an experiment that distinguishes two causes, its probability of success, and its files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from estimation.diagnosis.hypothesis_tests.power import resolving_energy
from oed.campaigns.discriminations.motions import Run
from oed.experiments.results.design_file import TRAJECTORY
from oed.experiments.results.planned import OF_ROBOT, Planned
from oed.experiments.safety_checks.freedom import freedom_findings, freedom_of, freedom_text, is_free
from oed.experiments.safety_checks.margins import missing_limits
from oed.exports import write_trajectory
from robots.collision import Surroundings
from robots.common.arrays import Array
from robots.common.plain import percent
from robots.common.records import Finding, Record, findings_of
from robots.robot import Robot
from robots.signals import Motion
from robots.version import VERSION


@dataclass(frozen=True, kw_only=True)
class DiscriminationScore(Record):
    """One kind of experiment, judged.

    Attributes:
        kind: a name of `robots.terms.effects.EXPERIMENTS`.
        resolves: chance that it leaves one cause.
        energy: what is left of the true cause beside the wrong one, in units of the noise.
        duration: of all runs [s].
        runs: how many motions it takes, with changes by hand between them.
        shares: of each cause's energy, the largest that the other one leaves.
        visible: the largest that the base model alone leaves.
        note: why it cannot be made, or empty.
    """

    ENTRIES = ("kind", "resolves", "smallest_size=smallest", "duration", "runs", "note")

    kind: str
    resolves: float
    energy: float
    duration: float
    runs: int
    shares: tuple[float, float]
    visible: tuple[float, float]
    note: str = ""

    @classmethod
    def impossible(cls, kind: str, note: str) -> DiscriminationScore:
        """A kind that the limits forbid."""
        return cls(kind=kind, resolves=0.0, energy=-1.0, duration=0.0, runs=0, shares=(0, 0), visible=(0, 0), note=note)

    @property
    def merit(self) -> tuple[bool, float]:
        """What ranks it: first those that are sure without a change by hand, then by what is left (T-optimality)."""
        return self.runs == 1 and self.energy >= resolving_energy(), self.energy

    def smallest(self, size: float) -> float | None:
        """The size at which it separates the causes with 95 % chance, of one judged at a `size`; None for none."""
        return size * float(np.sqrt(resolving_energy() / self.energy)) if self.energy > 0 else None


@dataclass(frozen=True, kw_only=True, eq=False)
class Discrimination(
    Planned, format="robot-oed discriminating experiment", tool=True, shares=("size", "limits=robot.limits")
):
    """The experiment proposed.

    Attributes:
        robot: what it is for.
        rivals: name and joint (from 1, or None) of the two causes.
        kind: a name of `robots.terms.effects.EXPERIMENTS`.
        what: what the robot does in it.
        runs: its motions; more than one where a payload or the base is changed between them.
        ranking: all kinds, the best first.
        alone: the chance of the reference motion alone.
        noise: standard deviation of the torque noise (n,) [N m or N].
        size: of what the effect shows beyond the base model, as a share of the joint's torque RMS in the reference.
        settings: what makes the same experiment again.
        surroundings: what the motions are checked against; None where they are not checked for collisions.
    """

    ENTRIES = (
        *OF_ROBOT,
        "criterion",
        "rivals=named_rivals",
        "kind",
        "what",
        "why",
        "resolves",
        "reference_alone=alone",
        "size",
        "noise",
        "segments",
        "runs=stated_runs",
        "alternatives=ranking",
        "quality",
        "collision=freedom",
        "duration",
        "period=robot.period",
        "warnings",
        "settings",
    )

    robot: Robot
    rivals: tuple[tuple[str, int | None], ...]
    kind: str
    what: str
    runs: tuple[Run, ...]
    ranking: tuple[DiscriminationScore, ...]
    alone: float
    noise: Array
    size: float
    settings: Mapping[str, Any]
    surroundings: Surroundings | None = None

    @cached_property
    def freedom(self) -> dict[str, Any] | None:
        """Of collisions, as `collision_data` writes it, of the run that comes nearest to one; None: not checked."""
        if self.surroundings is None:
            return None
        bodies = self.surroundings.model(self.robot)
        motions = {id(run.motion): run.motion for run in self.runs}.values()
        found = [freedom_of(bodies, motion) for motion in motions]
        return min(
            (one for one in found if one), key=lambda one: (not one["meetings"], one["clearance"] or 0.0), default=None
        )

    criterion = "discriminate"
    quality = ()

    @property
    def named_rivals(self) -> list[dict[str, Any]]:
        """Effect and joint of the two causes."""
        return [{"effect": name, "joint": joint} for name, joint in self.rivals]

    @property
    def segments(self) -> list[dict[str, object]]:
        """Segments of the first run."""
        return self.runs[0].table()

    @property
    def stated_runs(self) -> list[dict[str, Any]]:
        """The runs, with the file of each."""
        return [
            {
                "file": file,
                "payload_kg": run.payload,
                "gravity": run.gravity,
                "duration": run.motion.duration,
                "segments": run.table(),
                "smallest_margins": run.margins,
            }
            for file, run in zip(self.files, self.runs, strict=True)
        ]

    @property
    def duration(self) -> float:
        """Of all runs [s]."""
        return sum(run.motion.duration for run in self.runs)

    @property
    def resolves(self) -> float:
        """The chance that it leaves one cause."""
        return next(judged.resolves for judged in self.ranking if judged.kind == self.kind)

    @property
    def motion(self) -> Motion:
        """The first run's motion."""
        return self.runs[0].motion

    @property
    def files(self) -> tuple[str, ...]:
        """The file of each run; runs of one and the same motion share it."""
        names: list[str] = []
        for number, run in enumerate(self.runs):
            same = next(
                (i for i in range(number) if np.array_equal(self.runs[i].motion.q, run.motion.q)),
                None,
            )
            first = TRAJECTORY if number == 0 else f"trajectory_{number + 1}.csv"
            names.append(first if same is None else names[same])
        return tuple(names)

    @property
    def labels(self) -> tuple[str, ...]:
        """The causes in words."""
        return tuple(
            name.replace("_", " ") + ("" if joint is None else f" of joint {joint}") for name, joint in self.rivals
        )

    @property
    def why(self) -> str:
        """The result in two sentences, without the last full stop."""
        first, second = self.labels
        return (
            f"A {self.kind.replace('_', ' ')} experiment ({self.what}) distinguishes {first} from {second} with "
            f"probability "
            f"{100 * self.resolves:.0f} %, for an effect size of {percent(self.size)} of the torque. "
            f"The reference motion alone reaches {100 * self.alone:.0f} %"
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """Conditions and limitations of the experiment."""
        notes = []
        if self.resolves < 0.5:
            notes.append(
                "No experiment is likely to distinguish them at this effect size and noise. Repeat the best one, or "
                "accept that both remain possible."
            )
        if any(run.payload for run in self.runs):
            mass = max(run.payload for run in self.runs)
            notes.append(
                f"A payload of {mass:.3g} kg with known mass and centre (here 0.1 m in front of the flange) must be "
                f"mounted before the marked run."
            )
        if any(run.gravity is not None for run in self.runs):
            notes.append("The base must be tilted by a known angle of 15 degrees before the marked run.")
        lacking = missing_limits(self.robot.limits)
        if lacking:
            notes.append(
                f"Conservative limits were assumed where the robot's description states none: {', '.join(lacking)}."
            )
        return tuple(notes)

    @property
    def conclusion(self) -> str:
        """What the experiment distinguishes, and whether to play it."""
        warning = "" if is_free(self.freedom) else "Do not play these motions. "
        return f"{warning}{self.why}. {freedom_text(self.freedom)}"

    @property
    def remarks(self) -> tuple[Finding, ...]:
        """What is not known of collisions, conditions, and how sure the decision is."""
        text = f"The experiment gives the right decision with {100 * self.resolves:.0f} % probability only."
        # Chance from which an experiment counts as sure.
        return (
            *freedom_findings(self.freedom),
            *findings_of("experiment.note", self.warnings),
            *findings_of("experiment.unsure", [text] if self.resolves < 0.95 else []),
        )

    def _save_beside(self, folder: Path, *, force: bool) -> None:
        """Writes the trajectories."""
        written: set[str] = set()
        for file, run in zip(self.files, self.runs, strict=True):
            if file not in written:
                stated = {
                    "robot": self.robot.name,
                    "experiment": self.kind,
                    "collisions": freedom_text(self.freedom),
                    "tool": f"robot-oed {VERSION}",
                }
                write_trajectory(folder / file, run.motion, stated, kinds=self.robot.chain.kinds, force=True)
                written.add(file)

    def summary(self) -> str:
        """Describes the experiment and its alternatives in a few lines."""
        lines = [
            f"{self.why}.",
            f"  {'kind':18}  {'prob. [%]':>10}   {'size [%]':>13}   {'duration [s]':>12}",
        ]
        for judged in self.ranking:
            least = judged.smallest(self.size)
            least_text = "-" if least is None else f"{100 * least:.2g}"
            value = judged.note or f"{100 * judged.resolves:10.0f}   {least_text:>13}   {judged.duration:12.0f}"
            lines.append(f"  {judged.kind:18}  {value}")
        lines.append("  prob.: of the right decision; size: effect with 95 % probability, in % of the torque")
        for file, run in zip(self.files, self.runs, strict=True):
            load = f", payload {run.payload:.3g} kg" if run.payload else ""
            tilt = ", base tilted by 15 degrees" if run.gravity is not None else ""
            lines.append(f"  {file}: {run.motion.duration:.1f} s{load}{tilt}")
        lines.append(f"  {freedom_text(self.freedom)}")
        return "\n".join([*lines, *(f"note: {text}" for text in self.warnings)])
