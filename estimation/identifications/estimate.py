"""Result of an identification: parameters, uncertainty, and errors on held-out data."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import chain, repeat
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from estimation.gate import GateReport
from estimation.identifications.choices import Choice
from estimation.models.model import Model
from estimation.recordings import Recording
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.plain import percent, place_of
from robots.common.records import Finding, Result, axes_for

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


MODEL = "model.json"


@dataclass(frozen=True, kw_only=True)
class JointFit:
    """Torque errors of one joint, with reference values.

    Attributes:
        joint: counted from 1.
        name: the joint's name.
        torque_rms: of the measured torque [N m or N].
        torque_spread: its standard deviation: the error of the best constant.
        residual_rms: error on the fitted logs, without rows in which the joint is at rest, which no fit counts.
        held_out_rms: error on all rows of blocks that were left out of the fit: what to expect of a prediction.
        nominal_rms: error of the robot description's own parameters; NaN where it has none.
        noise_floor: what no model of the motion can predict: what differs from period to period where the motion is
            periodic, else the level of white noise that explains the residual's fastest part.
        band: half-width of a band that holds 95 % of the errors on the fitted logs.
        identified: whether the left-out error is clearly below that of a constant.
    """

    ENTRIES = (
        "joint",
        "name",
        "identified",
        "torque_rms",
        "residual_rms",
        "held_out_rms",
        "held_out_nrmse=nrmse",
        "constant_rms=torque_spread",
        "nominal_rms",
        "noise_floor",
        "band95=band",
    )

    joint: int
    name: str
    torque_rms: float
    torque_spread: float
    residual_rms: float
    held_out_rms: float
    nominal_rms: float
    noise_floor: float
    band: float
    identified: bool

    @property
    def nrmse(self) -> float:
        """Left-out error divided by torque RMS."""
        return self.held_out_rms / self.torque_rms if self.torque_rms else np.inf


@dataclass(frozen=True, kw_only=True)
class Estimate(Result):
    """An identified model and the evidence for it.

    Attributes:
        model: parameters and their covariance.
        choice: smoothing and regularisation that the data chose.
        joints: how well each joint is explained.
        white_noise_errors: standard errors (b,) that white noise would have: too small where noise is coloured.
        t: times (N,) of the fitted rows [s].
        dq: joint velocities (N, n) of the fitted rows [rad/s or m/s].
        measured: torque (N, n) of the fitted rows, minus that of known payloads [N m or N].
        predicted: by the model (N, n).
        dropped_rows: rows of the logs that repeated an old position.
        gates: what the gate found in each log; empty where it was not asked.
        recording: the logs as they were made ready; None where the log was read in pieces.
        fitted_rows: number of fitted rows, where the arrays hold evenly spread stretches of a log that was read in
            pieces; None where they hold all.
    """

    ENTRIES = ("success", "warnings", "joints", "model")

    model: Model
    choice: Choice
    joints: tuple[JointFit, ...]
    white_noise_errors: Array
    t: Array
    dq: Array
    measured: Array
    predicted: Array
    dropped_rows: int
    gates: tuple[GateReport, ...] = ()
    recording: Recording | None = field(default=None, repr=False)
    fitted_rows: int | None = None

    def require_recording(self) -> Recording:
        """Gives the logs as they were made ready for the fit.

        Raises:
            InputError: the log was read in pieces.
        """
        if self.recording is None:
            raise InputError(
                "an estimate of a log that was read in pieces",
                allowed="one whose logs are in memory",
                remedy="identify a part of the log",
            )
        return self.recording

    @property
    def samples(self) -> int:
        """Number of fitted rows."""
        return len(self.t) if self.fitted_rows is None else self.fitted_rows

    def __repr__(self) -> str:
        errors = ", ".join(f"{100 * joint.nrmse:.3g}" for joint in self.joints)
        return f"Estimate({self.model!r}, held-out error {errors} % of torque)"

    @property
    def success(self) -> bool:
        """Whether every joint and every parameter is determined."""
        return all(joint.identified for joint in self.joints) and bool(self.model.determined.all())

    @property
    def colour(self) -> float:
        """Median ratio of the standard errors to those of white noise, over the determined parameters."""
        return colour_of(self.model.standard_errors, self.white_noise_errors, self.model.determined)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about the use of the results."""
        found = []
        lost = [joint for joint in self.joints if not joint.identified]
        if lost:
            names = ", ".join(f"{joint.joint} ({joint.name})" for joint in lost)
            found.append(
                f"Not identified: joints {names}. Their held-out torque is predicted no better than by a constant. "
                "Do not use their friction, rotor inertia and offset."
            )
        if (clash := self.choice.contradiction) is not None:
            found.append(
                f"The logs contradict each other: the error of {clash.log} on joint {clash.joint} is "
                f"{percent(clash.alone)} of the torque if it is fitted alone, and {percent(clash.together)} with "
                f"the others. "
                "If a payload or the base differs, state it (--payload, --gravity); else use oed diagnose."
            )
        unknown = [name for name, known in zip(self.model.names, self.model.determined, strict=True) if not known]
        if unknown:
            found.append(
                f"{len(unknown)} of {len(self.model.names)} parameters are not determined: {', '.join(unknown)}. "
                "They stay near the robot's description, or near a plausible arm where it states nothing."
            )
        if self.choice.position:
            found.append(
                "Each joint has a torque by its position (sin1, cos1, sin2, cos2), which predicts other motions better "
                f"than the rigid body alone{self._gain_by_position()}. Its cause is unknown: oed diagnose starts "
                "without it, to find the cause."
            )
        if bounds := self.model.provenance.get("at_bounds"):
            found.append(
                f"At their bounds: {', '.join(bounds)}. Their standard errors come from a fit without bounds and are "
                f"rather too large."
            )
        # Above this ratio of robust to white-noise standard errors the summary warns.
        if self.colour > 2.0:
            found.append(
                f"Residuals are correlated in time; the standard errors allow for it ({self.colour:.1f} times those "
                f"of white noise)."
            )
        if self.fitted_rows is not None:
            found.append(
                f"The log was read in pieces. Every row was checked and fitted; smoothing and friction were chosen on "
                f"evenly spread stretches, and figures show {len(self.t)} rows."
            )
        if self.dropped_rows:
            rows = "row repeats" if self.dropped_rows == 1 else "rows repeat"
            found.append(f"{self.dropped_rows} {rows} an old position (ignored).")
        return tuple(found)

    def _gain_by_position(self) -> str:
        """States the largest fall of the held-out error by a torque by position, in brackets."""
        if self.choice.without_position is None:
            return ""
        before = self.choice.without_position
        worst = max(self.joints, key=lambda joint: before[joint.joint - 1] / max(joint.held_out_rms, 1e-300))
        if not worst.torque_rms:
            return ""
        return (
            f" (held-out error of joint {worst.joint}: {percent(before[worst.joint - 1] / worst.torque_rms)} without, "
            f"{percent(worst.nrmse)} with it)"
        )

    @property
    def conclusion(self) -> str:
        """What to do with the model, in one sentence."""
        lost = [joint.joint for joint in self.joints if not joint.identified]
        if lost:
            return f"Record more motion of {place_of(lost)} and identify again: these logs do not determine it."
        if self.choice.contradiction is not None:
            return "State the payload or base of each log, or run oed diagnose: the logs contradict each other."
        error = 100 * np.median([joint.nrmse for joint in self.joints])
        return f"Use model.json: it predicts held-out torque to {error:.1f} % of the torque RMS (median joint)."

    @property
    def remarks(self) -> tuple[Finding, ...]:
        """What the estimate warns of, and the findings in its logs."""
        # `Estimate.warnings` begins with these three, as far as they apply, in this order.
        urgent = (
            ("joint.not_identified", not all(joint.identified for joint in self.joints)),
            ("logs.contradict", self.choice.contradiction is not None),
            ("parameters.undetermined", not self.model.determined.all()),
        )
        codes = chain((code for code, applies in urgent if applies), repeat("model.warning"))
        found = [Finding(code=code, text=text) for code, text in zip(codes, self.warnings, strict=False)]
        found += [finding.remark(f"{gate.log}:") for gate in self.gates for finding in gate.findings]
        return tuple(found)

    def summary(self) -> str:
        """Lists the torque errors of each joint, and warnings."""
        model = self.model
        lines = [
            f"{model.robot.name}: {len(model.names)} base parameters from {self.samples} samples; "
            f"{self.choice.smoother.text}",
            (
                "  joint                 torque RMS   fitted   held out   constant    nominal  noise floor   (errors "
                "in % of torque RMS)"
            ),
        ]
        for joint in self.joints:
            shares = [
                100 * value / joint.torque_rms if joint.torque_rms else np.nan
                for value in (
                    joint.residual_rms,
                    joint.held_out_rms,
                    joint.torque_spread,
                    joint.nominal_rms,
                    joint.noise_floor,
                )
            ]
            texts = [f"{share:8.2f} %" if np.isfinite(share) else "       – " for share in shares]
            mark = "" if joint.identified else "  NOT IDENTIFIED"
            lines.append(f"  {joint.joint} {joint.name[:18]:18} {joint.torque_rms:11.4g} {' '.join(texts)}{mark}")
        lines += [f"  {warning}" for warning in self.warnings]
        return "\n".join(lines)

    def conf_int(self, level: float = 0.95) -> pd.DataFrame:
        """Gives the confidence interval of each parameter, see `Model.conf_int`.

        Args:
            level: chance that an interval holds the parameter, between 0 and 1.

        Returns:
            A row per parameter: lower, upper.
        """
        return self.model.conf_int(level)

    def to_frame(self) -> pd.DataFrame:
        """Gives a row per parameter, see `Model.to_frame`."""
        return self.model.to_frame()

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws measured against predicted torque of all joints, each over its RMS.

        Args:
            ax: where to draw; a new figure by default.
        """
        axes = axes_for(ax, (5, 5))
        for joint in self.joints:
            scale = joint.torque_rms or 1.0
            index = joint.joint - 1
            axes.plot(self.measured[:, index] / scale, self.predicted[:, index] / scale, ".", ms=1, label=joint.name)
        axes.set_xlabel("measured torque / RMS")
        axes.set_ylabel("predicted torque / RMS")
        axes.legend(markerscale=8)
        return axes

    def save(self, folder: str | Path, *, force: bool = False) -> None:
        """Writes `model.json` into a folder that is there.

        Args:
            folder: an existing one.
            force: replace a file that is there.

        Raises:
            InputError: the file is there, and force is not given.
        """
        self.model.save(Path(folder) / MODEL, force=force)


def colour_of(errors: Array, white: Array, determined: NDArray[np.bool_]) -> float:
    """Gives the median ratio of robust to white-noise errors (b,) of the determined parameters; 1 without any."""
    known = determined & (white > 0)
    return float(np.median(errors[known] / white[known])) if known.any() else 1.0
