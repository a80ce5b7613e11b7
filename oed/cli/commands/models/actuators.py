"""Identifies delay, rotor inertia, friction and gains of drives from commands and positions.

Needs no torque. Writes actuators.json, motion.parquet, parameters.csv, drives.xml (MuJoCo), isaac_lab.py,
newton.json, for a URDF drives.urdf, and report.html.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

from estimation.actuators.options import ActuatorOptions
from oed.cli.declarations.declared import INPUT
from oed.cli.options.logs import Columns
from oed.cli.options.results import Folder
from oed.cli.options.robots import Drives
from oed.cli.verbs import Printed, Verb
from robots.common.options import Option
from robots.common.progress import Progress


@dataclass(frozen=True, kw_only=True)
class Actuators(Verb):
    """``oed actuators``.

    Attributes:
        log: a log with commands, a LeRobot data set, or a folder of logs. Repeatable.
        held_out: a log that nothing is fitted to. Repeatable. Default: the last 30 % of each run is held out.
        payload: known payload in a log, as NUMBER=KG,X,Y,Z: number of the log, mass [kg], centre of mass in the flange
            frame [m]; or NUMBER=payload.json. Without NUMBER= it applies to all logs. It sets the scale of gains that
            are not known.
        gravity: gravity in the base frame for a log with a tilted base, as NUMBER=X,Y,Z: number of the log, gravity
            [m/s2]. Without NUMBER= it applies to all logs.
    """

    function = "estimation.identify_actuators"
    examples = (
        "oed actuators --robot go2.xml --log run.parquet --gains gains.yaml --out drives",
        "oed actuators --robot arm.xml --log run.csv --held-out other.csv --share all --out drives",
    )

    drives: Drives
    log: tuple[Path, ...]
    held_out: tuple[Path, ...] = ()
    columns: Columns = Columns()
    payload: Annotated[tuple[str, ...], Option(names_file=True, section=INPUT)] = ()
    gravity: Annotated[tuple[str, ...], Option(section=INPUT)] = ()
    options: ActuatorOptions = ActuatorOptions()
    output: Folder = Folder(out=Path("drives"))

    def run(self, progress: Progress) -> Printed:
        """Identifies the drives."""
        from estimation.actuators import identify_actuators
        from estimation.actuators.exports import simulator_files
        from estimation.actuators.runs import read_command_logs
        from estimation.payloads.stated import with_stated_setup

        output, how = self.output, self.options
        with output.opened("actuators.json", "motion.parquet", "parameters.csv", "report.html") as folder:
            chains, known = self.drives.load()
            read, outside = (
                read_command_logs(paths, chains, joints=self.drives.joints, mapping=self.columns.stated)
                for paths in (self.log, self.held_out)
            )
            both = with_stated_setup([*read, *outside], payloads=self.payload, gravities=self.gravity)
            read, outside = both[: len(read)], both[len(read) :]
            how = replace(how, free=(*how.free, *known.unknown))
            result = identify_actuators(chains, read, known.drives, held_out=outside, options=how, progress=progress)
            output.save(folder, result)
            result.to_frame().to_csv(folder.path("parameters.csv"), index=False)
            written = simulator_files(result, output.out)
            for name, text in written.files.items():
                folder.path(name).write_text(text, encoding="utf-8")
        return output.printed(result, *(f"  {remark}" for remark in written.remarks))
