"""``oed diagnose``: the model's errors, their causes, and the gain of an extended model."""

from __future__ import annotations

from contextlib import ExitStack
from functools import partial
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
    MappingOption,
    MjcfOption,
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
from oed.cli.set_up import GravityOption, PayloadOption, TorqueIsOption, with_known_setup, with_torque_meaning
from oed.cli.unfit_models import NEAREST, unfit_of
from robots.common.progress import Progress

if TYPE_CHECKING:
    from estimation.logs.mappings.mapping import LogMapping
    from robots.robot import Robot


def diagnose(
    context: typer.Context,
    robot: RobotOption,
    log: Annotated[
        list[Path] | None,
        typer.Option("--log", help="A log, or a folder of logs. Repeatable.", show_default=False),
    ] = None,
    held_out: Annotated[
        list[Path] | None,
        typer.Option(
            "--held-out",
            help=(
                "A log for validation only; it is not used in the fit. Default: some of the --log runs are held out. "
                "Repeatable."
            ),
            show_default=False,
        ),
    ] = None,
    mapping: MappingOption = None,
    rate: RateOption = None,
    payload: PayloadOption = None,
    gravity: GravityOption = None,
    torque_is: TorqueIsOption = None,
    own_clocks: Annotated[
        bool,
        typer.Option(
            "--own-clocks",
            help="Each log's time starts at its own zero. Logs are put one after the other, one minute apart.",
        ),
    ] = False,
    friction: FittedFrictionOption = "auto",
    limits: Annotated[
        bool,
        typer.Option(
            "--limits",
            help=(
                "Before an experiment: compute which effects the planned --trajectory could show, and from which size "
                "on."
            ),
        ),
    ] = False,
    trajectory: Annotated[
        list[Path] | None,
        typer.Option("--trajectory", help="With --limits: a planned trajectory.csv. Repeatable.", show_default=False),
    ] = None,
    model: Annotated[
        Path | None,
        typer.Option(
            "--model",
            help="With --limits: an identified model.json. Default: the robot's nominal dynamics.",
            show_default=False,
        ),
    ] = None,
    noise: Annotated[
        float, typer.Option(min=0.0, help="With --limits: expected torque noise as a fraction of the torque RMS.")
    ] = 0.02,
    seed: SeedOption = 0,
    out: OutOption = Path("diagnosed"),
    urdf: Annotated[
        Path | None,
        typer.Option(
            "--urdf", help="Also write a URDF with the extended model's bodies and friction.", show_default=False
        ),
    ] = None,
    mjcf: MjcfOption = None,
    tip: TipOption = None,
    joints: JointsOption = None,
    lock: LockOption = None,
    png: PngOption = False,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Finds the causes of a model's errors and extends the model.

    Writes diagnosis.json, the extended model.json, report.html and, if useful, motions for the next experiment.
    """
    console = Console(json=json, quiet=quiet)
    with console.working() as progress:
        described = robot_from(robot, tip, joints, lock)
        if limits:
            of_logs = (log, held_out, mapping, rate, payload, gravity, torque_is, urdf, mjcf)
            if any(of_logs) or not trajectory:
                raise typer.BadParameter(
                    "--limits needs --trajectory; --log, --held-out, --mapping, --rate, --payload, --gravity, "
                    "--torque-is, --urdf and --mjcf do not apply",
                    ctx=context,
                )
            summary, data = _limits(described, trajectory, model, noise, out, force, progress)
        else:
            if not log or trajectory or model:
                raise typer.BadParameter("give --log, or --limits with --trajectory", ctx=context)
            known = (payload, gravity)
            models = (urdf, mjcf)
            summary, data = _diagnosis(
                described,
                log,
                held_out or [],
                with_rate(mapping, rate),
                known,
                torque_is,
                own_clocks,
                friction,
                seed,
                out,
                models,
                png,
                force,
                progress,
            )
    console.result(f"{summary}\nwritten to {out.resolve()}", data)


def _limits(
    robot: Robot,
    trajectories: list[Path],
    model: Path | None,
    noise: float,
    out: Path,
    force: bool,
    progress: Progress,
) -> tuple[str, dict[str, Any]]:
    """Computes which effects planned motions could show; writes limits.json and report.html."""
    import json as codec

    import numpy as np

    from estimation import load_model
    from estimation.diagnosis.experiment_plans.planned_limits import planned_limits
    from oed.exports import read_trajectory
    from oed.reports import save_limits_report
    from robots.common.errors import InputError
    from robots.common.files import ResultFolder, write_atomic
    from robots.plants import Sensors
    from robots.regressor import default_model
    from robots.signals import Motion

    with ResultFolder(out, force, names=["limits.json", "report.html"]) as folder:
        # The model that a diagnosis fits by default.
        torque_model = default_model(robot, friction="polynomial", velocity_scale=1e-3)
        parameters = np.asarray(torque_model.nominal)
        beyond: list[str] = []
        if model is not None:
            known = load_model(model)
            if known.robot.n != robot.n:
                raise InputError(f"a model of {known.robot.n} joints", file=model, allowed=f"{robot.n}")
            torque_model = known.torque_model
            parameters = np.zeros(torque_model.size)
            parameters[list(known.columns)] = known.values
            beyond = [e.effect if e.joint is None else f"{e.effect} of joint {e.joint}" for e in known.extensions]
        smooth = [] if model is not None else [j for j, f in enumerate(np.asarray(robot.friction), 1) if not f.any()]
        notes = [_SMOOTH.format(", ".join(map(str, smooth)))] if smooth else []
        motions: list[Motion] = []
        for path in trajectories:
            motion = read_trajectory(path)[0]
            if motion.n != robot.n:
                raise InputError(f"a motion of {motion.n} joints", file=path, allowed=f"{robot.n}")
            start = float(motions[-1].t[-1]) + 1.0 if motions else 0.0
            motions.append(Motion(motion.t - motion.t[0] + start, motion.q, motion.dq, motion.ddq))
        progress.start("all effects, all joints", None)
        found = planned_limits(torque_model, parameters, motions, noise=Sensors(torque_noise=max(noise, 1e-4)))
        data = {
            "robot": robot.name,
            "limits": [limit.to_dict() for limit in found],
            "extensions_not_counted": beyond,
            "notes": notes,
        }
        write_atomic(folder.path("limits.json"), codec.dumps(data, indent=2, allow_nan=False) + "\n")
        save_limits_report(found, robot.title or robot.name, folder)
    hidden = sum(not np.isfinite(limit.detectable) for limit in found)
    named = sum(limit.attributable <= 0.02 for limit in found)
    summary = [
        f"{len(found)} pairs of effect and joint: {named} would be found and named at 2 % of the joint's torque RMS, "
        f"{hidden} cannot be found with this motion at any size",
        "  found: smallest effect, in % of the joint's torque RMS, that is found with 95 % probability",
        "  worst case: the same for the least visible shape; named: also distinguished from other effects",
        f"  {'effect':28} {'joint':>5} {'found [%]':>11} {'worst case':>10} {'named [%]':>11}   closest rival",
    ]
    summary += [
        f"  {limit.effect:28} {limit.joint or 'all':>5} {_percent(limit.detectable):>11} "
        f"{_percent(limit.at_worst):>10} {_percent(limit.attributable):>11}   {limit.toughest or ''}".rstrip()
        for limit in found
    ]
    summary += [f"  {note}" for note in notes]
    if beyond:
        summary.append(f"  these limits refer to the base model without its extensions: {', '.join(beyond)}")
    return "\n".join(summary), data


_SMOOTH = (
    "The robot's description states no friction for joints {}. The limits refer to a torque without it and may be "
    "far too small. Use --model with an identified model."
)


def _percent(share: float) -> str:
    return f"{100 * share:.2g}" if share < float("inf") else "-"


def _diagnosis(
    robot: Robot,
    logs: list[Path],
    held_out: list[Path],
    mapping: LogMapping | Path | None,
    known: tuple[list[str] | None, list[str] | None],
    torque_is: str | None,
    own_clocks: bool,
    friction: str,
    seed: int,
    out: Path,
    models: tuple[Path | None, Path | None],
    png: bool,
    force: bool,
    progress: Progress,
) -> tuple[str, dict[str, Any]]:
    """Diagnoses logs: diagnosis.json, model.json, report.html and the motions of the next experiment; URDF and MJCF."""
    from estimation import on_one_clock, read_logs
    from estimation.diagnosis.experiment_plans.experiment_motions import at_rate
    from estimation.diagnosis.pipeline import diagnose as run
    from estimation.exports import build_mjcf, build_urdf
    from oed.exports import write_trajectory
    from oed.reports import save_diagnosis_report
    from robots.common.files import ResultFolder, open_atomic

    urdf, mjcf = models
    with ExitStack() as files:
        # Opened before the work: an existing file ends the command early.
        streams = {path: files.enter_context(open_atomic(path, force=force)) for path in models if path}
        with ResultFolder(out, force, names=["diagnosis.json", "model.json", "report.html"]) as folder:
            reader = partial(read_logs, n=robot.n, mapping=mapping, joints=robot.joint_names, kinds=robot.chain.kinds)
            read, other = list(reader(logs)), list(reader(held_out)) if held_out else []
            # Held-out logs are numbered after the others.
            both = with_known_setup([*read, *other], *known)
            robot, both = with_torque_meaning(robot, both, torque_is, both[: len(read)])
            if own_clocks:
                both = on_one_clock(both)
            read, other = both[: len(read)], both[len(read) :]
            result = run(robot, read, held_out=other or None, friction=friction, seed=seed, progress=progress)
            result.save(folder.path("diagnosis.json").parent)
            following = result.next_experiment
            if following is not None:
                for number, made in enumerate(following.motions, start=1):
                    path = folder.path(f"next_experiment_{number}.csv")
                    motion = at_rate(made, robot.period)
                    stated = {"robot": robot.name, "experiment": following.kind}
                    write_trajectory(path, motion, stated, kinds=robot.chain.kinds)
            save_diagnosis_report(result, folder, log=(other or read)[0], png=png)
            lines, data = [result.summary()], result.to_dict()
            unfit = unfit_of(result.model, both)
            if unfit is not None:
                unfit.nearest.save(folder.path(NEAREST))
                lines.append(f"  {unfit.summary()} It is written to {NEAREST}.")
                data["unfit_for_simulation"] = unfit.to_dict()
        # The diagnosis is kept, even if no file can state its model.
        if urdf is not None:
            updated = build_urdf(result.model, robot)
            streams[urdf].write(updated.text.encode())
            lines += updated.lines()
        if mjcf is not None:
            made_of = build_mjcf(result.model, robot, folder=mjcf.parent)
            streams[mjcf].write(made_of.text.encode())
            lines += made_of.lines()
            data["mjcf"] = {"stated": list(made_of.stated), "remarks": list(made_of.remarks)}
        lines += [f"written to {path.resolve()}" for path in models if path is not None]
    return "\n".join(lines), data
