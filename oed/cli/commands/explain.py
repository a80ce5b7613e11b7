"""``oed explain``: what a code in a message means."""

from __future__ import annotations

from typing import Annotated

import typer

from oed.cli.console import Console
from oed.cli.options import JsonOption, QuietOption


def explain(
    code: Annotated[str, typer.Argument(help="a code such as OED-L014, or the name of a finding; all by default")] = "",
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Explains a finding of `oed check`: what it means, a log that causes it, and what to do.

    Without a code it lists all of them.
    """
    console = Console(json=json, quiet=quiet)
    with console.working():
        from estimation.gate.explanations import EXPLANATIONS
        from estimation.gate.explanations import explain as find

        found = (find(code),) if code else EXPLANATIONS
    listed = [f"{item.code}  {item.name:20} {item.meaning}" for item in found]
    console.result(found[0].text() if code else "\n".join(listed), {"codes": [item.to_dict() for item in found]})
