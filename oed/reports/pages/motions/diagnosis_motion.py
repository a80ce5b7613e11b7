"""The robot of a diagnosis in 3-D: joints with a finding are marked."""

from __future__ import annotations

from collections.abc import Iterable

from estimation.diagnosis.findings import Finding
from estimation.diagnosis.results.diagnosis import Diagnosis
from oed.reports.animations.animation import Animation
from oed.reports.animations.building import animate
from robots.signals import Log


def diagnosis_animation(diagnosis: Diagnosis, log: Log) -> Animation:
    """Plays a log of a diagnosis.

    Args:
        diagnosis: what was found.
        log: one of its logs.
    """
    name = f"log {log.name}" if log.name else "log"
    return animate(diagnosis.model.robot, log, marks=joint_marks(diagnosis.findings), source=name)


def joint_marks(findings: Iterable[Finding]) -> dict[int, str]:
    """Names the effects of each joint, counted from 1, that has any.

    Args:
        findings: of a diagnosis.
    """
    marks: dict[int, list[str]] = {}
    for finding in findings:
        if finding.joint is not None:
            marks.setdefault(finding.joint, []).append(finding.effect.replace("_", " "))
    return {joint: ", ".join(names) for joint, names in marks.items()}
