"""``oed example``: files to try the commands on."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from oed.cli.console import Console
from oed.cli.options import ForceOption, JsonOption, QuietOption


def example(
    out: Annotated[Path, typer.Option("--out", help="Folder for the files.")] = Path("example"),
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Writes example files and the three commands that use them.

    The log is that of a virtual robot with a hidden effect, which `oed diagnose` finds.
    """
    from oed.cli.first_steps.example_files import next_commands, write_example

    written = write_example(out, force=force)
    commands = next_commands(out)
    Console(json=json, quiet=quiet).result(
        "\n".join(
            [
                f"{', '.join(path.name for path in written)} written to {out.resolve()}",
                "The log is that of the virtual robot in worn.yaml, which robot.yaml does not fully describe. Next:",
                *(f"  {command}" for command in commands),
            ]
        ),
        {"folder": str(out), "files": [str(path) for path in written], "commands": list(commands)},
    )
