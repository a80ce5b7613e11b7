"""``oed doctor``: what is installed, and what is missing."""

from __future__ import annotations

import typer

from oed.cli.console import Console
from oed.cli.options import JsonOption, QuietOption


def doctor(context: typer.Context, json: JsonOption = False, quiet: QuietOption = False) -> None:
    """Checks the installation: libraries, extras and what they bring, compiler, configuration file.

    Exit code 1 if a required library is missing or too old, or if the configuration file is wrong.
    """
    from oed.cli.configuration.defaults import configuration_state
    from oed.cli.first_steps.installation import installation, installation_text, with_configuration

    found = with_configuration(installation(), configuration_state(context))
    Console(json=json, quiet=quiet).result(installation_text(found), found)
    if found["problems"]:
        raise typer.Exit(1)
