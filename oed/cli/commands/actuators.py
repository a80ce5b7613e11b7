"""``oed actuators``: drives of a robot from commands and positions, without torque."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from oed.cli.console import Console
from oed.cli.options import (
    ROBOT,
    ForceOption,
    JsonOption,
    LockOption,
    LogOption,
    MappingOption,
    OutOption,
    PngOption,
    QuietOption,
    RateOption,
    SeedOption,
    with_rate,
)


def actuators(
    robot: Annotated[
        str,
        typer.Option("--robot", help=f"The robot: {ROBOT}. Branches are read from a base that is held."),
    ],
    log: LogOption,
    gains: Annotated[
        Path | None,
        typer.Option(
            "--gains",
            help="A YAML file with the control law and its gains. Default: the actuators of the MJCF.",
            show_default=False,
        ),
    ] = None,
    held_out: Annotated[
        list[Path] | None,
        typer.Option(
            "--held-out",
            help="A log that nothing is fitted to. Repeatable. Default: the last 30 % of each run is held out.",
            show_default=False,
        ),
    ] = None,
    share: Annotated[
        str | None,
        typer.Option(
            "--share",
            help="Parts of joint names, comma-separated, whose joints share parameters: hip,thigh,calf; or all.",
            show_default=False,
        ),
    ] = None,
    free: Annotated[
        str | None,
        typer.Option(
            "--free",
            help="Parameters to identify besides delay, armature, friction and offset, comma-separated: kp,kd.",
            show_default=False,
        ),
    ] = None,
    effects: Annotated[bool, typer.Option(help="Look for effects beyond these.")] = True,
    mapping: MappingOption = None,
    rate: RateOption = None,
    joints: Annotated[
        str | None,
        typer.Option(
            "--joints",
            help="The joints of the log in its order, comma-separated; others are locked.",
            show_default=False,
        ),
    ] = None,
    lock: LockOption = None,
    seed: SeedOption = 0,
    out: OutOption = Path("drives"),
    png: PngOption = False,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Identifies delay, rotor inertia, friction and gains of drives from commands and positions.

    Needs no torque. Writes actuators.json, motion.parquet, parameters.csv, drives.xml (MuJoCo), isaac_lab.py,
    newton.json, for a URDF drives.urdf, and report.html.
    """
    console = Console(json=json, quiet=quiet)
    with console.working() as progress:
        from estimation.actuators import ActuatorOptions, identify_actuators
        from estimation.actuators.exports import simulator_files
        from oed.cli.drives import joint_order, limits_of, logs_from, named, positions
        from oed.reports import save_actuators_report
        from robots.branches import load_branches
        from robots.common.files import ResultFolder
        from robots.drives import described_drives

        names = ("actuators.json", "motion.parquet", "parameters.csv", "report.html")
        with ResultFolder(out, force, names=names) as folder:
            chains = load_branches(robot, joints=named(joints), locked=positions(lock))
            known = described_drives(chains, gains)
            order = joint_order(chains, named(joints))
            kinds = tuple(kind for chain in chains for kind in chain.chain.kinds)
            read: dict[str, Any] = {
                "n": len(order.names),
                "torque": False,
                "mapping": with_rate(mapping, rate),
                "joints": order.names,
                "kinds": order.put(kinds),
            }
            limits = limits_of(chains, order)
            logs = [order.sorted(one) for one in logs_from(log, limits, read)]
            outside = [order.sorted(one) for one in logs_from(held_out or [], limits, read)]
            options = ActuatorOptions(
                share=named(share) or (), free=(*(named(free) or ()), *known.unknown), effects=effects, seed=seed
            )
            result = identify_actuators(
                chains, logs, known.drives, held_out=outside, options=options, progress=progress
            )
            result.save(folder.path("actuators.json").parent)
            result.to_frame().to_csv(folder.path("parameters.csv"), index=False)
            written = simulator_files(result, out)
            for name, text in written.files.items():
                folder.path(name).write_text(text, encoding="utf-8")
            save_actuators_report(result, folder, png=png)
    lines = [result.summary(), *(f"  {remark}" for remark in written.remarks), f"written to {out.resolve()}"]
    console.result("\n".join(lines), result.to_dict())
