"""Writes example files and the commands that use them.

The log is that of a virtual robot with a hidden effect, which `oed diagnose` finds. Measured poses are those of one
whose joint zeros and links are not as described, which `oed calibrate` finds.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from oed.cli.options.results import Overwriting
from oed.cli.verbs import Printed, Verb
from robots.common.errors import InputError
from robots.common.options import Option
from robots.common.progress import Progress


@dataclass(frozen=True, kw_only=True)
class Example(Verb):
    """``oed example``.

    Attributes:
        out: folder for the files.
        for_: what the files are for: dynamics (a log) or calibration (measured poses).
    """

    examples = ("oed example --out example", "oed example --for calibration --out calibration")

    out: Annotated[Path, Option(section="Output")] = Path("example")
    for_: str = "dynamics"
    overwriting: Overwriting = Overwriting()

    def run(self, progress: Progress) -> Printed:
        """Writes the files."""
        force, commands = self.overwriting.force, tuple[str, ...]()
        if self.for_ == "calibration":
            from oed.examples.poses import next_calibration_commands, write_calibration_example

            written = write_calibration_example(self.out, force=force)
            commands = next_calibration_commands(self.out)
            what = "The poses are those of a virtual robot whose zeros and links differ from robot.yaml. Next:"
        elif self.for_ == "dynamics":
            from oed.examples.files import next_commands, write_example

            written, commands = write_example(self.out, force=force), next_commands(self.out)
            what = "The log is that of the virtual robot in worn.yaml, which robot.yaml does not fully describe. Next:"
        else:
            raise InputError(f"--for {self.for_}", allowed="dynamics or calibration")
        where = f"{', '.join(path.name for path in written)} written to {self.out.resolve()}"
        data = {"folder": str(self.out), "files": [str(path) for path in written], "commands": list(commands)}
        return Printed(summary="\n".join([where, what, *(f"  {command}" for command in commands)]), data=data)
