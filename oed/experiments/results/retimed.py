"""A retimed experiment: its motion, and what the new timing did to its criterion, its torques and its duration."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from oed.criteria import CRITERIA
from oed.experiments.quality import Quality, design_model
from oed.experiments.results.design_file import DESIGN, TRAJECTORY
from oed.experiments.results.views import motion_frame, plot_velocities
from oed.experiments.safety_checks.freedom import collides, freedom_text
from oed.experiments.safety_checks.margins import assumed_values, margin_data, margin_from, measured_margins
from oed.exports import read_trajectory, write_trajectory
from oed.retiming import Retimed
from robots.base_parameters import BaseParameters, find_base_parameters
from robots.common.errors import InputError
from robots.common.files import existing_file, write_atomic
from robots.common.plain import all_finite, number
from robots.limits import Margin
from robots.loading import load_robot
from robots.robot import Robot
from robots.signals import Motion
from robots.version import VERSION

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class TorqueUse:
    """Motor torques of a timing, by the nominal model with friction.

    Attributes:
        peak: largest magnitude of each joint, (n,) [N m, or N of a prismatic joint].
        rms: root of the mean square over the motion, (n,).
    """

    peak: Array
    rms: Array

    def to_dict(self) -> dict[str, Any]:
        """Writes both as plain lists."""
        return {"peak": self.peak.tolist(), "rms": self.rms.tolist()}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any] | None) -> TorqueUse | None:
        """Reads what `to_dict` wrote; null is None."""
        return None if data is None else cls(peak=np.array(data["peak"]), rms=np.array(data["rms"]))


@dataclass(frozen=True, kw_only=True)
class RetimedExperiment:
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

    @property
    def motion(self) -> Motion:
        """The new motion."""
        return self.retimed.motion

    @property
    def success(self) -> bool:
        """Whether all limits hold, and no collision was found."""
        return not any(margin.violated for margin in self.margins) and not collides(self.freedom)

    def summary(self) -> str:
        """Compares the experiment before and after retiming."""
        label = CRITERIA[self.criterion]().label
        before, after = (_value(quality, self.criterion) for quality in (self.before, self.after))
        lines = [self.retimed.summary(), f"  {label}: {before} before, {after} after"]
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

    def to_dict(self) -> dict[str, Any]:
        """Writes everything but the samples as plain data for `design.json`."""
        return {
            "format": "robot-oed design",
            "format_version": 1,
            "tool_version": VERSION,
            "robot": {"name": self.robot.name, "origin": self.robot.origin, "sha256": self.robot.digest},
            "assumed": assumed_values(self.robot),
            "model": {
                "columns": list(self.base.names),
                "units": [column.unit for column in self.base.columns],
                "stands_for": list(self.base.formulas()),
                "scaling": "none",
            },
            "criterion": self.criterion,
            "criterion_label": CRITERIA[self.criterion]().label,
            "quality": [self.before.to_dict(), self.after.to_dict()],
            "retiming": {
                "method": self.retimed.method,
                "duration_before": self.retimed.duration_before,
                "duration_after": self.retimed.duration_after,
                "path_deviation": self.retimed.deviation,
                "stops": self.retimed.stops,
                "waypoints": self.retimed.waypoints,
                "verdict": self.retimed.verdict(),
                "given_keeps_limits": self.retimed.given_keeps_limits,
                "usage": _usage_data(self.retimed.usage),
                "usage_before": _usage_data(self.retimed.usage_before),
                "torque_before": None if self.torque_before is None else self.torque_before.to_dict(),
                "torque_after": None if self.torque_after is None else self.torque_after.to_dict(),
            },
            "settings": dict(self.settings),
            "collision": None if self.freedom is None else dict(self.freedom),
            "segments": [{"kind": "move", "start": 0.0, "end": self.motion.duration, "joint": None}],
            "duration": self.motion.duration,
            "period": self.robot.period,
            "smallest_margins": [margin_data(margin, self.robot.limits) for margin in self.margins],
        }

    def save(self, folder: str | Path, *, force: bool = False) -> None:
        """Writes `trajectory.csv` and `design.json` into a folder that is there.

        Args:
            folder: an existing one.
            force: replace files that are there.

        Raises:
            InputError: a file is there, and force is not given.
        """
        metadata = {
            "robot": self.robot.origin or self.robot.name,
            "period": self.robot.period,
            "collisions": freedom_text(self.freedom),
            "tool": f"robot-oed {VERSION}",
        }
        write_trajectory(Path(folder) / TRAJECTORY, self.motion, metadata, kinds=self.robot.chain.kinds, force=force)
        write_atomic(Path(folder) / DESIGN, json.dumps(self.to_dict(), indent=2, allow_nan=False) + "\n", force=force)

    @classmethod
    def load(cls, folder: str | Path, robot: Robot | None = None) -> RetimedExperiment:
        """Reads what `save` wrote.

        Args:
            folder: where it is.
            robot: the robot; by default the one that the file names.

        Raises:
            InputError: a missing or damaged file, or another robot than the experiment's.
        """
        file = Path(folder) / DESIGN
        try:
            data = json.loads(existing_file(file).read_text(encoding="utf-8"))
            known = robot or load_robot(data["robot"]["origin"], unlimited=True)
            base = find_base_parameters(design_model(known, data["settings"]))
            if list(base.names) != data["model"]["columns"]:
                raise InputError(f"the experiment is for {data['robot']['name']}, not for {known.name}", file=file)
            before, after = (
                Quality(part=q["part"], samples=q["samples"], singular_values=tuple(q["singular_values_Y"]))
                for q in data["quality"]
            )
            retiming = data["retiming"]
            usage = _usage(retiming["usage"])
            if usage is None:
                raise KeyError("usage")
            return cls(
                robot=known,
                base=base,
                criterion=data["criterion"],
                before=before,
                after=after,
                retimed=Retimed(
                    motion=read_trajectory(Path(folder) / TRAJECTORY)[0],
                    method=retiming["method"],
                    duration_before=retiming["duration_before"],
                    duration_after=retiming["duration_after"],
                    usage=usage,
                    usage_before=_usage(retiming["usage_before"]),
                    deviation=retiming["path_deviation"],
                    stops=retiming["stops"],
                    waypoints=retiming.get("waypoints", False),
                ),
                torque_before=TorqueUse.from_dict(retiming["torque_before"]),
                torque_after=TorqueUse.from_dict(retiming["torque_after"]),
                margins=tuple(margin_from(margin) for margin in data["smallest_margins"]),
                settings=data["settings"],
                freedom=data["collision"],
            )
        except (OSError, UnicodeDecodeError, json.JSONDecodeError, KeyError, TypeError, ValueError) as error:
            raise InputError(
                f"is not a file of a retimed experiment, or is damaged ({type(error).__name__}: {error})", file=file
            ) from error


def torque_use(base: BaseParameters, motion: Motion) -> TorqueUse | None:
    """Measures the torques of a motion by the nominal model; None where that is not described."""
    if not base.model.described:
        return None
    tau = base.model.torque(motion.q, motion.dq, motion.ddq, base.model.nominal)
    return TorqueUse(peak=np.abs(tau).max(axis=0), rms=np.sqrt(np.square(tau).mean(axis=0)))


def _value(quality: Quality, criterion: str) -> str:
    known: Mapping[str, Any] = quality.to_dict()
    return f"{quality.value(criterion):.4g}" if known["cond_Y"] is not None else "not all parameters excited"


def _list(values: Array) -> str:
    return " ".join(f"{value:.4g}" for value in values)


def _usage_data(usage: Mapping[str, Array] | None) -> dict[str, Any] | None:
    """Plain lists; infinite use, of a limit of zero, is null."""
    if usage is None:
        return None
    return {name: all_finite(values) for name, values in usage.items()}


def _usage(data: Mapping[str, Any] | None) -> dict[str, Array] | None:
    if data is None:
        return None
    return {name: np.array([number(v, np.inf) for v in values]) for name, values in data.items()}
