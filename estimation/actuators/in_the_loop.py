"""A diagnosis in the loop: what makes the simulated motion wrong, in the form of other diagnoses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from estimation.actuators.effects import BY_NAME
from estimation.actuators.result import Actuators, DriveValue, MotionError
from robots.common.records import Finding, Record, Result, axes_for, findings_of

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


@dataclass(frozen=True, kw_only=True)
class Known(Record):
    """A parameter of an effect: name, value, unit and 95 % interval."""

    name: str
    value: float
    unit: str
    ci95: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Named(Record):
    """An effect that was named.

    Attributes:
        effect: its name.
        joint: counted from 1 over all chains.
        name: of the joint.
        states: its values in words.
        parameters: with intervals.
        before: held-out error of the joint without it [rad or m].
        after: with it.
        rivals: other effects, with the held-out errors that they leave.
    """

    ENTRIES = (
        "effect",
        "joint",
        "name",
        "states",
        "parameters",
        "gain.error_before=before",
        "gain.error_after=after",
        "rivals",
    )

    effect: str
    joint: int
    name: str
    states: str
    parameters: tuple[Known, ...]
    before: float
    after: float
    rivals: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True, kw_only=True)
class LoopDiagnosis(Result, format="robot-oed loop diagnosis"):
    """What makes the simulated motion of a robot wrong, from commands and positions.

    Attributes:
        robot: its name.
        verdict: ``none``, ``named`` or ``unexplained``.
        findings: effects, strongest first.
        errors: of the simulated motion, joint by joint.
        unexplained: names of joints whose error no effect explains.
        next_motion: what to log next.
        notes: limitations.
    """

    FILE = "diagnosis.json"
    ENTRIES = ("robot", "verdict", "findings", "errors", "unexplained", "next_motion", "notes")

    robot: str
    verdict: str
    findings: tuple[Named, ...]
    errors: tuple[MotionError, ...]
    unexplained: tuple[str, ...]
    next_motion: str
    notes: tuple[str, ...] = ()

    @property
    def success(self) -> bool:
        """Whether the verdict is conclusive: ``none`` or ``named``."""
        return self.verdict != "unexplained"

    @property
    def conclusion(self) -> str:
        """What was found."""
        causes = ", ".join(f"{BY_NAME[item.effect].title} of {item.name}" for item in self.findings)
        said = f"The simulated motion is wrong by: {causes}." if causes else "No effect beside the usual drive shows."
        if self.unexplained:
            said += f" The error of {', '.join(self.unexplained)} is not explained."
        return said

    @property
    def remarks(self) -> tuple[Finding, ...]:
        """Effects, joints that stay unexplained, and notes."""
        found = [Finding(code="drives.effect", subject=item.name, text=f"{item.states}.") for item in self.findings]
        found += [
            Finding(code="drives.unexplained", subject=name, text="its error is not explained", action=self.next_motion)
            for name in self.unexplained
        ]
        return (*found, *findings_of("drives.note", self.notes))

    def summary(self) -> str:
        """Lists the verdict and the effects with their gain on held-out data."""
        lines = [f"{self.robot}: diagnosis in the loop (the logs have commands, no torque): {self.verdict}"]
        lines.append(f"  {self.conclusion}")
        for item in self.findings:
            lines.append(
                f"  {item.effect}, joint {item.joint} ({item.name}): {item.states}; held-out error "
                f"{1e3 * item.before:.3g} -> {1e3 * item.after:.3g} mrad"
            )
            known = (f"{p.name} {p.value:.3g} ({p.ci95[0]:.3g} to {p.ci95[1]:.3g}) {p.unit}" for p in item.parameters)
            lines.append(f"    95 % intervals: {'; '.join(known)}")
        held_out = ", ".join(f"{error.name} {1e3 * error.held_out:.3g}" for error in self.errors)
        lines.append(f"  held-out error of the simulated motion [mrad or mm]: {held_out}")
        if self.unexplained and self.next_motion:
            lines.append(f"  next: {self.next_motion}")
        return "\n".join(lines)

    def to_frame(self) -> pd.DataFrame:
        """Gives a row per finding."""
        import pandas as pd

        return pd.DataFrame(
            [
                {"effect": f.effect, "joint": f.joint, "name": f.name, "before": f.before, "after": f.after}
                for f in self.findings
            ]
        )

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws each joint's held-out error.

        Args:
            ax: where to draw; a new figure by default.
        """
        axes = axes_for(ax, (7, 4))
        axes.bar([error.name for error in self.errors], [1e3 * error.held_out for error in self.errors])
        axes.set_ylabel("held-out position error, RMS [mrad or mm]")
        return axes


def loop_diagnosis(result: Actuators) -> LoopDiagnosis:
    """Gives the diagnosis that identified drives are.

    Args:
        result: of `identify_actuators`, with its search for effects.
    """
    left = tuple(error.name for error in result.unexplained)
    return LoopDiagnosis(
        robot=result.robot,
        verdict="unexplained" if left else "named" if result.findings else "none",
        findings=tuple(
            Named(
                effect=item.effect,
                joint=item.joint,
                name=item.name,
                states=item.states,
                parameters=_known(result.parameters, item.name, BY_NAME[item.effect].free),
                before=item.before,
                after=item.after,
                rivals=item.rivals,
            )
            for item in result.findings
        ),
        errors=result.errors,
        unexplained=left,
        next_motion=result.next_motion,
        notes=result.notes,
    )


def _known(values: Sequence[DriveValue], joint: str, names: Sequence[str]) -> tuple[Known, ...]:
    return tuple(
        Known(name=value.parameter, value=value.value, unit=value.unit, ci95=(value.lower, value.upper))
        for value in values
        if value.parameter in names and joint in value.joints
    )
