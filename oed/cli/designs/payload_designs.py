"""Options of ``oed design`` beside ``--payload-only``."""

from __future__ import annotations

import typer

from oed.cli.links import is_given
from robots.common.errors import InputError

MEANINGLESS = ("essential", "after", "task", "offset", "discriminate")
"""Options that concern parameters which a payload design counts as known."""


def refuse_beside_payload(context: typer.Context) -> None:
    """Refuses options that do not apply with ``--payload-only``.

    Raises:
        InputError: naming them.
    """
    given = [f"--{name}" for name in MEANINGLESS if is_given(context, name)]
    if given:
        verb = "does" if len(given) == 1 else "do"
        raise InputError(
            f"{', '.join(given)} {verb} not apply with --payload-only, which counts the arm as known",
            remedy="remove these options, or remove --payload-only",
        )
