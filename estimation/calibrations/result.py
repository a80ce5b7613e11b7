"""Result of a calibration: the errors with their intervals, what is left open, and how well it predicts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from estimation.calibrations.outliers import OutlierPose
from estimation.calibrations.repeatability import Repeatability
from estimation.calibrations.selection import KindTrial
from estimation.calibrations.undetermined import Undetermined
from estimation.models.robot_in_file import build_robot, describe_robot
from robots.common.arrays import Array
from robots.common.records import Finding, Record, Result, axes_for, damage_refused, findings_of, read_json
from robots.geometry_errors.terms import error_term
from robots.geometry_errors.terms.base import shown_unit
from robots.robot import Robot

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


SHOWN = {"m": ("mm", 1e3), "rad": ("mrad", 1e3), "px": ("px", 1.0)}


@dataclass(frozen=True, kw_only=True)
class CalibratedParameter(Record):
    """One error with its interval.

    Attributes:
        name: such as "zero_3".
        kind: of the error; "setup" for the pose of the instrument and the like.
        joint: that it belongs to, from 1; None for none.
        value: in `unit`.
        standard_error: of it.
        lower: of the 95 % interval.
        upper: of the 95 % interval.
        unit: in SI.
    """

    ENTRIES = ("name", "kind", "joint", "value", "standard_error", "ci95=lower,upper", "unit")

    name: str
    kind: str
    joint: int | None
    value: float
    standard_error: float
    lower: float
    upper: float
    unit: str

    @property
    def shown(self) -> tuple[str, float]:
        """Unit for people, and how many of them are one in SI."""
        return shown_unit(self.unit)

    @property
    def text(self) -> str:
        """Value and interval for people."""
        unit, factor = self.shown
        value, lower, upper = (f"{factor * x:.4g}" for x in (self.value, self.lower, self.upper))
        return f"{value} ({lower} to {upper}) {unit}"


@dataclass(frozen=True, kw_only=True)
class ErrorLevels:
    """Root mean square errors of poses, in the measurement's first unit.

    Attributes:
        before: of the description, with the setup fitted.
        after: of the fitted poses.
        held_out: of poses by fits to others.
        inside: of those within the range of the others; NaN if there are none.
        outside: of those outside it; NaN if there are none.
        outside_count: number of them.
    """

    before: float
    after: float
    held_out: float
    inside: float
    outside: float
    outside_count: int


@dataclass(frozen=True, kw_only=True)
class PoseErrors:
    """Errors of each pose, in the measurement's first unit.

    Attributes:
        line: of the file.
        q: joint positions (N, n) [rad or m].
        before: by the description (N,).
        after: by the fit (N,).
        held_out: by a fit to others (N,).
        used: whether the pose counted (N,).
        session: number of each pose's session (N,); None if there is one only.
        shift_before: mean signed error of the points by the description, by axis of the measurement (N, k); None in
            files of earlier versions.
        shift: the same by a fit to others (N, k).
    """

    line: NDArray[np.int64]
    q: Array
    before: Array
    after: Array
    held_out: Array
    used: NDArray[np.bool_]
    session: NDArray[np.int64] | None = None
    shift_before: Array | None = None
    shift: Array | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Calibration(Result, format="robot-oed calibration"):
    """A robot whose geometry was fitted to measured poses.

    Attributes:
        robot: as it was described.
        corrected: with joint zeros and links as fitted.
        measurement: kind of the measurement.
        unit: of the errors: "m", "rad" or "px".
        kinds: of errors that were fitted, because held-out poses support them or because they were asked for.
        parameters: errors, then the setup.
        setup: poses and points of the setup, as plain lists.
        noise: standard deviation by unit.
        levels: errors before and after.
        poses: errors by pose.
        trials: held-out error with and without each kind; empty where the kinds were given.
        undetermined: what the poses leave open, and why.
        outliers: poses that were left out.
        repeatability: spread of repeated poses; None without any.
        check: errors on poses of another file; None without one.
        causes: what the diagnosis found, as plain data.
        warnings: about the use of the result.
        provenance: file, options, tool version.
    """

    FILE = "calibration.json"
    ENTRIES = (
        "robot=described_robot",
        "corrected=described_correction",
        "measurement",
        "unit",
        "kinds",
        "joint_zeros",
        "parameters",
        "setup",
        "noise",
        "levels",
        "poses",
        "trials",
        "undetermined",
        "outliers",
        "repeatability",
        "check",
        "causes",
        "warnings",
        "provenance",
    )

    robot: Robot
    corrected: Robot
    measurement: str
    unit: str
    kinds: tuple[str, ...]
    parameters: tuple[CalibratedParameter, ...]
    setup: Mapping[str, Any]
    noise: Mapping[str, float]
    levels: ErrorLevels
    poses: PoseErrors
    trials: tuple[KindTrial, ...] = ()
    undetermined: tuple[Undetermined, ...] = ()
    outliers: tuple[OutlierPose, ...] = ()
    repeatability: Repeatability | None = None
    check: ErrorLevels | None = None
    causes: Mapping[str, Any] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    provenance: Mapping[str, Any] = field(default_factory=dict)

    def __repr__(self) -> str:
        unit, factor = SHOWN[self.unit]
        before, after = factor * self.levels.before, factor * self.levels.held_out
        return f"Calibration({self.robot.name!r}, {before:.3g} -> {after:.3g} {unit} on held-out poses)"

    @property
    def success(self) -> bool:
        """Whether the calibrated robot predicts held-out poses better than the description, without doubts."""
        return not self.warnings and self.levels.held_out < self.levels.before

    @property
    def errors(self) -> tuple[CalibratedParameter, ...]:
        """The errors of the robot, without the setup."""
        return tuple(item for item in self.parameters if item.kind != "setup")

    @property
    def joint_zeros(self) -> dict[str, float]:
        """What to add to the reading of each encoder, by the joint's name [rad or m]; 0 where none was fitted."""
        found = {item.joint: item.value for item in self.parameters if item.kind == "joint_zero"}
        return {name: found.get(i + 1, 0.0) for i, name in enumerate(self.robot.joint_names)}

    @property
    def described_robot(self) -> dict[str, Any]:
        """The robot as it was described, as plain data."""
        return describe_robot(self.robot)

    @property
    def described_correction(self) -> dict[str, Any]:
        """The corrected robot, as plain data."""
        return describe_robot(self.corrected)

    def shown(self, value: float) -> str:
        """Writes an error for people.

        Args:
            value: in `unit`.
        """
        unit, factor = SHOWN[self.unit]
        return f"{factor * value:.3g} {unit}"

    @property
    def conclusion(self) -> str:
        """How well the calibrated robot predicts poses that it has not seen."""
        levels = self.levels
        if not levels.held_out < levels.before:
            return "The poses do not support a calibration: the description predicts held-out poses as well."
        return (
            f"The calibrated robot predicts poses that it has not seen to {self.shown(levels.held_out)} instead of "
            f"{self.shown(levels.before)}."
        )

    @property
    def remarks(self) -> tuple[Finding, ...]:
        """Doubts, causes, and poses that were left out."""
        found = list(findings_of("calibration.doubtful", self.warnings))
        found += [
            Finding(code="calibration.cause", text=cause["sentence"], action=cause.get("action", ""))
            for cause in self.causes.get("findings", ())
        ]
        found += [
            Finding(
                code="calibration.outlier",
                subject=f"Pose {item.pose}:",
                text=f"line {item.line} of the file is off by {self.shown(item.error)}; it was left out.",
                action="Measure it again, or remove it.",
            )
            for item in self.outliers
        ]
        return tuple(found)

    def summary(self) -> str:
        """Lists errors before and after, what was fitted, and what is left open."""
        levels, rows = self.levels, len(self.poses.line)
        lines = [
            f"{self.robot.name}: error of held-out poses {self.shown(levels.before)} -> {self.shown(levels.held_out)} "
            f"({rows} poses, {error_words(self.measurement)})"
        ]
        if np.isfinite(levels.outside):
            lines.append(
                f"  within the range of the other poses {self.shown(levels.inside)}, outside it "
                f"{self.shown(levels.outside)} ({levels.outside_count} poses)"
                if np.isfinite(levels.inside)
                else "  each pose lies outside the range of the others"
            )
        noise = ", ".join(f"{SHOWN[u][1] * value:.3g} {SHOWN[u][0]}" for u, value in self.noise.items())
        lines.append(f"  what remains, standard deviation per measured number: {noise}")
        if self.repeatability is not None:
            floor = self.repeatability
            lines.append(
                f"  repeated poses lie {self.shown(floor.error)} apart ({floor.visits} visits of {floor.poses})"
            )
        if self.check is not None:
            lines.append(
                f"  other file: {self.shown(self.check.before)} -> {self.shown(self.check.held_out)}"
                + _ranges(self, self.check)
            )
        words = ", ".join(error_term(kind).title for kind in self.kinds) or "nothing but the setup"
        lines.append(f"  fitted: {words}")
        for trial in self.trials:
            state = "supported" if trial.added else "not supported"
            change = f"{self.shown(trial.without)} -> {self.shown(trial.with_it)}"
            lines.append(f"    {error_term(trial.kind).title:28} held-out {change:24} {state}")
        lines.append("  largest errors, 95 % intervals:")
        ranked = sorted(self.errors, key=lambda item: -abs(item.value) / max(item.standard_error, 1e-300))
        lines += [f"    {item.name:22} {item.text}" for item in ranked[:12]]
        if len(ranked) > 12:
            lines.append(f"    and {len(ranked) - 12} more in {self.FILE}")
        optics = [item for item in self.parameters if item.kind == "setup" and item.unit not in ("m", "rad")]
        lines += [f"    {item.name:22} {item.text}" for item in optics]
        for cause in self.causes.get("findings", ()):
            lines.append(f"  cause: {cause['sentence']}")
        lines += [f"  outlier: pose {o.pose} (line {o.line}) is off by {self.shown(o.error)}" for o in self.outliers]
        open_ = [item for item in self.undetermined if item.reason == "poses"]
        lines += [f"  not determined: {item.sentence()}" for item in open_[:6]]
        if len(open_) > 6:
            lines.append(f"  not determined: {len(open_) - 6} more in {self.FILE}")
        if self.provenance.get("not_read"):
            lines.append(f"  columns that were not read: {', '.join(self.provenance['not_read'])}")
        lines += [f"  {warning}" for warning in self.warnings]
        return "\n".join(lines)

    def to_frame(self) -> pd.DataFrame:
        """Gives a row per parameter: kind, joint, value, standard_error, lower, upper, unit (SI)."""
        import pandas as pd

        names = ("kind", "joint", "value", "standard_error", "lower", "upper", "unit")
        rows = [[getattr(item, name) for name in names] for item in self.parameters]
        index = pd.Index([item.name for item in self.parameters], name="parameter")
        return pd.DataFrame(rows, columns=list(names), index=index)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws the error of each pose before and after, held out.

        Args:
            ax: where to draw; a new figure by default.
        """
        unit, factor = SHOWN[self.unit]
        axes = axes_for(ax, (7, 4))
        place = np.arange(1, len(self.poses.line) + 1)
        for values, label in ((self.poses.before, "description"), (self.poses.held_out, "calibrated, held out")):
            axes.plot(place, factor * values, "o", markersize=4, label=label)
        axes.set_xlabel("pose")
        axes.set_ylabel(f"error [{unit}]")
        axes.legend()
        return axes


def load_calibration(path: str | Path) -> Calibration:
    """Reads a `calibration.json`, or the one in a folder.

    Args:
        path: the file, or its folder.

    Returns:
        The calibration; its robots know geometry and limits.

    Raises:
        InputError: a missing file, or one that is no calibration.
    """
    file, remedy = Path(path), f"give a {Calibration.FILE} of oed calibrate"
    file = file / Calibration.FILE if file.is_dir() else file
    data = read_json(file, Calibration.FORMAT, Calibration.FORMAT_VERSION, remedy=remedy)
    with damage_refused(file, remedy=remedy):
        robot, corrected = build_robot(data["robot"]), build_robot(data["corrected"])
    return Calibration.from_dict(data, file=file, remedy=remedy, robot=robot, corrected=corrected)


def error_words(kind: str) -> str:
    """What the error of a pose is, by the kind of measurement."""
    return {
        "markers": "RMS distance of the markers",
        "poses": "RMS distance of the positions",
        "distances": "RMS error of the distances",
        "planes": "RMS distance from the planes",
        "points": "RMS distance from the points",
        "held_part": "RMS gap between the arms",
        "camera": "RMS reprojection error",
        "inclinometer": "RMS tilt",
    }[kind]


def _ranges(result: Calibration, levels: ErrorLevels) -> str:
    if not np.isfinite(levels.outside):
        return ""
    return f" ({result.shown(levels.inside)} within the fitted range, {result.shown(levels.outside)} outside it)"
