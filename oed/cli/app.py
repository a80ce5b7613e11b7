"""All commands, one file each."""

from __future__ import annotations

from typing import Annotated

import typer

from oed.cli.command import HELP
from oed.cli.commands.actuators import actuators
from oed.cli.commands.benchmark import benchmark
from oed.cli.commands.calibrate import calibrate
from oed.cli.commands.campaign import campaign
from oed.cli.commands.check import check
from oed.cli.commands.compare import compare
from oed.cli.commands.controller import controller
from oed.cli.commands.design import design
from oed.cli.commands.diagnose import diagnose
from oed.cli.commands.doctor import doctor
from oed.cli.commands.effects import effects
from oed.cli.commands.example import example
from oed.cli.commands.explain import explain
from oed.cli.commands.export import export
from oed.cli.commands.fleet import fleet
from oed.cli.commands.force import force
from oed.cli.commands.identify import identify
from oed.cli.commands.loop import loop
from oed.cli.commands.monitor import monitor
from oed.cli.commands.pareto import pareto
from oed.cli.commands.payload import payload
from oed.cli.commands.predict import predict
from oed.cli.commands.record import record
from oed.cli.commands.retime import retime
from oed.cli.commands.robot import robot, robots
from oed.cli.commands.show import show
from oed.cli.commands.simulate import simulate
from oed.cli.commands.stream import stream
from oed.cli.commands.thermal import thermal
from oed.cli.commands.view import view
from oed.cli.configuration.defaults import HELP_TEXT
from oed.cli.help.groups import Commands

FUNCTIONS = (
    design,
    pareto,
    retime,
    export,
    stream,
    record,
    controller,
    campaign,
    loop,
    simulate,
    show,
    check,
    identify,
    actuators,
    thermal,
    diagnose,
    predict,
    compare,
    monitor,
    fleet,
    payload,
    calibrate,
    force,
    benchmark,
    view,
    example,
    robot,
    robots,
    effects,
    explain,
    doctor,
)


class Program(Commands):
    """The commands of ``oed``."""

    functions = FUNCTIONS


app = typer.Typer(
    name="oed",
    cls=Program,
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
