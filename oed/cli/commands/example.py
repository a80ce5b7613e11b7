"""``oed example``: files to try the commands on."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from oed.cli.console import Console
from oed.cli.options import ForceOption, JsonOption, QuietOption


def example(
    out: Annotated[Path, typer.Option("--out", help="Folder for the files.")] = Path("example"),
    for_: Annotated[
        str, typer.Option("--for", help="What the files are for: dynamics (a log) or calibration (measured poses).")
    ] = "dynamics",
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Writes example files and the commands that use them.

    The log is that of a virtual robot with a hidden effect, which `oed diagnose` finds. Measured poses are those of one
    whose joint zeros and links are not as described, which `oed calibrate` finds.
    """
    from robots.common.errors import InputError

    if for_ not in ("dynamics", "calibration"):
        raise InputError(f"--for {for_}", allowed="dynamics or calibration")
    commands: tuple[str, ...]
    if for_ == "calibration":
        from oed.cli.first_steps.calibration_example import next_calibration_commands, write_calibration_example

        written, commands = write_calibration_example(out, force=force), next_calibration_commands(out)
        what = "The poses are those of a virtual robot whose zeros and links differ from robot.yaml. Next:"
    else:
        from oed.cli.first_steps.example_files import next_commands, write_example

        written, commands = write_example(out, force=force), next_commands(out)
        what = "The log is that of the virtual robot in worn.yaml, which robot.yaml does not fully describe. Next:"
    Console(json=json, quiet=quiet).result(
        "\n".join(
            [
                f"{', '.join(path.name for path in written)} written to {out.resolve()}",
                what,
                *(f"  {command}" for command in commands),
            ]
        ),
        {"folder": str(out), "files": [str(path) for path in written], "commands": list(commands)},
    )
