"""``oed robot show`` and ``oed robots``: what was read of a robot, and the catalogue."""

from __future__ import annotations

import warnings
from typing import Annotated

import typer

from oed.cli.console import Console
from oed.cli.options import (
    ROBOT,
    AssumeMassesOption,
    JointsOption,
    JsonOption,
    LockOption,
    QuietOption,
    TipOption,
    robot_from,
)


def robot(
    action: Annotated[str, typer.Argument(help="What to do: show.", show_default=False)],
    file: Annotated[str, typer.Argument(help=f"The robot: {ROBOT}.", show_default=False)],
    tip: TipOption = None,
    joints: JointsOption = None,
    lock: LockOption = None,
    assume_masses: AssumeMassesOption = None,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Shows a robot's chain, limits and masses, and what is assumed of it."""
    console = Console(json=json, quiet=quiet)
    with console.working(), warnings.catch_warnings():
        from robots.common.errors import AssumedValueWarning, InputError
        from robots.robot_summary import robot_data, robot_summary

        if action != "show":
            raise InputError(f"oed robot {action}", allowed="show", remedy="oed robot show FILE")

        # The summary has them.
        warnings.simplefilter("ignore", AssumedValueWarning)
        described = robot_from(file, tip, joints, lock, assume_masses=assume_masses)
    console.result(robot_summary(described), robot_data(described))


def robots(json: JsonOption = False, quiet: QuietOption = False) -> None:
    """Lists the robots of the catalogue."""
    console = Console(json=json, quiet=quiet)
    with console.working(), warnings.catch_warnings():
        from robots.common.errors import AssumedValueWarning
        from robots.loading import catalogue, load_robot
        from robots.robot_summary import reach

        warnings.simplefilter("ignore", AssumedValueWarning)
        found = [load_robot(name) for name in catalogue()]
    rows = [
        {
            "name": known.name,
            "title": known.title,
            "joints": known.n,
            "payload": known.payload,
            "reach": round(reach(known), 3),
            "assumed": list(known.assumed),
        }
        for known in found
    ]
    lines = [f"{'name':8} {'robot':40} {'joints':>6} {'payload':>8} {'reach':>7}"]
    for row in rows:
        payload = "-" if row["payload"] is None else f"{row['payload']:g} kg"
        lines.append(f"{row['name']:8} {row['title']:40} {row['joints']:6} {payload:>8} {row['reach']:5.2f} m")
    lines.append("details: oed robot show NAME; --robot takes these names, and the path of a URDF, xacro or robot YAML")
    console.result("\n".join(lines), {"robots": rows})
