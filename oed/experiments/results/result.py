"""A designed experiment: its motion, what it informs of, and how far it stays from every limit."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from oed.criteria import Criterion
from oed.experiments.quality import Quality
from oed.experiments.results.design_file import DESIGN, TRAJECTORY, read_design
from oed.experiments.results.outcome import Outcome
from oed.experiments.results.views import motion_frame, plot_velocities
from oed.experiments.safety_checks.freedom import freedom_text, is_free
from oed.experiments.safety_checks.margins import assumed_values, margin_data, measured_margins
from oed.experiments.safety_checks.spatial_check import SpatialMargin
from oed.experiments.searches.search import INTERRUPTED
from oed.exports import write_trajectory
from robots.base_parameters import BaseParameters
from robots.common.files import write_atomic
from robots.limits import Margin
from robots.plants import PlantEffect
from robots.robot import Robot
from robots.signals import Motion
from robots.version import VERSION

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Design:
    """An excitation experiment.

    Attributes:
        robot: what it is for.
        base: the parameters it determines.
        criterion: what was optimised.
        motion: the whole experiment at the controller's period.
        segments: kind, start [s], end [s] and joint of each part.
        qualities: of the optimised part, of the strokes and of the whole.
        margins: the closest approach to each limit, by the samples of the motion.
        islands: every search's outcome; the best one was taken.
        settings: everything that, with the seed, makes the same design again.
        coefficients: of the optimised part, one row a joint; of a Fourier series q0, a1..aN, b1..bN (n, 2 N + 1).
        home: pose (n,) at both ends.
        home_moved: whether that is the nearest pose that keeps the limits in space, for the usual one does not.
        space: the closest approach to each further limit in space.
        freedom: of collisions, as `collision_data` writes it; None where they were not checked.
        strokes_left_out: joints without a stroke, for on it the arm would collide or break another limit in space.
    """

    robot: Robot
    base: BaseParameters
    criterion: Criterion
    motion: Motion
    segments: tuple[Mapping[str, Any], ...]
    qualities: tuple[Quality, ...]
    margins: tuple[Margin, ...]
    islands: tuple[Outcome, ...]
    settings: Mapping[str, Any]
    coefficients: Array
    home: Array
    home_moved: bool = False
    space: tuple[SpatialMargin, ...] = ()
    freedom: Mapping[str, Any] | None = None
    strokes_left_out: tuple[int, ...] = ()

    def __repr__(self) -> str:
        cond = self.optimised.to_dict()["cond_Y"] if self.qualities else None
        worth = "not all parameters excited" if cond is None else f"cond(Y) {cond:.4g}"
        return f"Design({self.robot.name!r}, {self.motion.duration:.1f} s, {self.base.size} parameters, {worth})"

    @property
    def optimised(self) -> Quality:
        """The quality of the optimised part."""
        return self.qualities[0]

    @property
    def whole(self) -> Quality:
        """The quality of the whole experiment."""
        return self.qualities[-1]

    @property
    def effects(self) -> tuple[PlantEffect, ...]:
        """The effects beyond the robot's description that the design assumed."""
        return tuple(
            PlantEffect(
                effect=e["effect"], joint=e["joint"], coefficients=tuple(e["coefficients"]), shape=tuple(e["shape"])
            )
            for e in self.settings.get("effects", ())
        )

    @property
    def violated(self) -> tuple[Margin, ...]:
        """Limits that the motion passes; none of position, velocity, acceleration and jerk ever is."""
        return tuple(margin for margin in self.margins if margin.violated)

    @property
    def success(self) -> bool:
        """Whether all limits hold and all parameters are excited."""
        free = self.freedom is None or is_free(self.freedom)
        free = free and not any(margin.violated for margin in self.space)
        return free and not self.violated and self.optimised.to_dict()["cond_Y"] is not None

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C ended the search early."""
        return any(island.status == INTERRUPTED for island in self.islands)

    def part(self, kind: str) -> Motion:
        """Cuts the samples of the segments of one kind out of the motion."""
        return self._cut([s for s in self.segments if s["kind"] == kind])

    def _cut(self, segments: list[Mapping[str, Any]]) -> Motion:
        t = self.motion.t
        half = self.robot.period / 2
        inside = np.zeros(len(t), dtype=bool)
        for segment in segments:
            inside |= (t >= segment["start"] - half) & (t < segment["end"] - half)
        motion = self.motion
        return Motion(t=t[inside], q=motion.q[inside], dq=motion.dq[inside], ddq=motion.ddq[inside])

    def check(self) -> tuple[Margin, ...]:
        """Computes all margins from the samples of the motion, independently of the solver."""
        return measured_margins(self.robot, self.motion, self.base, [e for e in self.effects if e.static])

    def summary(self) -> str:
        """Describes the experiment, its quality and its margins in a few lines."""
        lines = [
            f"{self.robot.name}: experiment of {self.motion.duration:.1f} s for {self.base.size} parameters, "
            f"{len(self.motion)} samples at {1e3 * self.robot.period:g} ms",
        ]
        for quality in self.qualities:
            values = quality.to_dict()
            if values["cond_Y"] is None:
                usual = " (normal)" if quality.part == "sinusoid" else ""
                lines.append(f"  {quality.label:16} alone: not all parameters are determined{usual}")
            else:
                lines.append(
                    f"  {quality.label:16} cond(Y) {values['cond_Y']:.3g}, log det(Y'Y) {values['log_det_YtY']:.1f}, "
                    f"smallest singular value {values['smallest_singular_value_Y']:.3g}"
                )
        finals = ", ".join(f"{island.initial:.4g} -> {island.final:.4g} ({island.status})" for island in self.islands)
        searches = "1 search" if len(self.islands) == 1 else f"{len(self.islands)} searches"
        lines.append(f"  optimisation of {self.criterion.name} over one period, {searches}: {finals}")
        tightest = min((m for m in self.margins if np.isfinite(m.limit)), key=lambda m: m.slack_fraction, default=None)
        if tightest is not None:
            lines.append(
                f"  tightest limit: {tightest.quantity} of joint {tightest.joint}, "
                f"{100 * tightest.slack_fraction:.2f} % left at {tightest.time:.3f} s"
            )
        share = self.settings.get("velocity_fraction", 1.0)
        if share < 1.0:
            lines.append(f"  speed: at most {100 * share:g} % of the velocity limits; --velocity-fraction 1 uses all")
        lines += self._effect_lines()
        lines.append(f"  {freedom_text(self.freedom)}")
        for near in self.space:
            unit = f" {near.unit}" if near.unit else ""
            lines.append(f"  {near.limit}: {near.value:.4g}{unit} left at {near.time:.2f} s")
        if self.home_moved:
            pose = ", ".join(f"{x:.3f}" for x in self.home)
            lines.append(f"  starts and ends at {pose}, because the usual home pose violates a workspace limit")
        if self.strokes_left_out:
            why = "the arm would collide or leave its workspace"
            lines.append(f"  no velocity stroke for joints {self.strokes_left_out}: {why}")
        for margin in self.violated:
            lines.append(
                f"  LIMIT EXCEEDED: {margin.quantity} of joint {margin.joint}: {margin.value:.4g} of "
                f"{margin.limit:.4g} "
                f"at {margin.time:.3f} s"
            )
        return "\n".join(lines)

    def _effect_lines(self) -> list[str]:
        """Lists effects beyond the description that the torque limits include, and those they cannot."""
        limited = any(margin.quantity.startswith("torque") for margin in self.margins)
        counted = [effect.label for effect in self.effects if effect.static and limited]
        lines = [f"  included in the torque limits: {', '.join(counted)}"] if counted else []
        lost = [effect.label for effect in self.effects if not (effect.static and limited)]
        if lost:
            why = "they depend on time or history" if limited else "torque limits or dynamics are not described"
            lines.append(f"  NOT included in the torque limits, because {why}: {', '.join(lost)}")
        return lines

    def to_frame(self) -> pd.DataFrame:
        """Gives the experiment as a table: t, q1.., dq1.., ddq1.."""
        return motion_frame(self.motion)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws the joint velocities as shares of their limits over time.

        Args:
            ax: where to draw; a new figure by default.
        """
        return plot_velocities(self.motion, self.robot.limits, ax)

    def to_dict(self) -> dict[str, Any]:
        """Writes everything but the samples as plain data for `design.json`."""
        model = self.base.model
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
                "terms": [term.name for term in model.terms],
                "scaling": self.settings.get("scaling", "none"),
                "coulomb": f"tanh(dq / {self.settings['velocity_scale']:g})",
            },
            "criterion": self.criterion.name,
            "criterion_label": self.criterion.label,
            "quality": [quality.to_dict() for quality in self.qualities],
            **self._excitation(),
            "segments": [dict(segment) for segment in self.segments],
            "duration": self.motion.duration,
            "period": self.robot.period,
            "home": self.home.tolist(),
            "home_moved": self.home_moved,
            "limits_in_space": [asdict(margin) for margin in self.space],
            "collision": None if self.freedom is None else dict(self.freedom),
            "strokes_left_out": list(self.strokes_left_out),
            "smallest_margins": [margin_data(margin, self.robot.limits) for margin in self.margins],
            "solver": {
                "name": self.settings["solver"]["name"],
                "islands": [island.to_dict() for island in self.islands],
            },
            "seed": self.settings["seed"],
            "settings": dict(self.settings),
        }

    def _excitation(self) -> dict[str, Any]:
        """Writes the optimised part: under ``fourier`` a series, under ``excitation`` another family's motion."""
        common = {"periods": self.settings["periods"], "coefficients": self.coefficients.tolist()}
        family = dict(self.settings.get("family") or {"name": "fourier"})
        if family["name"] == "fourier":
            frequency, harmonics = self.settings["base_frequency"], self.settings["harmonics"]
            return {"fourier": {"base_frequency_hz": frequency, "harmonics": harmonics, **common}}
        return {"excitation": {"family": family, **common}}

    def save(self, folder: str | Path, *, force: bool = False) -> None:
        """Writes `trajectory.csv` and `design.json` into a folder that is there.

        Args:
            folder: an existing one.
            force: replace files that are there.

        Raises:
            InputError: a file is there, and force is not given.
        """
        kinds = self.robot.chain.kinds
        write_trajectory(Path(folder) / TRAJECTORY, self.motion, self.metadata(), kinds=kinds, force=force)
        write_atomic(Path(folder) / DESIGN, json.dumps(self.to_dict(), indent=2, allow_nan=False) + "\n", force=force)

    @classmethod
    def load(cls, folder: str | Path, robot: Robot | None = None, criterion: str | Criterion | None = None) -> Design:
        """Reads a saved design.

        Args:
            folder: where `save` wrote.
            robot: the robot; by default the one that the design names. One that was made in memory, or of chosen
                joints of a URDF, must be given.
            criterion: what was optimised, if it was a criterion of one's own.

        Raises:
            InputError: a missing or damaged file, or another robot than the design's.
        """
        return cls(**read_design(folder, robot, criterion))

    def metadata(self) -> dict[str, Any]:
        """Gives the metadata of the trajectory file."""
        return {
            "robot": self.robot.origin or self.robot.name,
            "period": self.robot.period,
            "criterion": self.criterion.name,
            "collisions": freedom_text(self.freedom),
            "tool": f"robot-oed {VERSION}",
        }
