"""The verb `run_loop`: experiments on a controller until the diagnosis leaves nothing ambiguous."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from os import PathLike
from pathlib import Path

import numpy as np

from estimation.diagnosis.experiment_plans.next_experiment import NextExperiment
from estimation.diagnosis.pipeline import diagnose
from estimation.diagnosis.results.diagnosis import DIAGNOSIS, MODEL, Diagnosis
from estimation.identifications.identification import identify
from estimation.logs import read_log
from oed.campaigns.checking import TorqueCheck, checked
from oed.campaigns.excitation import excitation_stage
from oed.campaigns.loops.options import LoopOptions
from oed.campaigns.loops.proposals import PlannedExperiment, PlannedRun, more_data, plan_experiment
from oed.campaigns.loops.result import LoopResult
from oed.campaigns.loops.state import Experiment, LoopRun, LoopState, Recorded, Verdict, identity, remove_loop
from oed.campaigns.runs.player import Player
from oed.campaigns.runs.stage_progress import TitledProgress, rest
from oed.campaigns.runs.state import run_lock
from oed.controllers import Endpoint, StreamOptions, read_pose
from oed.experiments import LimitOptions, SearchOptions
from oed.experiments import design as design_experiment
from oed.experiments.checks import velocity_share
from oed.exports import read_trajectory, write_trajectory
from robots.common.errors import InputError, OedError
from robots.common.files import ResultFolder, write_atomic
from robots.common.plain import several
from robots.common.progress import SILENT, Progress
from robots.robot import Robot
from robots.signals import Motion
from robots.version import VERSION

CONCLUSIVE = ("none", "named")


def run_loop(
    robot: Robot,
    endpoint: Endpoint,
    folder: str | PathLike[str],
    *,
    design: str | PathLike[str] | None = None,
    options: LoopOptions | None = None,
    stream_options: StreamOptions | None = None,
    speed: float = 1.0,
    workers: int | None = None,
    executor: Executor | None = None,
    force: bool = False,
    report: Callable[[Diagnosis, ResultFolder], None] | None = None,
    progress: Progress = SILENT,
) -> LoopResult:
    """Designs an experiment, plays it, identifies and diagnoses the robot, and plays the next experiment.

    The next experiment is the one that separates the causes which the logs leave open. The loop ends where nothing is
    ambiguous, where no experiment is likely to help, or where the number of experiments is used up. Each step's files
    stay in the folder; ``loop.json`` is replaced after each step, so a loop that was ended in any way goes on with the
    step that it had begun.

    Args:
        robot: the robot.
        endpoint: its controller.
        folder: for all files.
        design: folder of an `oed design` result for the first experiment; by default one is designed.
        options: budget, model and seed.
        stream_options: how trajectories are sent.
        speed: factor on real time, for a controller to test against.
        workers: processes of the design.
        executor: runs the design's searches instead.
        force: begin again, and remove what an earlier loop left in the folder.
        report: writes a page into the folder of each diagnosis, such as `oed.reports.save_report`.
        progress: listener.

    Returns:
        What was found, the way there included.

    Raises:
        InputError: a folder of another loop, other choices than before, a robot that stands elsewhere at the first
            start, or logs that the gate refuses.
        InfeasibleError: no design within the limits.
        LinkError: the controller cannot be reached, or falls silent.
        ControllerError: the controller is not ready, or the robot does not reach the end of a motion.
    """
    sent = replace(stream_options or StreamOptions(), speed=speed)
    place, chosen = Path(folder), options or LoopOptions()
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot be created ({error.strerror})", file=place, remedy="choose another folder") from error
    with run_lock(place, "runs a loop"):
        if force:
            remove_loop(place)
        state = LoopState.load(place)
        settings = {**chosen.settings(), "design": None if design is None else os.path.abspath(design)}
        if state is None:
            state = LoopState(robot=identity(robot), settings=settings)
        else:
            state.require_same(robot, settings, place)
        return _Loop(robot, endpoint, place, chosen, sent, state, report, progress).run(design, workers, executor)


class _Loop:
    """One start of a loop."""

    def __init__(
        self,
        robot: Robot,
        endpoint: Endpoint,
        folder: Path,
        options: LoopOptions,
        stream_options: StreamOptions,
        state: LoopState,
        report: Callable[[Diagnosis, ResultFolder], None] | None,
        progress: Progress,
    ) -> None:
        self.robot, self.endpoint, self.folder, self.options = robot, endpoint, folder, options
        self.stream_options, self.state, self.speed = stream_options, state, stream_options.speed
        self.report, self.progress = report, progress

    def run(self, design: str | PathLike[str] | None, workers: int | None, executor: Executor | None) -> LoopResult:
        begin, state = time.monotonic(), self.state
        resumed = bool(state.experiments)
        if not resumed:
            self._design(design, workers, executor)
        if state.ended and not state.success and len(state.experiments) < self.options.experiments:
            # A larger budget than last time: the last diagnosis is made again, for the motions that it proposes.
            state.ended = ""
            state.experiments[-1].diagnosis = None
        player = Player(
            robot=self.robot,
            home=np.array(state.home),
            endpoint=self.endpoint,
            options=self.stream_options,
            folder=self.folder,
            bodies=self.options.bodies(self.robot),
            needs_torque=True,
        )
        while not state.ended:
            number = len(state.experiments)
            try:
                self._play(number, player, resumed)
            except OedError as error:
                error.remedy = "; ".join(filter(None, [error.remedy, "the same command goes on from here"]))
                raise
            resumed = False
            following = self._diagnose(number)
            self._continue(number, following)
        return LoopResult(
            robot=self.robot,
            place=self.endpoint.place(self.endpoint.motion_port),
            folder=os.fspath(self.folder),
            experiments=tuple(state.experiments),
            ended=state.ended,
            success=state.success,
            duration=time.monotonic() - begin,
        )

    def _design(self, given: str | PathLike[str] | None, workers: int | None, executor: Executor | None) -> None:
        """Makes the first experiment: an excitation, or what a design's folder holds."""
        if given is None:  # A design takes minutes: a controller without torque is refused before.
            read_pose(self.robot, self.endpoint, self.stream_options.patience, needs_torque=True)
        made = given or design_experiment(
            self.robot,
            limits=LimitOptions(
                velocity_fraction=self.options.velocity_fraction,
                collision=self.options.collision,
                surroundings=self.options.surroundings,
            ),
            search=SearchOptions(
                effort=self.options.effort, seed=self.options.seed, workers=workers, executor=executor
            ),
            progress=self.progress,
        )
        stage, notes = excitation_stage(self.robot, made)
        home = stage.motion.q[0]
        checked(stage, self.robot, home, TorqueCheck(self.robot, 0.0))
        self.state.home = home.tolist()
        why = "an excitation that determines all parameters" + "".join(f"; {note}" for note in notes)
        first = PlannedRun(motion=stage.motion, pause=0.0)
        self._add(PlannedExperiment(kind="excitation", why=why, resolves=None, runs=(first,)))

    def _add(self, planned: PlannedExperiment) -> None:
        """Writes the motions of an experiment, each once, and notes the experiment."""
        number = len(self.state.experiments) + 1
        name = f"experiment_{number}"
        files: dict[int, str] = {}
        with ResultFolder(self.folder / name, True) as out:
            for run in planned.runs:
                if id(run.motion) not in files:
                    file = f"trajectory_{len(files) + 1}.csv"
                    files[id(run.motion)] = f"{name}/{file}"
                    stated = {"robot": self.robot.name, "experiment": planned.kind, "tool": f"robot-oed {VERSION}"}
                    write_trajectory(out.path(file), run.motion, stated, kinds=self.robot.chain.kinds)
        runs = [LoopRun(trajectory=files[id(run.motion)], pause=run.pause) for run in planned.runs]
        made = Experiment(kind=planned.kind, why=planned.why, resolves=planned.resolves, runs=runs)
        self.state.experiments.append(made)
        self.state.save(self.folder)

    def _play(self, number: int, player: Player, resumed: bool) -> None:
        """Plays the runs of an experiment that were not recorded yet."""
        experiment, state = self.state.experiments[number - 1], self.state
        last = state.last
        if last is not None and (self.folder / last.recording).exists():
            os.replace(self.folder / last.recording, self.folder / last.log)
        for index, run in enumerate(experiment.runs, start=1):
            if run.recorded is not None:
                continue
            last = state.last
            anchor = None if last is None else last.end
            title = f"experiment {number} of at most {self.options.experiments}, run {index} of {len(experiment.runs)}"
            if resumed and (last is not None or (self.folder / "interrupted").exists()):
                player.go_home(f"{number}_{index}_home", anchor, TitledProgress(self.progress, "moving home"))
                resumed = False
            if last is not None:
                rest(last.end.unix + run.pause / self.speed, self.progress, title)
            motion, _ = read_trajectory(self.folder / run.trajectory, n=self.robot.n)
            header = {"experiment": number, "run": index, "kind": experiment.kind}
            result, end, recording = player.play(
                motion,
                f"{number}_{index}",
                header,
                anchor=anchor,
                file=self.folder / run.trajectory,
                progress=TitledProgress(self.progress, title),
            )
            log = f"experiment_{number}/log_{index}.csv"
            run.recorded = Recorded(
                log=log,
                recording=f"interrupted/{recording.name}",
                rows=result.rows,
                lost=result.feedback["lost"],
                delay=result.delay,
                end=end,
            )
            state.save(self.folder)
            os.replace(recording, self.folder / log)

    def _diagnose(self, number: int) -> NextExperiment | None:
        """Identifies and diagnoses the robot from all logs so far."""
        logs = [self.folder / run.recorded.log for run in self.state.runs if run.recorded is not None]
        verdict, following = diagnose_logs(
            self.robot,
            logs,
            self.folder,
            f"experiment_{number}",
            friction=self.options.friction,
            seed=self.options.seed,
            report=self.report,
            progress=TitledProgress(self.progress, f"diagnosis after experiment {number}"),
        )
        self.state.experiments[number - 1].diagnosis = verdict
        return following

    def _continue(self, number: int, following: NextExperiment | None) -> None:
        """Plans the next experiment, or ends the loop with its reason."""
        state, options = self.state, self.options
        seen = state.experiments[-1].diagnosis
        assert seen is not None
        causes = ", ".join(seen.causes)
        if seen.verdict == "unexplained" and number < options.experiments and not state.has("mirrored"):
            self._add(more_data(self._motions()[0]))
            return
        if following is None:
            state.success = seen.verdict in CONCLUSIVE
            if seen.verdict == "none":
                state.ended = "no model error found, nothing is ambiguous"
            elif state.success:
                state.ended = f"named without ambiguity after {several(number, 'experiment')}: {causes}"
            else:
                state.ended = f"{seen.verdict}, and no experiment is proposed: {causes}"
        elif number >= options.experiments:
            state.ended = (
                f"none is left of {several(options.experiments, 'experiment')}; still ambiguous: {causes}. "
                f"Next would be: {following.why}"
            )
        else:
            planned = plan_experiment(
                following,
                self.robot,
                np.array(state.home),
                self._motions(),
                least_probability=options.least_probability,
                longest=options.longest,
                velocity_fraction=velocity_share(self.robot, options.velocity_fraction),
                bodies=options.bodies(self.robot),
                seed=options.seed,
            )
            if isinstance(planned, PlannedExperiment):
                self._add(planned)
                return
            state.ended = f"still ambiguous: {causes}. {planned}"
        state.save(self.folder)

    def _motions(self) -> Sequence[Motion]:
        files = dict.fromkeys(run.trajectory for run in self.state.runs)
        return [read_trajectory(self.folder / file, n=self.robot.n)[0] for file in files]


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
