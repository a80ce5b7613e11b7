"""``oed effects``: what a diagnosis looks for."""

from __future__ import annotations

from oed.cli.console import Console
from oed.cli.options import JsonOption, QuietOption


def effects(json: JsonOption = False, quiet: QuietOption = False) -> None:
    """Lists the effects of the catalogue and the experiments that separate them.

    The names are those of `oed diagnose` and of plant files.
    """
    from oed.cli.first_steps.effect_table import effect_rows, effect_text

    console = Console(json=json, quiet=quiet)
    with console.working():
        rows = effect_rows()
    console.result(effect_text(rows), {"effects": rows})
