"""A retimed experiment: its motion, and what the new timing did to its criterion, its torques and its duration."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from oed.criteria import CRITERIA
from oed.experiments.quality import Quality, design_model, excitation_findings
from oed.experiments.results.design_file import DESIGN, TRAJECTORY
from oed.experiments.results.planned import OF_ROBOT, Planned
from oed.experiments.results.views import motion_frame, plot_velocities
from oed.experiments.safety_checks.freedom import collides, freedom_findings, freedom_text, is_free
from oed.experiments.safety_checks.margins import assumption_findings, measured_margins
from oed.exports import read_trajectory, write_trajectory
from oed.retiming import Retimed
from robots.base_parameters import BaseParameters, find_base_parameters
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.plain import number
from robots.common.records import Finding, Record, damage_refused, findings_of, read_json
from robots.limits import Margin
from robots.loading import load_robot
from robots.robot import Robot
from robots.signals import Motion
from robots.version import VERSION

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


@dataclass(frozen=True, kw_only=True, eq=False)
class TorqueUse(Record):
    """Motor torques of a timing, by the nominal model with friction.

    Attributes:
        peak: largest magnitude of each joint, (n,) [N m, or N of a prismatic joint].
        rms: root of the mean square over the motion, (n,).
    """

    peak: Array
    rms: Array


@dataclass(frozen=True, kw_only=True)
class RetimedExperiment(Planned, format="robot-oed design", tool=True, shares=("limits=robot.limits",)):
    """A path with a new timing, and the information of both timings on the parameters.

    Attributes:
        robot: what it is for.
        base: the parameters.
        criterion: the name of the criterion that is compared.
        before: the quality of the given timing.
        after: the quality of the new one.
        retimed: the new motion, and how much of each limit it uses.
        torque_before: of the given timing; None where the robot's dynamics are not described.
        torque_after: of the new one.
        margins: of the new motion to each limit.
        settings: of the model.
        freedom: of collisions, as `collision_data` writes it; None where they were not checked.
    """

    ENTRIES = (
        *OF_ROBOT,
        "assumed",
        "model.columns=base.names",
        "model.units=base.units",
        "model.stands_for=base.formulas",
        "model.scaling=scaling",
        "criterion",
        "criterion_label",
        "quality=before,after",
        "retiming.method=retimed.method",
        "retiming.duration_before=retimed.duration_before",
        "retiming.duration_after=retimed.duration_after",
        "retiming.path_deviation=retimed.deviation",
        "retiming.stops=retimed.stops",
        "retiming.waypoints=retimed.waypoints",
        "retiming.verdict=retimed.verdict",
        "retiming.given_keeps_limits=retimed.given_keeps_limits",
        "retiming.usage=retimed.usage",
        "retiming.usage_before=retimed.usage_before",
        "retiming.torque_before=torque_before",
        "retiming.torque_after=torque_after",
        "settings",
        "collision=freedom",
        "segments",
        "duration=motion.duration",
        "period=robot.period",
        "smallest_margins=margins",
    )

    robot: Robot
    base: BaseParameters
    criterion: str
    before: Quality
    after: Quality
    retimed: Retimed
    torque_before: TorqueUse | None
    torque_after: TorqueUse | None
    margins: tuple[Margin, ...]
    settings: Mapping[str, Any]
    freedom: Mapping[str, Any] | None = None

    scaling = "none"

    @property
    def criterion_label(self) -> str:
        """The criterion's name for people."""
        return CRITERIA[self.criterion]().label

    @property
    def segments(self) -> list[dict[str, Any]]:
        """The only segment, as in a design file."""
        return [{"kind": "move", "start": 0.0, "end": self.motion.duration, "joint": None}]

    @property
    def motion(self) -> Motion:
        """The new motion."""
        return self.retimed.motion

    @property
    def success(self) -> bool:
        """Whether all limits hold, and no collision was found."""
        return not any(margin.violated for margin in self.margins) and not collides(self.freedom)

    @property
    def conclusion(self) -> str:
        """Whether to play the motion, and how fast it is."""
        retimed = self.retimed
        name, joint, share = retimed.peak
        unsafe = not self.success or not is_free(self.freedom)
        return (
            f"{'Do not play this motion. ' if unsafe else ''}{retimed.method} runs the path in "
            f"{retimed.duration_after:.1f} s instead of {retimed.duration_before:.1f} s, using {100 * share:.1f} % of "
            f"the {name} limit of joint {joint}. {freedom_text(self.freedom)}"
        )

    @property
    def remarks(self) -> tuple[Finding, ...]:
        """What is not determined, limits that are exceeded, and what was assumed or not checked."""
        text, action = "The new timing exceeds a limit.", "Do not play it."
        return (
            *excitation_findings(self.after),
            *(() if self.success else (Finding(code="limit.exceeded", text=text, action=action),)),
            *findings_of("timing.slower", [self.retimed.verdict()] if self.retimed.slower else []),
            *freedom_findings(self.freedom),
            *assumption_findings(self.robot),
        )

    def summary(self) -> str:
        """Compares the experiment before and after retiming."""
        before, after = (_value(quality, self.criterion) for quality in (self.before, self.after))
        lines = [self.retimed.summary(), f"  {self.criterion_label}: {before} before, {after} after"]
        if self.torque_before is not None and self.torque_after is not None:
            for name in ("peak", "rms"):
                values = (_list(getattr(use, name)) for use in (self.torque_before, self.torque_after))
                lines.append("  {} torque per joint: {} before, {} after".format(name.replace("rms", "RMS"), *values))
        lines.append(f"  {freedom_text(self.freedom)}")
        for margin in self.margins:
            if margin.violated:
                lines.append(
                    f"  LIMIT EXCEEDED: {margin.quantity} of joint {margin.joint}: {margin.value:.4g} of "
                    f"{margin.limit:.4g} "
                    f"at {margin.time:.3f} s"
                )
        return "\n".join(lines)

    def check(self) -> tuple[Margin, ...]:
        """Computes all margins from the samples of the motion."""
        return measured_margins(self.robot, self.motion, self.base)

    def to_frame(self) -> pd.DataFrame:
        """Gives the new motion as a table: t, q1.., dq1.., ddq1.."""
        return motion_frame(self.motion)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws the new joint velocities as shares of their limits over time.

        Args:
            ax: where to draw; a new figure by default.
        """
        return plot_velocities(self.motion, self.robot.limits, ax)

    def _save_beside(self, folder: Path, *, force: bool) -> None:
        """Writes `trajectory.csv`."""
        metadata = {
            "robot": self.robot.origin or self.robot.name,
            "period": self.robot.period,
            "collisions": freedom_text(self.freedom),
            "tool": f"robot-oed {VERSION}",
        }
        write_trajectory(folder / TRAJECTORY, self.motion, metadata, kinds=self.robot.chain.kinds, force=force)

    @classmethod
    def load(cls, folder: str | Path, robot: Robot | None = None) -> RetimedExperiment:
        """Reads what `save` wrote.

        Args:
            folder: where it is.
            robot: the robot; by default the one that the file names.

        Raises:
            InputError: a missing or damaged file, or another robot than the experiment's.
        """
        file, remedy = Path(folder) / DESIGN, "give the folder written by `oed retime`"
        data = read_json(file, cls.FORMAT, cls.FORMAT_VERSION, remedy=remedy)
        with damage_refused(file, remedy=remedy):
            known = robot or load_robot(data["robot"]["origin"], unlimited=True)
            base = find_base_parameters(design_model(known, data["settings"]))
            if list(base.names) != data["model"]["columns"]:
                raise InputError(f"the experiment is for {data['robot']['name']}, not for {known.name}", file=file)
            retiming = data["retiming"]
            usage = _usage(retiming["usage"])
            if usage is None:
                raise KeyError("usage")
            retimed = Retimed(
                motion=read_trajectory(Path(folder) / TRAJECTORY)[0],
                method=retiming["method"],
                duration_before=retiming["duration_before"],
                duration_after=retiming["duration_after"],
                usage=usage,
                usage_before=_usage(retiming["usage_before"]),
                deviation=retiming["path_deviation"],
                stops=retiming["stops"],
                waypoints=retiming.get("waypoints", False),
            )
            return cls.from_dict(data, file=file, robot=known, base=base, retimed=retimed)


def torque_use(base: BaseParameters, motion: Motion) -> TorqueUse | None:
    """Measures the torques of a motion by the nominal model; None where that is not described."""
    if not base.model.described:
        return None
    tau = base.model.torque(motion.q, motion.dq, motion.ddq, base.model.nominal)
    return TorqueUse(peak=np.abs(tau).max(axis=0), rms=np.sqrt(np.square(tau).mean(axis=0)))


def _value(quality: Quality, criterion: str) -> str:
    return f"{quality.value(criterion):.4g}" if quality.full else "not all parameters excited"


def _list(values: Array) -> str:
    return " ".join(f"{value:.4g}" for value in values)


def _usage(data: Mapping[str, Any] | None) -> dict[str, Array] | None:
    if data is None:
        return None
    return {name: np.array([number(v, np.inf) for v in values]) for name, values in data.items()}
