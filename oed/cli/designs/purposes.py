"""``oed design --for``: what an experiment is for, and which options go with it."""

from __future__ import annotations

from typing import Annotated

import typer

from oed.cli.links import is_given
from robots.common.errors import InputError

ForOption = Annotated[
    str,
    typer.Option(
        "--for",
        help="What the experiment is for: dynamics (a trajectory), calibration (poses), or actuators (commands for "
        "drives without torque).",
    ),
]

ONLY: dict[str, tuple[str, ...]] = {
    "calibration": ("poses", "measurement", "kinds", "view_from", "view_towards", "view_cone", "facing"),
    "actuators": ("gains", "duration"),
}
"""Options that apply with one purpose and with no other."""

COMMON = ("for_", "robot", "home", "seed", "out", "joints", "lock", "force", "json", "quiet", "config")
APPLY: dict[str, tuple[str, ...]] = {
    "calibration": (
        *("criterion", "velocity_fraction", "collision", "clearance", "floor", "no_floor", "keep_out", "noise", "png"),
        *("tip", "unlimited", "assume_masses"),
    ),
    "actuators": ("png",),
}
"""Further options that apply with a purpose, beside those of all."""


def refuse_unsuited(context: typer.Context, purpose: str) -> None:
    """Refuses a purpose that there is not, and options that do not go with it.

    Raises:
        InputError: naming them.
    """
    if purpose != "dynamics" and purpose not in ONLY:
        raise InputError(f"--for {purpose}", allowed=", ".join(("dynamics", *ONLY)))
    given = [name for name in context.params if is_given(context, name)]
    if purpose == "dynamics":
        wrong = [name for name in given if any(name in own for own in ONLY.values())]
        other = next((known for known, own in ONLY.items() if wrong and wrong[0] in own), "")
    else:
        wrong = [name for name in given if name not in (*COMMON, *ONLY[purpose], *APPLY[purpose])]
        other = "dynamics"
    if wrong:
        listed = ", ".join(f"--{name.replace('_', '-')}" for name in wrong)
        verb = "does" if len(wrong) == 1 else "do"
        raise InputError(f"{listed} {verb} not apply with --for {purpose}", remedy=f"remove them, or use --for {other}")
