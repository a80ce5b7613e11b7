"""Plays a trajectory or a campaign on a virtual robot.

Writes logs with t, q and tau.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from oed.cli.options.results import Overwriting
from oed.cli.options.robots import FileRobot
from oed.cli.verbs import Printed, Verb
from robots.common.errors import InputError
from robots.common.options import Option, Seed
from robots.common.progress import Progress

if TYPE_CHECKING:
    from robots.robot import Robot

OfTrajectory = Option(only=("trajectory",))


@dataclass(frozen=True, kw_only=True)
class Simulate(Verb):
    """``oed simulate``.

    Attributes:
        trajectory: the trajectory.csv to play.
        campaign: folder of an `oed campaign` to play instead of a trajectory.
        plant: YAML file with the virtual robot's true behaviour. Default: the robot's nominal dynamics and
            2 % of torque noise.
        model: a model.json to simulate instead of a plant, extensions included.
        payload: payload on the flange: a payload.json, or KG,X,Y,Z: mass [kg] and centre of mass in the flange frame
            [m].
        out: log file to write, .csv or .parquet (log.csv); for a campaign, the folder of the logs (logs).
        seed: seed of the random numbers.
    """

    function = "robots.simulate"
    examples = (
        "oed simulate --trajectory experiment/trajectory.csv --out log.csv",
        "oed simulate --trajectory experiment/trajectory.csv --plant plant.yaml --seed 1 --out log.csv",
    )
    alternatives = (("trajectory", "campaign"), ("plant", "model"))

    robot: FileRobot = FileRobot()
    trajectory: Path | None = None
    campaign: Path | None = None
    plant: Path | None = None
    model: Annotated[Path | None, OfTrajectory] = None
    payload: Annotated[str | None, Option(only=("trajectory",), section="Input", names_file=True)] = None
    seed: Seed = 0
    out: Annotated[Path | None, Option(section="Output")] = None
    overwriting: Overwriting = Overwriting()

    @property
    def use(self) -> str:
        """What is played."""
        return "campaign" if self.campaign is not None else "trajectory"

    def reason(self, names: Collection[str]) -> tuple[str, str]:
        """Says that a campaign is played by plants alone."""
        return "--campaign", f"{', '.join(names)} needs a --trajectory"

    def run(self, progress: Progress) -> Printed:
        """Plays on the virtual robot."""
        if self.campaign is not None:
            return self._campaign(self.campaign, progress)
        if self.trajectory is None:
            raise typer.BadParameter("give either --trajectory or --campaign")
        return self._trajectory(self.trajectory, progress)

    def _campaign(self, folder: Path, progress: Progress) -> Printed:
        from oed.campaigns import Campaign, record
        from robots.loading import load_robot
        from robots.plants import load_plant

        given, masses = self._given(), self.robot.assume_masses
        planned = Campaign.load(folder, given)
        if given is None and masses is not None:
            planned = replace(planned, robot=load_robot(planned.robot, assume_masses=masses))
        target = self.out or Path("logs")
        plant = load_plant(self.plant, planned.robot) if self.plant else None
        force = self.overwriting.force
        files = record(planned, target, plant=plant, seed=self.seed, force=force, progress=progress)
        data = {"folder": str(target), "files": list(files), "samples": planned.samples, "duration": planned.duration}
        size = f"{len(files)} logs, {planned.samples} samples, {planned.duration / 60:.1f} min"
        return _printed(size, planned.robot, target, data)

    def _trajectory(self, file: Path, progress: Progress) -> Printed:
        from estimation import write_log
        from estimation.payloads.body import read_body
        from estimation.predictions.virtual_robot import chosen_plant
        from oed.exports import read_trajectory
        from robots.plants import simulate

        given = self._given()
        motion, metadata = read_trajectory(file, n=given.n if given else None)
        progress.start("simulating", None)
        named = str(metadata.get("robot") or "")
        if given is None and not named and self.model is None:
            raise InputError("the file does not name its robot", file=file, remedy="give --robot")
        stated = given or (self.robot.load(named) if named else None)
        body = None if self.payload is None else read_body(self.payload).parameters
        plant, robot = chosen_plant(stated, plant=self.plant, model=self.model, body=body)
        log = simulate(plant, motion, seed=self.seed)
        target = self.out or Path("log.csv")
        write_log(target, log, force=self.overwriting.force, kinds=robot.chain.kinds)
        data = {"file": str(target), "samples": len(log), "duration": log.duration}
        return _printed(f"{len(log)} samples, {log.duration:.1f} s", robot, target, data)

    def _given(self) -> Robot | None:
        return self.robot.load() if self.robot.robot else None


def _printed(size: str, robot: Robot, target: Path, data: dict[str, Any]) -> Printed:
    data |= {"robot": robot.name, "assumed": list(robot.assumed)}
    return Printed(f"{size} of a virtual {robot.name} written to {target}", data)
