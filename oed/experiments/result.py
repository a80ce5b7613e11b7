"""A designed experiment: its motion, what it informs of, and how far it stays from every limit."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from oed.criteria import Criterion, Weighting, triangle
from oed.criteria import criterion as choose_criterion
from oed.experiments.views import motion_frame, plot_velocities
from oed.exports import read_trajectory, write_trajectory
from robots.base_parameters import BaseParameters, find_base_parameters
from robots.common.errors import InputError
from robots.common.files import existing_file, write_atomic
from robots.common.parallel import one_blas_thread
from robots.limits import Limits, Margin, symmetric_margins
from robots.loading import load_robot
from robots.regressor import TorqueModel, default_model
from robots.robot import Robot
from robots.signals import Motion
from robots.version import VERSION

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

TRAJECTORY, DESIGN = "trajectory.csv", "design.json"


@dataclass(frozen=True, kw_only=True)
class Quality:
    """What a part of the experiment tells of the parameters.

    Attributes:
        part: which segments, such as ``fourier`` or ``whole``.
        samples: how many.
        singular_values: of the unscaled regressor Y (m,), ascending.
    """

    part: str
    samples: int
    singular_values: tuple[float, ...]

    def value(self, criterion: str | Criterion) -> float:
        """Evaluates a criterion."""
        return choose_criterion(criterion).value(np.square(self.singular_values))

    def to_dict(self) -> dict[str, Any]:
        """Lists cond(Y), log det(Y'Y) and the smallest singular value; null where Y has not full rank."""
        full = self.singular_values[0] > 1e-10 * self.singular_values[-1]
        return {
            "part": self.part,
            "samples": self.samples,
            "cond_Y": self.value("cond") if full else None,
            "log_det_YtY": self.value("d") if full else None,
            "smallest_singular_value_Y": self.singular_values[0] if full else 0.0,
            "singular_values_Y": list(self.singular_values),
        }


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """How one independent search ended.

    Attributes:
        island: its number, counted from 1.
        initial: the criterion at its first feasible point.
        final: the criterion of its best design.
        iterations: of IPOPT.
        evaluations: of criterion and gradient.
        status: ``finished``, or what stopped it early.
    """

    island: int
    initial: float
    final: float
    iterations: int
    evaluations: int
    status: str

    def to_dict(self) -> dict[str, Any]:
        """Writes plain data; null where a point did not excite all parameters."""
        return {name: None if value != value else value for name, value in asdict(self).items()}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Outcome:
        """Reads what `to_dict` wrote."""
        values: dict[str, Any] = {name: np.nan if value is None else value for name, value in data.items()}
        return cls(**values)


@dataclass(frozen=True, kw_only=True)
class Design:
    """An excitation experiment.

    Attributes:
        robot: what it is for.
        base: the parameters it determines.
        criterion: what was optimised.
        motion: the whole experiment at the controller's period.
        segments: kind, start [s], end [s] and joint of each part.
        qualities: of the Fourier part, of the strokes and of the whole.
        margins: the closest approach to each limit, by the samples of the motion.
        islands: every search's outcome; the best one was taken.
        settings: everything that, with the seed, makes the same design again.
        coefficients: of the Fourier series, rows q0, a1..aN, b1..bN per joint (n, 2 N + 1).
        freedom: of collisions: the smallest clearance [m], between what, when, and whether it is proved for all times;
            None where it was not asked for.
        strokes_left_out: joints without a stroke, for on it the arm would collide.
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
    freedom: Mapping[str, Any] | None = None
    strokes_left_out: tuple[int, ...] = ()

    @property
    def fourier(self) -> Quality:
        """The quality of the optimised part."""
        return self.qualities[0]

    @property
    def whole(self) -> Quality:
        """The quality of the whole experiment."""
        return self.qualities[-1]

    @property
    def violated(self) -> tuple[Margin, ...]:
        """Limits that the motion passes; none of position, velocity, acceleration and jerk ever is."""
        return tuple(margin for margin in self.margins if margin.violated)

    @property
    def success(self) -> bool:
        """Whether all limits hold and all parameters are excited."""
        free = self.freedom is None or bool(self.freedom["certified"])
        return free and not self.violated and self.fourier.to_dict()["cond_Y"] is not None

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
        """Measures all margins anew from the samples of the motion, whatever the solver said."""
        return measured_margins(self.robot, self.motion, self.base)

    def summary(self) -> str:
        """Says in a few lines what the experiment is and what it is good for."""
        lines = [
            f"{self.robot.name}: {self.motion.duration:.1f} s, {len(self.motion)} samples at "
            f"{1e3 * self.robot.period:g} ms, {self.base.size} parameters",
        ]
        for quality in self.qualities:
            values = quality.to_dict()
            if values["cond_Y"] is None:
                lines.append(f"  {quality.part:8} does not determine all parameters")
            else:
                lines.append(
                    f"  {quality.part:8} cond(Y) {values['cond_Y']:.2f}, log det(Y'Y) {values['log_det_YtY']:.1f}, "
                    f"smallest singular value {values['smallest_singular_value_Y']:.3g}"
                )
        finals = ", ".join(f"{island.initial:.4g} -> {island.final:.4g} ({island.status})" for island in self.islands)
        searches = "1 search" if len(self.islands) == 1 else f"{len(self.islands)} searches"
        lines.append(f"  {self.criterion.name} of one period, in {searches}: {finals}")
        tightest = min((m for m in self.margins if np.isfinite(m.limit)), key=lambda m: m.slack_fraction, default=None)
        if tightest is not None:
            lines.append(
                f"  tightest limit: {tightest.quantity} of joint {tightest.joint}, "
                f"{100 * tightest.slack_fraction:.2f} % left at {tightest.time:.3f} s"
            )
        if self.freedom is not None:
            lines.append(
                f"  closest bodies: {self.freedom['pair']}, {1e3 * self.freedom['clearance']:.0f} mm at "
                f"{self.freedom['time']:.2f} s, {'proved' if self.freedom['certified'] else 'NOT proved'} at all times"
            )
        if self.strokes_left_out:
            lines.append(f"  no stroke for joints {self.strokes_left_out}: the arm would collide")
        for margin in self.violated:
            lines.append(
                f"  PASSED: {margin.quantity} of joint {margin.joint}: {margin.value:.4g} of {margin.limit:.4g} "
                f"at {margin.time:.3f} s"
            )
        return "\n".join(lines)

    def to_frame(self) -> pd.DataFrame:
        """Gives the experiment as a table: t, q1.., dq1.., ddq1.."""
        return motion_frame(self.motion)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws the joint velocities as shares of their limits over time."""
        return plot_velocities(self.motion, self.robot.limits, ax)

    def to_dict(self) -> dict[str, Any]:
        """Writes everything but the samples as plain data for `design.json`."""
        model = self.base.model
        return {
            "format": "robot-oed design",
            "format_version": 1,
            "tool_version": VERSION,
            "robot": {"name": self.robot.name, "origin": self.robot.origin, "sha256": self.robot.digest},
            "assumed": [*self.robot.assumed, *(f"limits.{name}" for name in missing_limits(self.robot.limits))],
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
            "fourier": {
                "base_frequency_hz": self.settings["base_frequency"],
                "harmonics": self.settings["harmonics"],
                "periods": self.settings["periods"],
                "coefficients": self.coefficients.tolist(),
            },
            "segments": [dict(segment) for segment in self.segments],
            "duration": self.motion.duration,
            "period": self.robot.period,
            "collision": None if self.freedom is None else dict(self.freedom),
            "strokes_left_out": list(self.strokes_left_out),
            "smallest_margins": [margin_data(margin) for margin in self.margins],
            "solver": {"name": "ipopt", "islands": [island.to_dict() for island in self.islands]},
            "seed": self.settings["seed"],
            "settings": dict(self.settings),
        }

    def save(self, folder: str | Path, *, force: bool = False) -> None:
        """Writes `trajectory.csv` and `design.json` into a folder that is there.

        Raises:
            InputError: a file is there, and force is not given.
        """
        write_trajectory(Path(folder) / TRAJECTORY, self.motion, self.metadata(), force=force)
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
        file = Path(folder) / DESIGN
        try:
            data = json.loads(existing_file(file).read_text(encoding="utf-8"))
            known = robot or load_robot(data["robot"]["origin"])
            settings = data["settings"]
            base = find_base_parameters(design_model(known, settings))
            if list(base.names) != data["model"]["columns"]:
                raise InputError(f"the design is for {data['robot']['name']}, not for {known.name}", file=file)
            qualities = tuple(
                Quality(part=q["part"], samples=q["samples"], singular_values=tuple(q["singular_values_Y"]))
                for q in data["quality"]
            )
            margins = tuple(
                Margin(**{**margin, "limit": np.inf if margin["limit"] is None else margin["limit"]})
                for margin in data["smallest_margins"]
            )
            return cls(
                robot=known,
                base=base,
                criterion=choose_criterion(criterion or data["criterion"]),
                motion=read_trajectory(Path(folder) / TRAJECTORY)[0],
                segments=tuple(data["segments"]),
                qualities=qualities,
                margins=margins,
                islands=tuple(Outcome.from_dict(island) for island in data["solver"]["islands"]),
                settings=settings,
                coefficients=np.array(data["fourier"]["coefficients"]),
                freedom=data["collision"],
                strokes_left_out=tuple(data["strokes_left_out"]),
            )
        except (OSError, UnicodeDecodeError, json.JSONDecodeError, KeyError, TypeError) as error:
            raise InputError(f"is no design file: {type(error).__name__} {error}", file=file) from error

    def metadata(self) -> dict[str, Any]:
        """What the trajectory file says of itself."""
        return {
            "robot": self.robot.origin or self.robot.name,
            "period": self.robot.period,
            "criterion": self.criterion.name,
            "tool": f"robot-oed {VERSION}",
        }


def design_model(robot: Robot, settings: Mapping[str, Any]) -> TorqueModel:
    """Builds the model whose columns a design with these settings is for."""
    keys = ("friction", "velocity_scale", "rotor", "offset")
    return default_model(robot, **{key: settings[key] for key in keys})


def missing_limits(limits: Limits) -> dict[str, tuple[int, ...]]:
    """Finds the quantities, and their joints from 1, for which cautious limits had to be assumed."""
    lacking = {name: np.flatnonzero(~np.isfinite(getattr(limits, name))) + 1 for name in ("acceleration", "jerk")}
    return {name: tuple(map(int, joints)) for name, joints in lacking.items() if joints.size}


@one_blas_thread()
def measure(part: str, base: BaseParameters, motion: Motion, weighting: Weighting | None = None) -> Quality:
    """Computes the singular values of a motion's regressor, or of what a weighting makes of it."""
    judged = weighting or Weighting()
    reduced = triangle(base.model, base.independent, motion.q, motion.dq, motion.ddq, judged.rows)
    values = judged.singular_values(reduced, len(motion))
    return Quality(part=part, samples=len(motion), singular_values=tuple(float(v) for v in values))


def measured_margins(robot: Robot, motion: Motion, base: BaseParameters) -> tuple[Margin, ...]:
    """Measures the margins to all limits, the torque by the robot's nominal model where it is described."""
    limits: Limits = robot.limits
    margins = list(limits.margins(motion))
    nominal = base.model.nominal
    if np.isfinite(nominal).all() and np.isfinite(limits.torque).any():
        tau = base.model.torque(motion.q, motion.dq, motion.ddq, nominal)
        margins += symmetric_margins("torque", motion.t, tau, limits.torque)
    return tuple(margins)


def margin_data(margin: Margin) -> dict[str, Any]:
    """Writes a margin as plain data; a limit that is not there is null."""
    return {
        "quantity": margin.quantity,
        "joint": margin.joint,
        "value": margin.value,
        "limit": margin.limit if np.isfinite(margin.limit) else None,
        "time": margin.time,
        "slack_fraction": margin.slack_fraction,
    }
