"""Identifies mass, centre of mass and inertia of a payload, with 95 % intervals.

Takes two logs of one path, with and without the payload, or one log and a model of the robot without it. Writes
payload.json, report.html and the files of --to.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

from oed.cli.options.logs import KnownLogs
from oed.cli.options.results import Folder
from oed.cli.options.robots import CATALOGUE, Chain
from oed.cli.verbs import Printed, Verb
from robots.common.errors import InputError
from robots.common.options import Numbers, Option, Seed
from robots.common.progress import Progress


@dataclass(frozen=True, kw_only=True)
class Output(Folder):
    """What an identified payload is written to.

    Attributes:
        to: also write what a controller takes: urscript, franka, kuka, ros or urdf. Repeatable.
    """

    to: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Payload(Verb):
    """``oed payload``.

    Attributes:
        log: a log with the payload. Repeatable.
        without: a log without the payload, best of the same path. Repeatable. Needs only the robot's geometry.
        model: a model.json of the robot without the payload, or its folder, instead of --without.
        robot: the robot: a catalogue name (er3a, ur10, panda), a URDF or xacro, an MJCF (MuJoCo), or a robot YAML.
            Default: the model's robot.
        frame: frame of the results, as its pose in the flange frame of the robot's description: X,Y,Z [m] or
            X,Y,Z,ROLL,PITCH,YAW [m, rad]. Controller files need the controller's flange.
        link: the payload is on this link, counted from 1 by the joint that moves it, and in its frame. Default: on the
            flange.
        seed: seed of the random numbers.
    """

    function = "estimation.identify_payload"
    examples = (
        "oed payload --robot ur10 --log with.csv --without without.csv --to urscript --out payload",
        "oed payload --model model --log with.csv --to franka kuka --out payload",
    )
    alternatives = (("without", "model"),)

    log: tuple[Path, ...]
    without: tuple[Path, ...] = ()
    model: Path | None = None
    robot: Annotated[str | None, Option(section="Robot", names_file=True, choices=CATALOGUE)] = None
    chain: Chain = Chain()
    known: KnownLogs = KnownLogs()
    frame: Numbers = None
    link: int | None = None
    seed: Seed = 0
    output: Output = Output(out=Path("payload"))

    def unused(self) -> Collection[str]:
        """A body that all logs carry cancels out between logs with and without the payload."""
        return {"payload"} if self.without and any("=" not in text for text in self.known.payload) else set()

    def refusal(self, names: Collection[str]) -> InputError:
        """Says which logs --payload must name."""
        return InputError(
            "--payload without a number beside --without",
            allowed="NUMBER=KG,X,Y,Z, because it is not clear whether logs without the payload carry it too",
        )

    def run(self, progress: Progress) -> Printed:
        """Identifies the payload."""
        import numpy as np

        from estimation import identify_payload, load_model
        from estimation.payloads.exports import payload_export
        from estimation.payloads.stated import loaded_robot
        from robots.geometry.chain import pose_of

        if not self.without and self.model is None:
            raise InputError(
                "a log with a payload alone does not separate the payload from the arm",
                allowed="--without LOG, of the same path without the payload, or --model MODEL.JSON",
            )
        if self.without and self.robot is None:
            raise InputError("no robot", remedy="name it with --robot; its geometry is enough")
        if self.link is not None and self.output.to:
            raise InputError("--to and --link together", allowed="a payload on the flange for a controller")
        pose = np.eye(4) if self.frame is None else pose_of(self.frame)
        if pose is None:
            raise InputError(f"--frame {self.frame}", allowed="X,Y,Z [m] or X,Y,Z,ROLL,PITCH,YAW [m, rad]")
        output = self.output
        forms = list(dict.fromkeys(payload_export(name) for words in output.to for name in words.split(",")))
        with output.opened("payload.json", "report.html", *(form.file for form in forms)) as folder:
            model = None if self.model is None else load_model(self.model)
            named = None if self.robot is None else self.chain.load(self.robot)
            if model is not None:
                named = loaded_robot(model.robot, named)
            assert named is not None
            loaded, free = self.known.read(self.log, named), self.known.read(self.without, named)
            both = self.known.with_setup([*loaded, *free])
            described, logs = self.known.as_joint_torque(named, both, both[len(loaded) :])
            result = identify_payload(
                logs[: len(loaded)],
                robot=described if model is None else None,
                without=logs[len(loaded) :],
                model=model,
                link=self.link,
                seed=self.seed,
                progress=progress,
            ).seen_from(pose)
            self.output.save(folder, result)
            for form in forms if result.found else ():
                folder.path(form.file).write_text(form.text(result.seen, result.source), encoding="utf-8")
        written = "".join(f"\n{form.title} written to {(output.out / form.file).resolve()}" for form in forms)
        if forms and not result.found:
            written = "\nno controller file written: there is no payload to state"
        printed = output.printed(result)
        return replace(printed, summary=printed.summary + written)
