"""``oed design``: an optimal excitation experiment."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from oed.cli.configuration.defaults import is_from_file
from oed.cli.console import Console
from oed.cli.designs.payload_designs import is_given, refuse_beside_payload
from oed.cli.designs.pose_designs import (
    FacingOption,
    KindsOption,
    MeasurementOption,
    PosesOption,
    ViewConeOption,
    ViewFromOption,
    ViewTowardsOption,
    design_calibration,
)
from oed.cli.designs.purposes import ForOption, refuse_unsuited
from oed.cli.options import (
    AssumeMassesOption,
    BaseFrequencyOption,
    ClusterOption,
    CollisionOption,
    FamilyOption,
    FloorOption,
    ForceOption,
    FrictionOption,
    HarmonicsOption,
    JointsOption,
    JsonOption,
    KeepOutOption,
    LockOption,
    NoFloorOption,
    OutOption,
    PngOption,
    QuietOption,
    RobotOption,
    SeedOption,
    TipOption,
    TorqueMarginOption,
    UnlimitedOption,
    VelocityFractionOption,
    WorkersOption,
    executor_from,
    numbers,
    robot_from,
)
from oed.cli.set_up import CarriedOption


def design(
    context: typer.Context,
    robot: RobotOption,
    for_: ForOption = "dynamics",
    gains: Annotated[
        Path | None,
        typer.Option(
            "--gains",
            help="With --for actuators: a YAML file with the control law and its gains. Default: the MJCF's actuators.",
            show_default=False,
        ),
    ] = None,
    duration: Annotated[float, typer.Option(help="With --for actuators: length of the motion [s].")] = 20.0,
    criterion: Annotated[
        str,
        typer.Option(
            help=(
                "Design criterion: cond (condition number), d (log determinant), a (trace of the inverse), e (smallest "
                "singular value), i (prediction variance, needs --task), or cond-d (cond and d). Calibration: d by "
                "default, or an observability index, o1 to o5."
            )
        ),
    ] = "cond",
    friction: FrictionOption = "polynomial",
    offset: Annotated[
        bool, typer.Option("--offset", help="Include a constant torque offset per joint in the model.")
    ] = False,
    family: FamilyOption = "fourier",
    harmonics: HarmonicsOption = 5,
    base_frequency: BaseFrequencyOption = 0.1,
    periods: Annotated[int, typer.Option(help="Repetitions of the optimised part.")] = 3,
    strokes: Annotated[
        bool, typer.Option(help="Add one velocity stroke per joint: to the velocity limit, forwards and backwards.")
    ] = True,
    home: Annotated[
        str | None, typer.Option(help="Pose at start and end [rad or m], comma-separated.", show_default=False)
    ] = None,
    velocity_fraction: VelocityFractionOption = None,
    torque: Annotated[
        bool, typer.Option(help="Respect the torque limits, computed with the robot's nominal dynamics.")
    ] = True,
    torque_margin: TorqueMarginOption = 0.1,
    payload: CarriedOption = None,
    collision: CollisionOption = True,
    clearance: Annotated[float, typer.Option(help="Minimum clearance of bodies and obstacles [m].")] = 0.01,
    floor: FloorOption = None,
    no_floor: NoFloorOption = False,
    keep_out: KeepOutOption = None,
    tool_box: Annotated[
        str | None,
        typer.Option(
            help="Box for the flange in the base frame: xmin,xmax,ymin,ymax,zmin,zmax [m]; inf means no bound.",
            show_default=False,
        ),
    ] = None,
    singularity: Annotated[
        float | None,
        typer.Option(
            help="Lower bound for the smallest singular value of the flange's scaled Jacobian.", show_default=False
        ),
    ] = None,
    essential: Annotated[
        float, typer.Option(help="Leave out parameters that contribute less than this fraction of each joint's torque.")
    ] = 0.0,
    scaling: Annotated[
        str, typer.Option(help="Column scaling of the regressor in the criterion: none, nominal or unit.")
    ] = "none",
    noise: Annotated[
        str | None,
        typer.Option(
            help="Standard deviation of the torque noise of each joint [N m or N], comma-separated. Calibration: of "
            "the measurement [m], of poses also [rad].",
            show_default=False,
        ),
    ] = None,
    after: Annotated[
        Path | None,
        typer.Option(
            help=(
                "An identified model.json. The design adds information to it; its extensions count in the torque "
                "limits."
            ),
            show_default=False,
        ),
    ] = None,
    task: Annotated[
        Path | None,
        typer.Option(
            help="A trajectory.csv whose torques the identified model shall predict (criterion i).",
            show_default=False,
        ),
    ] = None,
    payload_only: Annotated[
        bool,
        typer.Option(
            "--payload-only",
            help=(
                "Design the motion that determines a payload: the arm counts as known, the default criterion is d, and "
                "there are no strokes."
            ),
        ),
    ] = False,
    discriminate: Annotated[
        str | None,
        typer.Option(
            help=(
                "Design an experiment that distinguishes two effects, such as stribeck:2,load_dependent_friction:2 "
                "(effect:joint)."
            ),
            show_default=False,
        ),
    ] = None,
    poses: PosesOption = 30,
    measurement: MeasurementOption = "markers:3",
    kinds: KindsOption = "joint_zero,link_placement",
    view_from: ViewFromOption = None,
    view_towards: ViewTowardsOption = None,
    view_cone: ViewConeOption = 30.0,
    facing: FacingOption = None,
    effort: Annotated[str, typer.Option(help="Search effort: quick, standard or thorough.")] = "standard",
    time_limit: Annotated[
        float | None,
        typer.Option(help="Stop the search after this time [s] and keep the best design.", show_default=False),
    ] = None,
    seed: SeedOption = 0,
    workers: WorkersOption = None,
    cluster: ClusterOption = None,
    out: OutOption = Path(),
    tip: TipOption = None,
    joints: JointsOption = None,
    lock: LockOption = None,
    unlimited: UnlimitedOption = False,
    assume_masses: AssumeMassesOption = None,
    png: PngOption = False,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Designs an experiment for a robot: an excitation trajectory, or poses for a calibration.

    Writes trajectory.csv, design.json and report.html; for a calibration also poses.csv.
    """
    console = Console(json=json, quiet=quiet, introduces=True)
    with console.working() as progress:
        from oed.cli.spaces import spaces_from, surroundings_from

        refuse_unsuited(context, for_)
        if for_ == "actuators":
            from oed.cli.commands.actuators import design_for_drives

            summary, data = design_for_drives(
                robot,
                gains,
                lock=lock,
                joints=joints,
                home=numbers("--home", home),
                duration=duration,
                seed=seed,
                out=out,
                force=force,
                progress=progress,
            )
            console.result(f"{summary}\nwritten to {out.resolve()}", data)
            return
        if for_ == "calibration":
            chosen = is_given(context, "criterion") or is_from_file(context, "criterion")
            summary, data = design_calibration(
                robot_from(robot, tip, joints, lock, unlimited=unlimited, assume_masses=assume_masses),
                poses=poses,
                criterion=criterion if chosen else "d",
                measurement=measurement,
                kinds=kinds,
                view_from=view_from,
                view_towards=view_towards,
                view_cone=view_cone,
                facing=facing,
                noise=numbers("--noise", noise),
                home=numbers("--home", home),
                velocity_fraction=velocity_fraction,
                collision=collision,
                clearance=clearance,
                surroundings=surroundings_from(floor, no_floor, keep_out),
                seed=seed,
                out=out,
                png=png,
                force=force,
                progress=progress,
            )
            console.result(f"{summary}\nwritten to {out.resolve()}", data)
            return
        if discriminate is not None:
            from oed.cli.designs.discriminating import design_discriminating, refuse_others

            refuse_others(context)
            summary, data = design_discriminating(
                robot_from(robot, tip, joints, lock, unlimited=unlimited, assume_masses=assume_masses),
                discriminate,
                noise=numbers("--noise", noise),
                friction=friction,
                home=numbers("--home", home),
                velocity_fraction=velocity_fraction,
                collision=collision,
                surroundings=surroundings_from(floor, no_floor, keep_out),
                seed=seed,
                out=out,
                png=png,
                force=force,
                progress=progress,
            )
            console.result(f"{summary}\nwritten to {out.resolve()}", data)
            return
        from estimation.payloads.body import read_body
        from oed.cli.priors import prior_from
        from oed.experiments import LimitOptions, ModelOptions, SearchOptions, TrajectoryOptions, WeightOptions
        from oed.experiments import design as run
        from oed.exports import read_trajectory
        from oed.reports import save_design_report
        from oed.trajectories import family as choose_family
        from robots.common.files import ResultFolder

        if payload_only:
            refuse_beside_payload(context)
            given = {
                name for name in ("criterion", "strokes") if is_given(context, name) or is_from_file(context, name)
            }
            criterion = criterion if "criterion" in given else "d"
            strokes = strokes if "strokes" in given else False
        with (
            executor_from(workers, cluster) as executor,
            ResultFolder(out, force, names=["trajectory.csv", "design.json", "report.html"]) as folder,
        ):
            described = robot_from(robot, tip, joints, lock, unlimited=unlimited, assume_masses=assume_masses)
            prior, effects = prior_from(after, described.n) if after else (None, ())
            result = run(
                described,
                criterion=criterion,
                model=ModelOptions(friction=friction, offset=offset, essential=essential, payload_only=payload_only),
                trajectory=TrajectoryOptions(
                    family=choose_family(family, harmonics=harmonics, base_frequency=base_frequency),
                    periods=periods,
                    strokes=strokes,
                    home=numbers("--home", home),
                ),
                limits=LimitOptions(
                    velocity_fraction=velocity_fraction,
                    torque=torque,
                    torque_margin=torque_margin,
                    collision=collision,
                    clearance=clearance,
                    surroundings=surroundings_from(floor, no_floor, keep_out),
                    space=spaces_from(tool_box, singularity),
                    effects=effects,
                    payload=None if payload is None else read_body(payload).parameters,
                ),
                weights=WeightOptions(
                    scaling=scaling,
                    noise=numbers("--noise", noise),
                    after=prior,
                    task=read_trajectory(task, n=described.n)[0] if task else None,
                ),
                search=SearchOptions(
                    effort=effort,
                    seed=seed,
                    time_limit=float("inf") if time_limit is None else time_limit,
                    keep_on_interrupt=True,
                    workers=workers,
                    executor=executor,
                ),
                progress=progress,
            )
            result.save(folder.path("trajectory.csv").parent)
            save_design_report(result, folder, png=png)
    data = result.to_dict()
    for long in ("segments", "fourier", "excitation"):
        data.pop(long, None)
    console.result(f"{result.summary()}\nwritten to {out.resolve()}", data)
    if result.interrupted:
        print("oed: interrupted; the best design found so far was written", file=sys.stderr)
        raise SystemExit(130)
