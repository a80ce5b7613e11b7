"""Runs from logs: each identified by itself, with choices that are common to all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from estimation.comparisons.common_parameters import friction_term_of
from estimation.comparisons.runs import Run, distinct_labels, run_of, unique_labels
from estimation.identifications.choices import Candidates
from estimation.identifications.identification import identify
from robots.common.errors import InputError
from robots.common.progress import SILENT, Progress
from robots.robot import Robot
from robots.signals import Log


def identify_runs(
    robot: Robot,
    logs: Sequence[Log],
    *,
    friction: str = "auto",
    seed: int = 0,
    progress: Progress | None = None,
) -> list[Run]:
    """Identifies each log by itself, with one cut-off and one set of terms.

    All logs together choose the cut-off of the smoothing, the shape of the friction and whether there is a torque by
    position. Models then differ by what the robot did, not by what each log preferred.

    Args:
        robot: the robot.
        logs: two or more.
        friction: as for `identify`.
        seed: of the noise drawn to correct the standard errors.
        progress: receives the progress.

    Returns:
        A run per log.

    Raises:
        InputError: fewer than two logs; see also `identify`.
        NotIdentifiableError: see `identify`.
    """
    if len(logs) < 2:
        raise InputError(f"{len(logs)} log to compare", allowed="two or more")
    bar = progress or SILENT
    bar.start("identifying the logs", len(logs) + 1.0)
    together = identify(robot, list(logs), friction=friction, seed=seed)
    term = friction_term_of(together.model)
    assert term is not None
    term = replace(term, velocity_scale=0.0)
    candidates = Candidates(cutoffs=(together.choice.low_pass,), smoothers=())
    labels = _labels(logs)
    runs = []
    for number, (log, label) in enumerate(zip(logs, labels, strict=True), start=1):
        bar.update(float(number), f"log {number} of {len(logs)}")
        found = identify(robot, log, friction=term, position=together.choice.position, candidates=candidates, seed=seed)
        runs.append(run_of(found.model, label, str(log.metadata.get("file", ""))))
    bar.finish()
    return runs


def _labels(logs: Sequence[Log]) -> list[str]:
    files = [log.metadata.get("file") for log in logs]
    if all(files) and len(set(map(str, files))) == len(files):
        return distinct_labels([Path(str(file)) for file in files])
    return unique_labels([log.name or f"log {number}" for number, log in enumerate(logs, start=1)])
