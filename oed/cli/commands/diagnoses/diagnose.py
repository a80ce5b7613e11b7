"""Finds the causes of a model's errors and extends the model.

Writes diagnosis.json, the extended model.json, report.html and, if useful, motions for the next experiment. Logs with
commands and without torque are diagnosed in the loop of their drives, with actuators.json in place of model.json.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from oed.cli.options.logs import KnownLogs
from oed.cli.options.models import Fit, model_for
from oed.cli.options.results import ModelFolder
from oed.cli.options.robots import Drives, RobotOptions
from oed.cli.verbs import Printed, Verb
from robots.common.errors import InputError
from robots.common.options import Option
from robots.common.progress import Progress

NEAREST = "model_for_simulation.json"
OfLogs, OfLimits = Option(only=("logs",)), Option(only=("limits",))


@dataclass(frozen=True, kw_only=True)
class Diagnose(Verb):
    """``oed diagnose``.

    Attributes:
        log: a log, or a folder of logs. Repeatable. All logs share one clock; pauses between them are real time. Logs
            that overlap in time are treated as with --own-clocks, with a note.
        held_out: a log of another motion for validation only; it is not used in the fit. Repeatable. One that overlaps
            the others in time counts as recorded a minute after them. Default: each log is predicted from the others,
            and each stretch of a single log from the rest.
        own_clocks: each log's time starts at its own zero. Logs are put one after the other, one minute apart.
            Heat and drift between logs are then as uncertain as that minute.
        gains: for logs of commands without torque: a YAML file with the control law and its gains. Default: the
            actuators of the MJCF.
        limits: before an experiment: compute which effects the planned --trajectory could show, and from which size on.
        trajectory: with --limits: a planned trajectory.csv. Repeatable.
        model: with --limits: an identified model.json. Default: the robot's nominal dynamics.
        noise: with --limits: expected torque noise as a fraction of the torque RMS.
    """

    function = "estimation.diagnose"
    examples = ("oed diagnose --robot er3a --log log.csv --held-out held_out.csv --out diagnosed",)

    robot: RobotOptions
    log: Annotated[tuple[Path, ...], OfLogs] = ()
    held_out: Annotated[tuple[Path, ...], OfLogs] = ()
    known: Annotated[KnownLogs, OfLogs] = KnownLogs()
    own_clocks: Annotated[bool, Option(section="Input")] = False
    gains: Annotated[Path | None, OfLogs] = None
    fit: Fit = Fit()
    limits: bool = False
    trajectory: Annotated[tuple[Path, ...], OfLimits] = ()
    model: Annotated[Path | None, OfLimits] = None
    noise: Annotated[float, Option(least=0.0)] = 0.02
    output: ModelFolder = ModelFolder(out=Path("diagnosed"))

    @property
    def use(self) -> str:
        """The limits of a planned motion, or the diagnosis of logs."""
        return "limits" if self.limits else "logs"

    def unused(self) -> Collection[str]:
        """Limits have no model to write."""
        return {*super().unused(), *(("urdf", "mjcf") if self.limits else ())}

    def reason(self, names: Collection[str]) -> tuple[str, str]:
        """Names --limits, or what goes without it."""
        if self.limits:
            return "--limits", "--limits needs --trajectory, and nothing about logs"
        return "--log", "give --log, or --limits with --trajectory"

    def run(self, progress: Progress) -> Printed:
        """Diagnoses logs, or computes the limits of planned motions."""
        if self.limits and not self.trajectory:
            raise typer.BadParameter("--limits needs --trajectory")
        if not self.limits and not self.log:
            raise typer.BadParameter("give --log, or --limits with --trajectory")
        if self.limits:
            return self._limits(progress)
        if self.gains is not None:
            return self._in_the_loop(progress)
        try:
            return self._diagnosis(progress)
        except InputError:
            if not self._commands_alone():
                raise
        return self._in_the_loop(progress)

    @property
    def _drives(self) -> Drives:
        chain = self.robot.chain
        return Drives(robot=self.robot.robot, gains=self.gains, joints=chain.joints, lock=chain.lock)

    def _commands_alone(self) -> bool:
        """Whether all logs have commands and neither torque nor current."""
        from estimation.actuators.runs import read_command_logs
        from robots.drives import load_branches

        try:
            chains = load_branches(self.robot.robot, joints=self.robot.chain.joints, locked=self._drives.locked)
            joints = self.robot.chain.joints
            logs = read_command_logs(self.log, chains, joints=joints, mapping=self.known.stated)
        except InputError:
            return False
        return all(log.command is not None and log.tau is None and log.current is None for log in logs)

    def _in_the_loop(self, progress: Progress) -> Printed:
        """Diagnoses logs of commands: diagnosis.json, actuators.json, motion.parquet and report.html."""
        from estimation.actuators import ActuatorOptions, identify_actuators, loop_diagnosis
        from estimation.actuators.runs import read_command_logs
        from oed.reports import save_report

        output = self.output
        if output.urdf is not None or output.mjcf is not None:
            raise InputError("--urdf and --mjcf need logs with torque", remedy="oed actuators writes files of drives")
        with output.opened("diagnosis.json", "actuators.json", "motion.parquet", "report.html") as folder:
            chains, known = self._drives.load()
            read, other = (
                read_command_logs(paths, chains, joints=self.robot.chain.joints, mapping=self.known.stated)
                for paths in (self.log, self.held_out)
            )
            both = self.known.with_setup([*read, *other])
            how = ActuatorOptions(free=known.unknown, seed=self.fit.seed)
            result = identify_actuators(
                chains, both[: len(read)], known.drives, held_out=both[len(read) :], options=how, progress=progress
            )
            place = folder.path("actuators.json").parent
            result.save(place)
            diagnosis = loop_diagnosis(result)
            diagnosis.save(place)
            save_report(result, folder, png=output.png)
        return Printed(summary="\n".join([diagnosis.summary(), *output.written()]), data=diagnosis.to_dict())

    def _limits(self, progress: Progress) -> Printed:
        """Computes which effects planned motions could show; writes limits.json and report.html."""
        from oed.campaigns.discriminations.detection_limits import detection_limits
        from oed.exports import read_trajectory

        robot = self.robot.load()
        with self.output.opened("limits.json", "report.html") as folder:
            model = None if self.model is None else model_for(self.model, robot.n)
            motions = [read_trajectory(path, n=robot.n)[0] for path in self.trajectory]
            result = detection_limits(robot, motions, model=model, noise=self.noise, progress=progress)
            self.output.save(folder, result, robot=robot.title or robot.name)
        return self.output.printed(result)

    def _diagnosis(self, progress: Progress) -> Printed:
        """Diagnoses logs: diagnosis.json, model.json, report.html, motions of the next experiment; URDF and MJCF."""
        from estimation import diagnose, on_one_clock
        from estimation.diagnosis.experiment_plans.experiment_motions import at_rate
        from estimation.predictions.simulability import unfit_of
        from oed.exports import write_trajectory

        output, robot = self.output, self.robot.load()
        with output.files() as files:
            with output.opened("diagnosis.json", "model.json", "report.html") as folder:
                read, other = self.known.read(self.log, robot), self.known.read(self.held_out, robot)
                # Held-out logs are numbered after the others.
                both = self.known.with_setup([*read, *other])
                robot, both = self.known.as_joint_torque(robot, both, both[: len(read)])
                if self.own_clocks:
                    both = on_one_clock(both)
                read, other = both[: len(read)], both[len(read) :]
                friction, seed = self.fit.friction, self.fit.seed
                result = diagnose(robot, read, held_out=other or None, friction=friction, seed=seed, progress=progress)
                output.save(folder, result, log=(other or read)[0])
                following = result.next_experiment
                kind, motions = ("", ()) if following is None else (following.kind, following.motions)
                for number, made in enumerate(motions, start=1):
                    motion, stated = at_rate(made, robot.period), {"robot": robot.name, "experiment": kind}
                    path = folder.path(f"next_experiment_{number}.csv")
                    write_trajectory(path, motion, stated, kinds=robot.chain.kinds)
                lines, data = [result.summary()], result.to_dict()
                unfit = unfit_of(result.model, both)
                if unfit is not None:
                    unfit.nearest.save(folder.path(NEAREST))
                    lines.append(f"  {unfit.summary()} It is written to {NEAREST}.")
                    data["unfit_for_simulation"] = unfit.to_dict()
            # The diagnosis is kept, even if no file can state its model.
            more, mjcf = output.write_models(result.model, robot, files)
        if mjcf is not None:
            data["mjcf"] = mjcf
        return Printed(summary="\n".join([*lines, *more, *output.written()]), data=data)
