"""Identification and diagnosis of all logs so far, with their files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from estimation.diagnosis.experiment_plans.next_experiment import NextExperiment
from estimation.diagnosis.pipeline import diagnose
from estimation.diagnosis.results.diagnosis import DIAGNOSIS, MODEL, Diagnosis
from estimation.identifications.identification import identify
from estimation.logs import read_log
from oed.campaigns.loops.state import Verdict
from robots.common.files import ResultFolder, write_atomic
from robots.common.progress import Progress
from robots.robot import Robot


def diagnose_logs(
    robot: Robot,
    files: Sequence[Path],
    folder: Path,
    name: str,
    *,
    friction: str,
    seed: int,
    report: Callable[[Diagnosis, ResultFolder], None] | None,
    progress: Progress,
) -> tuple[Verdict, NextExperiment | None]:
    """Identifies and diagnoses a robot.

    The results go to the sub-folders ``identified`` and ``diagnosed`` of the experiment. Diagnosis and extended model
    are copied to the folder itself, where the last ones are found.

    Args:
        robot: the robot.
        files: logs of all experiments, on one clock.
        folder: of the loop.
        name: sub-folder of the experiment.
        friction: of the base model.
        seed: of the resampling.
        report: writes a page into the folder of the diagnosis.
        progress: listener.

    Returns:
        What the logs show, and the experiment that is proposed.

    Raises:
        InputError: a log that the gate refuses.
        NotIdentifiableError: no joint moves.
    """
    logs = [read_log(file, robot.n, kinds=robot.chain.kinds) for file in files]
    estimate = identify(robot, logs, friction=friction, seed=seed)
    found = diagnose(robot, logs, friction=friction, seed=seed, progress=progress)
    summary = found.summary()
    with ResultFolder(folder / name / "identified", True) as out:
        estimate.save(out.path(MODEL).parent)
    with ResultFolder(folder / name / "diagnosed", True) as out:
        found.save(out.path(MODEL).parent)
        write_atomic(out.path("summary.txt"), summary + "\n")
        if report is not None:
            report(found, out)
    for file in (DIAGNOSIS, MODEL):
        write_atomic(folder / file, (folder / name / "diagnosed" / file).read_bytes(), force=True)
    data = found.to_dict()
    verdict = Verdict(
        folder=f"{name}/diagnosed",
        verdict=found.verdict,
        findings=data["findings"],
        before=data["baseline"]["nrmse"],
        after=data["extended"]["nrmse"],
        summary=summary,
    )
    return verdict, found.next_experiment
