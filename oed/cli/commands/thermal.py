"""``oed thermal``: rigid body, friction, and the change of friction with temperature."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from oed.cli.console import Console
from oed.cli.options import (
    FittedFrictionOption,
    ForceOption,
    JointsOption,
    JsonOption,
    LockOption,
    LogOption,
    MappingOption,
    OutOption,
    PngOption,
    QuietOption,
    RateOption,
    RobotOption,
    SeedOption,
    TipOption,
    robot_from,
    with_rate,
)

if TYPE_CHECKING:
    from estimation.thermal import CampaignEstimate
    from robots.signals import Log


def thermal(
    robot: RobotOption,
    log: LogOption,
    mapping: MappingOption = None,
    rate: RateOption = None,
    order: Annotated[
        str, typer.Option(help="Thermal model: 1, 2, advanced, fractional, or auto to compare them.")
    ] = "2",
    joint: Annotated[
        int | None,
        typer.Option(
            min=1,
            help=(
                "Joint for the model comparison and the duty-cycle figure. Default: the joint with the largest "
                "friction power."
            ),
            show_default=False,
        ),
    ] = None,
    alpha: Annotated[
        float | None,
        typer.Option(help="Known relative change of friction with temperature [1/K], negative.", show_default=False),
    ] = None,
    ambient: Annotated[
        float | None,
        typer.Option(help="Ambient temperature of logs that do not state it [degC].", show_default=False),
    ] = None,
    friction: FittedFrictionOption = "auto",
    seed: SeedOption = 0,
    out: OutOption = Path("thermal"),
    tip: TipOption = None,
    joints: JointsOption = None,
    lock: LockOption = None,
    png: PngOption = False,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Identifies parameters and the effect of temperature on friction.

    Writes model.json and report.html.
    """
    console = Console(json=json, quiet=quiet)
    with console.working() as progress:
        import json as codec

        import numpy as np

        from estimation import identify, read_logs
        from estimation.thermal import choose_thermal, fit_campaign, thermal_runs
        from oed.reports.pages.thermal_report import save_thermal_report
        from robots.common.errors import InputError
        from robots.common.files import ResultFolder, write_atomic
        from robots.thermal import thermal_model_class

        wanted = "second" if order == "auto" else thermal_model_class(order).name
        if alpha is not None and not (np.isfinite(alpha) and alpha < 0.0):
            raise InputError(
                f"--alpha {alpha}", allowed="a negative number, because friction falls as a joint warms up"
            )
        with ResultFolder(out, force, names=["model.json", "report.html"]) as folder:
            described = robot_from(robot, tip, joints, lock)
            if joint is not None and joint > described.n:
                raise InputError(f"--joint {joint}", allowed=f"1 to {described.n}")
            logs = _surrounded(
                read_logs(
                    log,
                    n=described.n,
                    mapping=with_rate(mapping, rate),
                    joints=described.joint_names,
                    kinds=described.chain.kinds,
                ),
                ambient,
            )
            identified = identify(described, logs, friction=friction, seed=seed, progress=progress)
            options: dict[str, Any] = {"alpha": alpha, "seed": seed, "progress": progress}
            result = fit_campaign(described, logs, order=wanted, model=identified.model, **options)
            shown = joint or _hottest(result)
            if result.thermal[shown - 1] is None:
                raise InputError(f"--joint {shown}", allowed="a joint that moves in the logs")
            choice = None
            if order == "auto":
                choice = choose_thermal(thermal_runs(result.model, logs, shown), **options)
                if choice.best != wanted:
                    result = fit_campaign(described, logs, order=choice.best, model=identified.model, **options)
            data = result.torque_model.to_dict()
            write_atomic(folder.path("model.json"), codec.dumps(data, indent=2, allow_nan=False) + "\n")
            save_thermal_report(result, logs, folder, joint=shown, choice=choice, png=png)
    found = [gate.summary() for gate in identified.gates if gate.findings]
    table = [f"joint {shown}: {choice.summary()}"] if choice else []
    console.result(
        "\n".join([*found, *table, result.summary(), f"written to {out.resolve()}"]),
        {**result.to_dict(), "joint": shown, "choice": choice.to_dict() if choice else None},
    )


def _surrounded(logs: Sequence[Log], ambient: float | None) -> tuple[Log, ...]:
    """Sets the ambient temperature of logs that do not state it."""
    from dataclasses import replace

    import numpy as np

    if ambient is None:
        return tuple(logs)
    return tuple(log if log.ambient is not None else replace(log, ambient=np.full(len(log), ambient)) for log in logs)


def _hottest(estimate: CampaignEstimate) -> int:
    """Finds the joint whose friction takes the most power."""
    powers = [0.0 if fit is None else max(run.power for run in fit.runs) for fit in estimate.thermal]
    return powers.index(max(powers)) + 1
