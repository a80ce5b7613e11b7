"""The commands of ``oed``."""

from __future__ import annotations

from typing import Annotated, ClassVar

import typer

from oed.cli.command import HELP
from oed.cli.configuration.defaults import HELP_TEXT
from oed.cli.program import Program, Verbs

COMMANDS = {
    "First steps": ("first_steps", ("example", "robots", "robot", "effects", "explain", "doctor", "schema")),
    "Experiments": ("experiments", ("design", "pareto", "retime", "campaign", "export", "show")),
    "Robot and virtual robot": ("controllers", ("stream", "record", "loop", "controller", "simulate")),
    "Models": ("models", ("check", "identify", "actuators", "thermal", "predict", "payload", "calibrate")),
    "Diagnosis": ("diagnoses", ("diagnose", "compare", "monitor", "fleet", "force", "view", "benchmark")),
}
"""What commands are for, the folder that has a module for each of them, and their names."""

VERBS = Verbs({name: f"oed.cli.commands.{folder}.{name}" for folder, names in COMMANDS.values() for name in names})


class Oed(Program):
    """The commands of ``oed``."""

    purposes: ClassVar = {title: names for title, (_, names) in COMMANDS.items()}
    verbs = VERBS


app = typer.Typer(
    name="oed",
    cls=Oed,
    context_settings=HELP,
    help="Designs excitation experiments for robots, identifies their dynamics, and diagnoses model errors.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def _show_version(wanted: bool) -> None:
    if wanted:
        from robots.version import VERSION

        print(f"robot-oed {VERSION}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and exit.", is_eager=True, callback=_show_version)
    ] = False,
    config: Annotated[  # Read by the commands, which have this option too.
        str | None, typer.Option("--config", metavar="FILE", help=HELP_TEXT, show_default=False)
    ] = None,
) -> None:
    """Designs excitation experiments for robots, identifies their dynamics, and diagnoses model errors."""
