"""Plans a measurement campaign that warms the robot up, and plays it with --run.

Writes campaign.json, one CSV file for each stage, and report.html; with --run also run.json and a log for each
stage in the folder logs.
"""

from __future__ import annotations

import os
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from oed.campaigns.programme import Programme
from oed.cli.declarations.declared import declared_options
from oed.cli.options.motions import Collisions
from oed.cli.options.results import Folder
from oed.cli.options.robots import PlannedRobot
from oed.cli.options.work import Processes
from oed.cli.verbs import Printed, Verb
from oed.controllers.options import OF_STREAM, Endpoint, StreamOptions
from robots.common.errors import InputError
from robots.common.options import Option, Seed
from robots.common.progress import Progress

if TYPE_CHECKING:
    from oed.campaigns import Campaign as Planned
    from robots.robot import Robot


@dataclass(frozen=True, kw_only=True)
class Campaign(Verb):
    """``oed campaign``.

    Attributes:
        design: folder of an `oed design` result. Default: a quick design is made now.
        velocity_fraction: fraction of the velocity limits to use.
        torque_margin: fraction of the torque limits to keep as reserve.
        ambient: ambient temperature [degC].
        cold_friction: friction of the cold robot divided by that of its description, for the temperature forecast.
        host: play the campaign on the controller at this host, and record each stage. The campaign is planned if --out
            holds none yet. After an interruption the same command goes on.
        seed: seed of the random numbers.
    """

    function = "oed.campaign"
    examples = (
        "oed campaign --robot er3a --design experiment --out campaign",
        "oed campaign --robot er3a --out campaign --run 192.168.0.10",
    )

    robot: PlannedRobot
    programme: Programme = Programme()
    design: Path | None = None
    velocity_fraction: float = 1.0
    torque_margin: float = 0.1
    collisions: Collisions = Collisions()
    ambient: Annotated[float, Option(section="Input")] = 20.0
    cold_friction: float = 1.0
    seed: Seed = 0
    work: Processes = Processes()
    host: Annotated[str | None, Option(name="run")] = None
    link: Annotated[Endpoint | None, Option(only=("run",))] = None
    streaming: Annotated[StreamOptions, Option(only=("run",), without=OF_STREAM)]
    output: Folder = Folder(out=Path("campaign"))

    @property
    def use(self) -> str:
        """Whether the campaign is played."""
        return "plan" if self.host is None else "run"

    def refusal(self, names: Collection[str]) -> InputError:
        """Says that a link needs a controller."""
        verb = "does" if len(names) == 1 else "do"
        return InputError(
            f"{', '.join(names)} {verb} not apply without --run", remedy="add --run HOST", kind="option_not_used"
        )

    def kept(self) -> str:
        """Says that the robot stops, if it is played on."""
        if self.host is not None and (self.output.out / "campaign.json").exists():
            return "the robot was ordered to stop; the same command goes on"
        return "nothing was written"

    def run(self, progress: Progress) -> Printed:
        """Plans the campaign, and plays it."""
        robot, output = self.robot.load(), self.output
        place = self.link
        if place is None or not (output.out / "campaign.json").exists():
            planned = self._planned(robot, progress)
        elif output.force:
            raise InputError(
                "--force with --run would plan the campaign again",
                file=output.out,
                remedy="leave out --force to go on, or choose another folder",
            )
        else:
            planned = self._resumed(robot)
        if place is None:
            printed = output.printed(planned)
            for stage in printed.data["stages"]:
                del stage["segments"], stage["plateaus"]
            return printed
        from oed.campaigns.runs import run_campaign
        from oed.controllers.interrupts import terminate_as_interrupt

        with terminate_as_interrupt():
            played = run_campaign(
                output.out,
                place,
                robot=robot,
                options=self.streaming,
                speed=self.streaming.speed,
                collision=self.collisions.collision,
                progress=progress,
            )
        return Printed(played.summary(), played.to_dict())

    def _planned(self, robot: Robot, progress: Progress) -> Planned:
        from oed import campaign

        stages = (f"{name}.csv" for name in self.programme.stage_names)
        with (
            self.work.executor() as executor,
            self.output.opened("campaign.json", "report.html", *stages) as folder,
        ):
            result = campaign(
                robot,
                programme=self.programme,
                design=self.design,
                velocity_fraction=self.velocity_fraction,
                torque_margin=self.torque_margin,
                collision=self.collisions.collision,
                surroundings=self.collisions.surroundings(),
                ambient=self.ambient,
                cold_friction=self.cold_friction,
                seed=self.seed,
                workers=self.work.workers,
                executor=executor,
                progress=progress,
            )
            self.output.save(folder, result)
        return result

    def _resumed(self, robot: Robot) -> Planned:
        """Loads the campaign of the folder.

        Raises:
            InputError: an option was typed with which it was not planned, naming the first one.
        """
        from oed.campaigns import Campaign as Planned

        planned = Planned.load(self.output.out, robot)
        stored = {**planned.choices(), "no_floor": planned.settings.get("floor")}
        around = self.collisions.surroundings().settings()
        own = ("ambient", "cold_friction", "torque_margin", "velocity_fraction", "seed")
        given = {
            **self.programme.to_dict(),
            **{name: getattr(self, name) for name in own},
            **{"collision": self.collisions.collision, "no_floor": around["floor"], **around},
            "design": None if self.design is None else os.path.abspath(self.design),
        }
        for field, option in declared_options(type(self)).items():
            if field in self.typed and field in given and stored.get(field) != given[field]:
                raise InputError(
                    f"the campaign was planned with another --{option.name}: {stored.get(field, 'not known')}",
                    file=self.output.out / "campaign.json",
                    remedy="leave the option out to go on, or choose another folder",
                )
        return planned
