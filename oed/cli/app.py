"""All commands, one file each."""

from __future__ import annotations

import typer

from oed.cli.design import design
from oed.cli.export import export
from oed.cli.identify import identify
from oed.cli.predict import predict
from oed.cli.retime import retime
from oed.cli.simulate import simulate

app = typer.Typer(
    name="oed",
    help="Designs excitation experiments for robots, identifies their dynamics, and says how sure it is.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
for command in (design, retime, export, simulate, identify, predict):
    app.command()(command)


@app.callback()
def version(
    show: bool = typer.Option(False, "--version", help="Print the version and exit.", is_eager=True),
) -> None:
    """Designs excitation experiments for robots, identifies their dynamics, and says how sure it is."""
    if show:
        from robots.version import VERSION

        print(f"robot-oed {VERSION}")
        raise typer.Exit
