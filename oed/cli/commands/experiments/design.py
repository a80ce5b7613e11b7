"""Designs an experiment for a robot: an excitation trajectory, or poses for a calibration.

Writes trajectory.csv, design.json and report.html; for a calibration also poses.csv.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from oed.campaigns.discrimination_options import DiscriminationOptions
from oed.cli.options.models import model_for
from oed.cli.options.motions import Excitation, Obstacles, tool_limits
from oed.cli.options.results import Folder
from oed.cli.options.robots import Drives, PlannedRobot
from oed.cli.options.work import Processes
from oed.cli.verbs import Printed, Verb
from oed.experiments.drive_options import DriveDesignOptions
from oed.experiments.options import LimitOptions, ModelOptions, SearchOptions, TrajectoryOptions, WeightOptions
from oed.experiments.pose_options import PoseOptions
from robots.common.errors import InputError
from robots.common.options import Option, box
from robots.common.progress import Progress

if TYPE_CHECKING:
    from concurrent.futures import Executor

TRAJECTORY = ("dynamics", "payload")


@dataclass(frozen=True, kw_only=True)
class Design(Verb):
    """``oed design``.

    Attributes:
        for_: what the experiment is for: dynamics (a trajectory), calibration (poses), or actuators (commands for
            drives without torque).
        gains: a YAML file with the control law and its gains. Default: the MJCF's actuators.
        criterion: design criterion: cond (condition number), d (log determinant), a (trace of the inverse), e (smallest
            singular value), i (prediction variance, needs --task), or cond-d (cond and d). Calibration: also an
            observability index, o1 to o5. Default: cond; d for a calibration or a payload.
        payload: payload on the flange: a payload.json, or KG,X,Y,Z: mass [kg] and centre of mass in the flange frame
            [m]. The torque limits count it.
        tool_box: box for the flange in the base frame: xmin,xmax,ymin,ymax,zmin,zmax [m]; inf means no bound.
        singularity: lower bound for the smallest singular value of the flange's scaled Jacobian.
        after: an identified model.json. The design adds information to it; its extensions count in the torque limits.
        task: a trajectory.csv whose torques the identified model shall predict (criterion i).
        discriminate: design an experiment that distinguishes two effects, such as
            stribeck:2,load_dependent_friction:2 (effect:joint).
        poses: number of poses.
    """

    function = "oed.design"
    examples = (
        "oed design --robot er3a --out experiment",
        "oed design --robot arm.urdf --tip tool0 --criterion d --velocity-fraction 0.7 --out experiment",
        "oed design --robot er3a --for calibration --poses 30 --out poses",
    )
    introduces = True
    uses: ClassVar = {"calibration": "with --for calibration", "actuators": "with --for actuators"}
    robot: PlannedRobot
    for_: str = "dynamics"
    gains: Annotated[Path | None, Option(only=("actuators",))] = None
    criterion: Annotated[str | None, Option(choices="oed.criteria:CRITERIA", only=(*TRAJECTORY, "calibration"))] = None
    model: Annotated[ModelOptions, Option(only=TRAJECTORY)] = ModelOptions()
    excitation: Annotated[Excitation, Option(only=TRAJECTORY)] = Excitation()
    trajectory: Annotated[TrajectoryOptions, Option(only=TRAJECTORY)]
    limits: Annotated[LimitOptions, Option(only=TRAJECTORY)]
    payload: Annotated[str | None, Option(only=TRAJECTORY, section="Input", names_file=True)] = None
    obstacles: Annotated[Obstacles, Option(only=(*TRAJECTORY, "discriminate", "calibration"))] = Obstacles()
    tool_box: Annotated[tuple[float, ...] | None, Option(reads=box, only=TRAJECTORY)] = None
    singularity: Annotated[float | None, Option(only=TRAJECTORY)] = None
    weights: Annotated[WeightOptions, Option(only=TRAJECTORY)] = WeightOptions()
    after: Annotated[Path | None, Option(only=("dynamics",))] = None
    task: Annotated[Path | None, Option(only=("dynamics",))] = None
    discriminate: Annotated[
        str | None, Option(choices="robots.terms.effects:EFFECTS", only=("dynamics", "discriminate"))
    ] = None
    search: Annotated[SearchOptions, Option(only=TRAJECTORY)]
    rivals: Annotated[DiscriminationOptions, Option(only=("discriminate",))]
    poses: Annotated[int, Option(least=1, only=("calibration",))] = 30
    measured: Annotated[PoseOptions, Option(only=("calibration",))]
    commands: Annotated[DriveDesignOptions, Option(only=("actuators",))] = DriveDesignOptions()
    work: Annotated[Processes, Option(only=TRAJECTORY)] = Processes()
    output: Folder = Folder()

    @property
    def use(self) -> str:
        """What the experiment is for; of dynamics, also a payload's alone, or the difference of two effects."""
        if self.for_ not in ("dynamics", "calibration", "actuators"):
            raise InputError(f"--for {self.for_}", allowed="dynamics, calibration, actuators")
        if self.for_ != "dynamics":
            return self.for_
        return "payload" if self.model.payload_only else "discriminate" if self.discriminate is not None else "dynamics"

    def unused(self) -> Collection[str]:
        """Names what does not apply; to a payload, the criterion and strokes that a file gives for the arm."""
        foreign = {*super().unused()}
        if self.use == "payload":
            foreign |= {"offset", "essential"}
        if self.use == "actuators":
            foreign |= {"tip", "unlimited", "assume_masses"}
        arm = {"criterion", "strokes"} if "payload_only" in self.typed else set()
        return foreign | (arm - self.typed)

    def reason(self, names: Collection[str]) -> tuple[str, str]:
        """Names the use."""
        if self.use == "discriminate":
            why = "--discriminate, which maximises the probability of the right decision"
            return why, "remove these options, or remove --discriminate"
        if self.use == "payload":
            return "--payload-only, which counts the arm as known", "remove these options, or remove --payload-only"
        other = "dynamics" if self.use != "dynamics" else self.owner(names)
        return f"--for {self.use}", f"remove them, or use --for {other}"

    def run(self, progress: Progress) -> Printed:
        """Designs the experiment."""
        usual = ("trajectory.csv", "design.json", "report.html")
        design, names, long = {
            "actuators": (self._commands, ("commands.csv", *usual[1:]), ()),
            "calibration": (self._poses, ("poses.csv", *usual), ("segments", "eigenvalues", "random_eigenvalues")),
            "discriminate": (self._rivals, usual, ("segments", "quality")),
        }.get(self.use, (self._trajectory, usual, ("segments", "fourier", "excitation")))
        with self.work.executor() as executor, self.output.opened(*names) as folder:
            result = design(executor, progress)
            self.output.save(folder, result)
        printed = self.output.printed(result, without=long)
        if getattr(result, "interrupted", False):
            note = "oed: interrupted; the best design found so far was written"
            return replace(printed, note=note, code=130)
        return printed

    def _trajectory(self, executor: Executor | None, progress: Progress) -> Any:
        """Designs an excitation trajectory."""
        from estimation.payloads.body import read_body
        from oed import design
        from oed.campaigns.loops.priors import prior_from
        from oed.exports import read_trajectory

        robot, alone = self.robot.load(), self.model.payload_only
        prior, effects = (None, ()) if self.after is None else prior_from(model_for(self.after, robot.n))
        strokes = self.trajectory.strokes and not (alone and "strokes" not in self.given)
        return design(
            robot,
            criterion=self.criterion or ("d" if alone else "cond"),
            model=self.model,
            trajectory=replace(self.trajectory, family=self.excitation.chosen(), strokes=strokes),
            limits=replace(
                self.limits,
                surroundings=self.obstacles.surroundings(),
                space=tool_limits(self.tool_box, self.singularity),
                effects=effects,
                payload=None if self.payload is None else read_body(self.payload).parameters,
            ),
            weights=replace(
                self.weights, after=prior, task=read_trajectory(self.task, n=robot.n)[0] if self.task else None
            ),
            search=replace(self.search, keep_on_interrupt=True, workers=self.work.workers, executor=executor),
            progress=progress,
        )

    def _poses(self, executor: Executor | None, progress: Progress) -> Any:
        """Designs poses to measure."""
        from oed import design_poses

        options = replace(self.measured, surroundings=self.obstacles.surroundings())
        robot, criterion = self.robot.load(), self.criterion or "d"
        return design_poses(robot, count=self.poses, criterion=criterion, options=options, progress=progress)

    def _commands(self, executor: Executor | None, progress: Progress) -> Any:
        """Designs commands for drives without torque."""
        from oed.experiments.drives import design_drive_motion

        named = self.robot.chain
        drives = Drives(robot=self.robot.robot, gains=self.gains, joints=named.joints, lock=named.lock)
        chains, known = drives.load()
        return design_drive_motion(chains, known.drives, options=self.commands, progress=progress)

    def _rivals(self, executor: Executor | None, progress: Progress) -> Any:
        """Designs an experiment that distinguishes two effects."""
        from oed import discriminate

        options = replace(self.rivals, surroundings=self.obstacles.surroundings())
        return discriminate(self.robot.load(), self.discriminate or "", options=options, progress=progress)
