"""The verb: predicts the torques of a motion, and measures the error where they were logged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from estimation.logs.clocks import clock_shift_between, earlier_logs_on_clock
from estimation.logs.known_setup import HEAT, require_plain
from estimation.models.model import Model
from estimation.preprocessing import LowPass, Smoother, SmoothingSpline, resample, smooth
from estimation.preprocessing.smoothing import low_pass
from estimation.regressions.joint_regressor import chunks
from estimation.regressions.preparation import torque_of
from robots.common.errors import InputError
from robots.common.plain import all_finite, finite
from robots.common.tables.table_files import write_table
from robots.signals import Log, Motion
from robots.terms.effect_bases.capabilities import Persistence

if TYPE_CHECKING:
    import pandas as pd

    from estimation.thermal import ThermalTorqueModel

Array = NDArray[np.float64]

NORMAL_95 = 1.96


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """Torques of a motion.

    Attributes:
        motion: smoothed as the model's data were.
        predicted: torque (N, n) [N m or N].
        measured: torque (N, n) as logged, or None.
        joint_names: names (n,).
        band: half-widths (N, n) of a band that held 95 % of the errors on data left out of the fit, widened by what
            the parameters' errors make of this motion; None of a model that states none.
        cutoff: of the model's smoothing [Hz]: above it, no motion is known.
    """

    motion: Motion
    predicted: Array
    measured: Array | None
    joint_names: tuple[str, ...]
    band: Array | None = None
    cutoff: float = np.inf

    @property
    def error_rms(self) -> Array:
        """RMS of measured minus predicted torque (n,); NaN without measurement."""
        if self.measured is None:
            return np.full(self.predicted.shape[1], np.nan)
        return np.sqrt(np.mean((self.measured - self.predicted) ** 2, axis=0))

    @property
    def nrmse(self) -> Array:
        """Error RMS over torque RMS (n,)."""
        return self._over(self.error_rms, None if self.measured is None else np.sqrt(np.mean(self.measured**2, axis=0)))

    @property
    def relative_spread(self) -> Array:
        """Standard deviation of the error over that of the torque (n,): 1 is no better than a constant."""
        if self.measured is None:
            return self.error_rms
        return self._over((self.measured - self.predicted).std(axis=0), self.measured.std(axis=0))

    @property
    def band_limited_spread(self) -> Array:
        """`relative_spread` after one low-pass at `cutoff` over measured and predicted torque alike (n,).

        What the sensors add above the motion's frequencies is left out of both; the whole error is in
        `relative_spread`. Uneven samples are put on a grid first.
        """
        if self.measured is None:
            return self.error_rms
        t = self.motion.t
        grid = np.linspace(t[0], t[-1], len(t))
        period = self.motion.duration / max(len(t) - 1, 1)
        both = (self.measured - self.predicted, self.measured)
        even = (np.column_stack([np.interp(grid, t, column) for column in x.T]) for x in both)
        error, torque = (low_pass(x, period, self.cutoff) for x in even)
        return self._over(error.std(axis=0), torque.std(axis=0))

    @property
    def band_coverage(self) -> Array:
        """Share of the measured torque within the band (n,); NaN without measurement or band."""
        if self.measured is None or self.band is None:
            return np.full(self.predicted.shape[1], np.nan)
        return np.asarray((np.abs(self.measured - self.predicted) <= self.band).mean(axis=0))

    def _over(self, error: Array, scale: Array | None) -> Array:
        if scale is None:
            return error
        return np.divide(error, scale, out=np.full_like(error, np.nan), where=scale > 0)

    def summary(self) -> str:
        """Gives the error per joint, where torque was logged."""
        samples = len(self.motion)
        if self.measured is None:
            return f"torques of {samples} samples; the log has no torques to compare with"
        limited = f"below {self.cutoff:.3g} Hz"
        lines = [
            f"torques of {samples} samples",
            f"  joint                  error RMS  rel. RMS       rel. std  {limited:>14}   in the 95 % band",
        ]
        columns = (self.error_rms, self.nrmse, self.relative_spread, self.band_limited_spread, self.band_coverage)
        for j, (name, rms, *shares) in enumerate(zip(self.joint_names, *columns, strict=True), start=1):
            share, spread, slow, covered = (f"{100 * v:.2f} %" if np.isfinite(v) else "–" for v in shares)
            lines.append(f"  {j} {name[:18]:18} {rms:12.4g} {share:>10} {spread:>14} {slow:>15} {covered:>21}")
        lines.append("  rel.: error divided by torque; last column: share of the errors within the 95 % band")
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """Gives the errors as plain data."""
        quantities = {
            "error_rms": self.error_rms,
            "nrmse": self.nrmse,
            "error_std_over_torque_std": self.relative_spread,
            "error_std_over_torque_std_below_cutoff": self.band_limited_spread,
            "band95_coverage": self.band_coverage,
        }
        return {
            "samples": len(self.motion),
            "cutoff_hz": finite(self.cutoff),
            **{name: all_finite(values) for name, values in quantities.items()},
        }

    def to_frame(self) -> pd.DataFrame:
        """Gives t, tau1.. as a table."""
        import pandas as pd

        return pd.DataFrame(self._columns(band=False))

    def save(self, path: str | Path, *, band: bool = False, force: bool = False) -> None:
        """Writes t, tau1..taun, and on request the band's half-widths band1..bandn, as CSV or Parquet.

        Raises:
            InputError: the file is there, and force is not given.
        """
        write_table(path, self._columns(band), {"content": "predicted joint torques"}, force=force)

    def _columns(self, band: bool) -> dict[str, Array]:
        joints = range(self.predicted.shape[1])
        columns = {"t": self.motion.t, **{f"tau{j + 1}": self.predicted[:, j] for j in joints}}
        if band and self.band is not None:
            columns |= {f"band{j + 1}": self.band[:, j] for j in joints}
        return columns


def predict(
    model: Model,
    log: Log,
    *,
    thermal: ThermalTorqueModel | None = None,
    start: Sequence[Array | None] | None = None,
    ambient: float | None = None,
    later: float | None = None,
    before: Sequence[Log] = (),
) -> Prediction:
    """Predicts the torques of a log's motion.

    Args:
        model: an identified model.
        log: positions over time; its torque, if any, is compared with the prediction and not used otherwise. A payload
            or a gravity that it states counts. Where it overlaps in time the logs in which a model's change was found,
            it counts as recorded after them (`clock_shift`).
        thermal: this model with its thermal models: friction falls as the motion heats the joints.
        start: temperatures of each joint's zones at first [degC]; ambient temperature by default.
        ambient: ambient temperature where the log does not state it [degC]; each model's by default.
        later: how much later [s] than its own clock says the log counts; by default what `clock_shift` says.
        before: logs of what the robot did before, for a model whose effects keep heat: without any it begins cold.
            With `later` their times are as they count (`warmed`). Beside `thermal`, `start` says what was before.

    Returns:
        The torques at the log's own times.

    Raises:
        InputError: another number of joints, or too few rows; a gravity that shows parameters which the model lacks; a
            payload or a gravity beside heat; logs before the motion that come after it, or of a model that keeps none.
    """
    robot = model.robot
    if log.n != robot.n:
        raise InputError(
            f"{log.n} joints", file=log.metadata.get("file"), allowed=f"{robot.n}, as in the model of {robot.name}"
        )
    cutoff = float(model.provenance.get("cutoff_hz", 10.0))
    motion = smooth(resample(log.t, log.q), _smoother(model, cutoff))
    has_torque = log.tau is not None or log.current is not None
    if thermal is None:
        states = (motion.q, motion.dq, motion.ddq)
        if later is None:
            later = clock_shift(model, log)[0]
            before = warmed(model, before, log, later)[0]
        smoother, clock = _smoother(model, cutoff), motion.t + later
        earlier = [smooth(resample(own.t, own.q), smoother) for own in before]
        predicted = model.torque(*states, clock, gravity=log.gravity, payload=log.payload, before=earlier)
    else:
        from estimation.thermal.history import surroundings

        require_plain([log], HEAT)
        predicted, _ = thermal.simulate(motion, ambient=surroundings(log, motion.t, ambient), start=start)
    return Prediction(
        motion=motion,
        predicted=predicted,
        measured=torque_of(robot, log) if has_torque else None,
        joint_names=robot.joint_names,
        band=_band(model, motion, log.gravity),
        cutoff=cutoff,
    )


def clock_shift(model: Model, log: Log) -> tuple[float, str]:
    """Time shift [s] of a log for a model that changes with time, and a note on it.

    Time-dependent effects refer to the clock of the logs of the model's fit (`clock_shift_between`).
    """
    if not any(extension.source.persistence is not Persistence.STATE for extension in model.extensions):
        return 0.0, ""
    return clock_shift_between(model.provenance.get("logs", ()), log)


def warmed(model: Model, before: Sequence[Log], log: Log, later: float) -> tuple[list[Log], str]:
    """Puts earlier logs that warmed the robot up on a model's clock, and gives a note on the assumption.

    A model without thermal effects needs no note.

    Args:
        model: with the effects.
        before: the logs, in the order in which they were recorded where their clocks each began anew.
        log: the motion.
        later: how much later [s] than its own clock says that counts (`clock_shift`).

    Raises:
        InputError: logs that come after the motion; any, of a model that keeps no heat.
    """
    if not model.keeps_heat:
        if before:
            raise InputError(
                "the model has no thermal part",
                remedy="use a model of oed thermal, or remove the earlier logs (--before)",
            )
        return [], ""
    if not before:
        return [], COLD
    shifts = [clock_shift(model, own)[0] for own in before]
    placed, anew = earlier_logs_on_clock(before, log, float(log.t[0]) + later, shifts)
    count = "one log" if len(before) == 1 else f"{len(before)} logs"
    return (
        placed,
        (
            f"thermal friction: initial temperatures from {count} before; the first is assumed to start "
            f"cold{f'; {anew}' if anew else ''}"
        ),
    )


COLD = "thermal friction: the robot is assumed cold at the start; give earlier logs with --before if it was warm"


def _smoother(model: Model, cutoff: float) -> Smoother:
    """The smoother of the model's data for another motion; a low-pass instead of harmonics."""
    smoothing = model.provenance.get("smoothing")
    kind = smoothing.get("kind") if isinstance(smoothing, Mapping) else None
    return SmoothingSpline(cutoff) if kind == SmoothingSpline.name else LowPass(cutoff)


def _band(model: Model, motion: Motion, gravity: Array | None) -> Array | None:
    level = model.provenance.get("band95")
    if level is None:
        return None
    width = np.broadcast_to(np.asarray(level, dtype=float), motion.q.shape).copy()
    if model.provenance.get("regularised", True):
        # The covariance is that of the fit without regularisation: it knows nothing of what fills open directions.
        return width
    torque_model = model.torque_model.under(gravity)
    for rows in chunks(len(motion)):
        Y = torque_model.regressor(motion.q[rows], motion.dq[rows], motion.ddq[rows], columns=model.columns)
        variance = np.einsum("tjp,tjp->tj", Y @ model.covariance, Y)
        width[rows] = np.hypot(width[rows], NORMAL_95 * np.sqrt(np.maximum(variance, 0.0)))
    return width
