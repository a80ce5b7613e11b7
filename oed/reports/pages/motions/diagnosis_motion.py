"""The robot of a diagnosis in 3-D: joints with a finding are marked."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from estimation.diagnosis.findings import Finding
from estimation.diagnosis.results.diagnosis import Diagnosis
from oed.reports.animations.animation import Animation
from oed.reports.animations.building import animate
from robots.common.errors import InputError
from robots.common.records import Finding as Remark
from robots.common.records import effect_code
from robots.robot import Robot
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


def marked_findings(path: Path, robot: Robot) -> tuple[dict[int, str], tuple[Remark, ...]]:
    """Reads the joints that a diagnosis marks, and its findings.

    Args:
        path: a diagnosis.json, or its folder.
        robot: that is shown.

    Raises:
        InputError: no diagnosis, or one of a robot with more joints.
    """
    found = Diagnosis.load(path.parent if path.name == "diagnosis.json" else path).findings
    beyond = next((f for f in found if f.joint is not None and f.joint > robot.n), None)
    if beyond is not None:
        raise InputError(
            f"a finding at joint {beyond.joint}, but {robot.name} has {robot.n} joints",
            file=path,
            remedy="choose the diagnosis of this robot",
        )
    findings = tuple(
        Remark(
            code=effect_code(f.effect) if f.named else "diagnosis.unexplained",
            subject=f"Joint {f.joint}:" if f.joint else "",
            text=f.sentence,
        )
        for f in found
    )
    return joint_marks(found), findings
