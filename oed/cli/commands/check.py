"""``oed check``: whether logs can be used, and what is wrong with them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from oed.cli.console import Console
from oed.cli.options import (
    JointsOption,
    JsonOption,
    LockOption,
    MappingOption,
    QuietOption,
    RateOption,
    RobotOption,
    TipOption,
    robot_from,
    with_rate,
)
from oed.cli.set_up import GravityOption, PayloadOption, TorqueIsOption, with_known_setup, with_torque_meaning


def check(
    logs: Annotated[list[Path], typer.Argument(metavar="LOG...", help="Logs, or folders of logs.", show_default=False)],
    robot: RobotOption,
    mapping: MappingOption = None,
    rate: RateOption = None,
    payload: PayloadOption = None,
    gravity: GravityOption = None,
    torque_is: TorqueIsOption = None,
    tip: TipOption = None,
    joints: JointsOption = None,
    lock: LockOption = None,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Checks logs before anything is fitted to them: units, clocks, signs, outliers, the meaning of the torque.

    Writes nothing. The exit code is 0 if all logs are usable, 1 if one is not, 2 if one cannot be read.
    """
    console = Console(json=json, quiet=quiet)
    with console.working() as progress:
        from estimation import check_log, read_logs

        described = robot_from(robot, tip, joints, lock)
        progress.start("checking the logs", None)
        names, kinds = described.joint_names, described.chain.kinds
        read = read_logs(logs, n=described.n, torque=False, mapping=with_rate(mapping, rate), joints=names, kinds=kinds)
        described, known = with_torque_meaning(described, with_known_setup(read, payload, gravity), torque_is)
        reports = [check_log(described, log) for log in known]
    refused = [report for report in reports if report.refused]
    console.result(
        "\n".join(report.summary() for report in reports),
        {"usable": not refused, "logs": [report.to_dict() for report in reports]},
    )
    if refused:
        raise typer.Exit(1)
