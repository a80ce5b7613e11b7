"""A design of poses: the poses in order, the motion, and what to expect of the calibration."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from oed.experiments.pose_designs.observability import observability_indices
from oed.experiments.results.planned import OF_ROBOT, Planned
from oed.experiments.safety_checks.freedom import freedom_text, is_free
from oed.exports import write_trajectory
from robots.common.arrays import Array
from robots.common.records import Finding, axes_for, findings_of, read, read_json
from robots.common.tables.table_files import write_table
from robots.geometry_errors.terms import ErrorParameter
from robots.robot import Robot
from robots.signals import Motion
from robots.version import VERSION

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


DESIGN, POSES, TRAJECTORY = "design.json", "poses.csv", "trajectory.csv"
SHOWN = {"m": ("mm", 1e3), "rad": ("mrad", 1e3), "px": ("px", 1.0)}


@dataclass(frozen=True, kw_only=True, eq=False)
class PoseDesign(Planned, format="robot-oed pose design", tool=True):
    """Poses for a calibration.

    Attributes:
        robot: what they are for.
        criterion: what was optimised.
        q: poses in the order of the moves (N, n) [rad or m].
        home: pose at both ends (n,).
        motion: all moves, with a rest at each pose, at the controller's period.
        segments: kind, start [s] and end [s] of each part; those of kind "pose" are the rests.
        parameters: that the poses determine.
        eigenvalues: of the scaled information, ascending (L,).
        random_eigenvalues: of as many random poses, to compare with (L,).
        exchanged_eigenvalues: of the poses before they were refined (L,); None in files of earlier versions.
        expected: standard errors of the parameters (L,), in SI units.
        prediction: expected error of predicted measurements elsewhere, in `unit`.
        unit: of the measurement.
        left_out: poses of the design that no free move reaches.
        freedom: of collisions, as `collision_data` writes it; None where they were not checked.
        settings: everything that makes the same design again.
    """

    ENTRIES = (
        *OF_ROBOT,
        "criterion",
        "poses=q",
        "home",
        "observability",
        "random_observability",
        "eigenvalues",
        "random_eigenvalues",
        "exchanged_eigenvalues",
        "parameters=stated_parameters",
        "prediction",
        "unit",
        "left_out",
        "duration=motion.duration",
        "segments",
        "collision=freedom",
        "settings",
    )

    robot: Robot
    criterion: str
    q: Array
    home: Array
    motion: Motion
    segments: tuple[Mapping[str, Any], ...]
    parameters: tuple[ErrorParameter, ...]
    eigenvalues: Array
    random_eigenvalues: Array
    expected: Array
    prediction: float
    unit: str
    left_out: int
    freedom: Mapping[str, Any] | None
    settings: Mapping[str, Any]
    exchanged_eigenvalues: Array | None = None

    def __repr__(self) -> str:
        return f"PoseDesign({self.robot.name!r}, {len(self.q)} poses, O1 {self.observability['O1']:.3g})"

    @property
    def observability(self) -> dict[str, float]:
        """The indices O1 to O5."""
        return observability_indices(self.eigenvalues, len(self.q))

    @property
    def random_observability(self) -> dict[str, float]:
        """The indices of as many random poses."""
        return observability_indices(self.random_eigenvalues, len(self.q))

    @property
    def compared(self) -> dict[str, dict[str, float]]:
        """The indices of the poses, of those before the refinement, and of random ones, by what they are of."""
        sets = {
            "designed": self.eigenvalues,
            "by exchange alone": self.exchanged_eigenvalues,
            "random": self.random_eigenvalues,
        }
        return {name: observability_indices(values, len(self.q)) for name, values in sets.items() if values is not None}

    @property
    def stated_parameters(self) -> list[dict[str, Any]]:
        """The parameters with the standard errors to expect."""
        return [
            {
                "name": item.name,
                "kind": item.kind,
                "joint": item.joint,
                "unit": item.unit,
                "scale": item.scale,
                "expected_standard_error": error,
            }
            for item, error in zip(self.parameters, self.expected, strict=True)
        ]

    @property
    def success(self) -> bool:
        """Whether all poses are reached and the moves are proved free of collisions."""
        return self.left_out == 0 and (self.freedom is None or is_free(self.freedom))

    @property
    def conclusion(self) -> str:
        """How well the calibrated robot is expected to predict."""
        unit, factor = SHOWN[self.unit]
        return (
            f"Measured at these {len(self.q)} poses, the calibrated robot is expected to be right to "
            f"{factor * self.prediction:.3g} {unit}, if the kinds of errors are these and the noise is as stated."
        )

    @property
    def remarks(self) -> tuple[Finding, ...]:
        """What is not known of collisions, and poses that were left out."""
        code = "collision.unchecked" if self.freedom is None else "collision.found"
        text = f"{self.left_out} poses were left out: no free move reaches them."
        return (
            *findings_of(code, [] if is_free(self.freedom) else [freedom_text(self.freedom)]),
            *findings_of("experiment.note", [text] if self.left_out else []),
        )

    def summary(self) -> str:
        """Says how good the poses are, what errors to expect, and whether the moves are free."""
        sets = self.compared
        unit, factor = SHOWN[self.unit]
        lines = [
            f"{self.robot.name}: {len(self.q)} poses for a calibration of {len(self.parameters)} parameters, "
            f"{self.motion.duration:.0f} s of motion",
            "  " + "".join([f"{'observability':16}", *(f" {name:>17}" for name in sets)]),
            *(
                "  " + "".join([f"{name:16}", *(f" {own[name]:17.3g}" for own in sets.values())])
                for name in self.observability
            ),
            f"  expected error of predicted measurements elsewhere: {factor * self.prediction:.3g} {unit}",
            "  expected standard errors, largest of each kind:",
        ]
        for kind in dict.fromkeys(item.kind for item in self.parameters if item.kind != "setup"):
            for shown in dict.fromkeys(item.shown for item in self.parameters if item.kind == kind):
                own_ = [
                    e
                    for item, e in zip(self.parameters, self.expected, strict=True)
                    if (item.kind, item.shown) == (kind, shown)
                ]
                lines.append(f"    {kind.replace('_', ' '):18} {shown[1] * max(own_):.3g} {shown[0]}")
        if self.left_out:
            lines.append(f"  {self.left_out} poses were left out: no free move reaches them")
        lines.append(f"  {freedom_text(self.freedom)}")
        return "\n".join(lines)

    def to_frame(self) -> pd.DataFrame:
        """Gives a row per pose: q1..qn."""
        import pandas as pd

        index = pd.RangeIndex(1, len(self.q) + 1, name="pose")
        return pd.DataFrame(self.q, columns=[f"q{i + 1}" for i in range(self.robot.n)], index=index)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws the singular values of the scaled Jacobian beside those of random poses.

        Args:
            ax: where to draw; a new figure by default.
        """
        axes = axes_for(ax, (6, 4))
        for values, label in ((self.eigenvalues, "designed"), (self.random_eigenvalues, "random")):
            axes.semilogy(np.sqrt(np.maximum(values, 0.0))[::-1], "o-", markersize=3, label=label)
        axes.set_xlabel("direction")
        axes.set_ylabel("singular value")
        axes.legend()
        return axes

    def _save_beside(self, folder: Path, *, force: bool) -> None:
        """Writes `poses.csv` and `trajectory.csv`."""
        rests = [segment for segment in self.segments if segment["kind"] == "pose"]
        columns: dict[str, Any] = {"pose": np.arange(1, len(self.q) + 1)}
        columns |= {f"q{i + 1}": values for i, values in enumerate(self.q.T)}
        columns |= {"start": np.array([r["start"] for r in rests]), "end": np.array([r["end"] for r in rests])}
        columns |= {name: np.full(len(self.q), np.nan) for name in self.settings["columns"]}
        units = {f"q{i + 1}": self.robot.limits.unit(i) for i in range(self.robot.n)} | {"start": "s", "end": "s"}
        write_table(
            folder / POSES, columns, {"robot": self.robot.stated or self.robot.origin}, units=units, force=force
        )
        stated = {
            "robot": self.robot.stated or self.robot.origin or self.robot.name,
            "criterion": self.criterion,
            "collisions": freedom_text(self.freedom),
            "tool_version": VERSION,
        }
        write_trajectory(folder / TRAJECTORY, self.motion, stated, kinds=self.robot.chain.kinds, force=force)


def load_pose_design(folder: str | Path, robot: Robot | None = None) -> PoseDesign:
    """Reads a saved design of poses.

    Args:
        folder: where `save` wrote.
        robot: the robot; by default the one that the design names.

    Raises:
        InputError: a missing or damaged file.
    """
    from oed.exports import read_trajectory
    from robots.geometry_errors.terms.base import shown_unit
    from robots.loading import load_robot

    file, remedy = Path(folder) / DESIGN, "give the folder written by `oed design --for calibration`"
    data = read_json(file, PoseDesign.FORMAT, PoseDesign.FORMAT_VERSION, remedy=remedy)
    parameters = read(list[_Parameter], data.get("parameters"), "parameters", file=file, remedy=remedy)
    origin = read(_Origin, data.get("robot"), "robot", file=file, remedy=remedy).origin
    return PoseDesign.from_dict(
        data,
        file=file,
        remedy=remedy,
        robot=robot or load_robot(origin, unlimited=True),
        motion=read_trajectory(Path(folder) / TRAJECTORY)[0],
        parameters=tuple(
            ErrorParameter(
                name=item.name,
                kind=item.kind,
                joint=item.joint,
                unit=item.unit,
                scale=item.scale,
                shown=shown_unit(item.unit),
            )
            for item in parameters
        ),
        expected=np.array([p.expected_standard_error for p in parameters]),
    )


@dataclass(frozen=True)
class _Origin:
    origin: str


@dataclass(frozen=True)
class _Parameter:
    name: str
    kind: str
    joint: int | None
    unit: str
    scale: float
    expected_standard_error: float
