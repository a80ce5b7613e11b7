"""A designed experiment: its motion, what it informs of, and how far it stays from every limit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from oed.criteria import Criterion
from oed.experiments.quality import Quality, excitation_findings
from oed.experiments.results.design_file import TRAJECTORY, read_design
from oed.experiments.results.outcome import Outcome
from oed.experiments.results.planned import OF_ROBOT, Planned
from oed.experiments.results.views import motion_frame, plot_velocities
from oed.experiments.safety_checks.freedom import freedom_findings, freedom_text, is_free
from oed.experiments.safety_checks.margins import assumption_findings, measured_margins
from oed.experiments.safety_checks.spatial_check import SpatialMargin
from oed.experiments.searches.search import INTERRUPTED
from oed.exports import write_trajectory
from robots.base_parameters import BaseParameters
from robots.common.arrays import Array
from robots.common.records import Finding, findings_of
from robots.limits import Margin
from robots.plants import PlantEffect
from robots.robot import Robot
from robots.signals import Motion
from robots.version import VERSION

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


@dataclass(frozen=True, kw_only=True)
class Design(Planned, format="robot-oed design", tool=True, shares=("limits=robot.limits",)):
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

    ENTRIES = (
        *OF_ROBOT,
        "assumed",
        "model.columns=base.names",
        "model.units=base.units",
        "model.stands_for=base.formulas",
        "model.terms=terms",
        "model.scaling=scaling",
        "model.coulomb=sign",
        "criterion=criterion.name",
        "criterion_label=criterion.label",
        "quality=qualities",
        "**excitation",
        "segments",
        "duration=motion.duration",
        "period=robot.period",
        "home",
        "home_moved",
        "limits_in_space=space",
        "collision=freedom",
        "strokes_left_out",
        "smallest_margins=margins",
        "solver.name=settings[solver][name]",
        "solver.islands=islands",
        "seed=settings[seed]",
        "settings",
    )

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
        cond = self.optimised.cond if self.qualities else None
        worth = "not all parameters excited" if cond is None else f"cond(Y) {cond:.4g}"
        return f"Design({self.robot.name!r}, {self.motion.duration:.1f} s, {self.base.size} parameters, {worth})"

    @property
    def terms(self) -> list[str]:
        """Names of the model's terms."""
        return [term.name for term in self.base.model.terms]

    @property
    def scaling(self) -> str:
        """How the columns of the regressor are scaled."""
        return str(self.settings.get("scaling", "none"))

    @property
    def sign(self) -> str:
        """The function of the velocity that stands for its sign in Coulomb friction."""
        return f"tanh(dq / {self.settings['velocity_scale']:g})"

    @property
    def excitation(self) -> dict[str, Any]:
        """The optimised part: under ``fourier`` a series, under ``excitation`` another family's motion."""
        common = {"periods": self.settings["periods"], "coefficients": self.coefficients}
        family = dict(self.settings.get("family") or {"name": "fourier"})
        if family["name"] == "fourier":
            frequency, harmonics = self.settings["base_frequency"], self.settings["harmonics"]
            return {"fourier": {"base_frequency_hz": frequency, "harmonics": harmonics, **common}}
        return {"excitation": {"family": family, **common}}

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
        return free and not self.violated and self.optimised.cond is not None

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

    @property
    def conclusion(self) -> str:
        """Whether to play the motion, and what it determines."""
        codes = {finding.code for finding in self.remarks}
        if "limit.exceeded" in codes:
            return f"Do not play this motion: it exceeds the limit of {self.violated[0].text}."
        if codes & {"collision.found", "collision.unchecked"}:
            return f"Do not play this motion. {freedom_text(self.freedom)}"
        if codes & {"excitation.incomplete", "excitation.weak"}:
            return "Design the experiment again: this motion does not determine all parameters."
        return (
            f"Play trajectory.csv on the robot: in {self.motion.duration:.0f} s it determines all {self.base.size} "
            f"base parameters within all limits. {freedom_text(self.freedom)}"
        )

    @property
    def remarks(self) -> tuple[Finding, ...]:
        """Limits that are exceeded, what is not determined, and what was assumed or not checked."""
        robot = self.robot
        found = [
            Finding(
                code="limit.exceeded",
                subject=f"Joint {margin.joint}:",
                text=f"the motion exceeds the limit of {margin.text}.",
                action="Do not play it.",
            )
            for margin in self.violated
        ]
        found += excitation_findings(self.whole)
        found += assumption_findings(robot)
        if not any(margin.quantity == "torque" for margin in self.margins):
            text = "Torque limits were not checked: the robot's description lacks nominal dynamics or torque limits."
            found += findings_of("torque.unchecked", [text])
        found += freedom_findings(self.freedom)
        if self.strokes_left_out:
            joints = ", ".join(str(joint) for joint in self.strokes_left_out)
            found += findings_of("stroke.left_out", [f"No velocity stroke for joints {joints}: the arm would collide."])
        return tuple(found)

    def summary(self) -> str:
        """Describes the experiment, its quality and its margins in a few lines."""
        lines = [
            f"{self.robot.name}: experiment of {self.motion.duration:.1f} s for {self.base.size} parameters, "
            f"{len(self.motion)} samples at {1e3 * self.robot.period:g} ms",
        ]
        for quality in self.qualities:
            if quality.cond is None:
                usual = " (normal)" if quality.part == "sinusoid" else ""
                lines.append(f"  {quality.label:16} alone: not all parameters are determined{usual}")
            else:
                lines.append(
                    f"  {quality.label:16} cond(Y) {quality.cond:.3g}, log det(Y'Y) {quality.log_det:.1f}, "
                    f"smallest singular value {quality.smallest:.3g}"
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

    def _save_beside(self, folder: Path, *, force: bool) -> None:
        """Writes `trajectory.csv`."""
        kinds = self.robot.chain.kinds
        write_trajectory(folder / TRAJECTORY, self.motion, self.metadata(), kinds=kinds, force=force)

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
        data, given = read_design(folder, robot, criterion)
        return cls.from_dict(data, file=Path(folder) / cls.FILE, remedy="design the experiment again", **given)

    def metadata(self) -> dict[str, Any]:
        """Gives the metadata of the trajectory file."""
        return {
            "robot": self.robot.origin or self.robot.name,
            "period": self.robot.period,
            "criterion": self.criterion.name,
            "collisions": freedom_text(self.freedom),
            "tool": f"robot-oed {VERSION}",
        }
