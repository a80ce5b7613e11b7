"""The verb: predicts the torques of a motion, and measures the error where they were logged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from estimation.gate import GateReport
from estimation.logs.known_setup import HEAT, require_plain
from estimation.models.model import Model
from estimation.predictions.band import band_of_motion, beyond_the_recorded
from estimation.predictions.checked_motions import checked_motion, joined, note_meaning, smoother_of
from estimation.predictions.earlier_logs import clock_shift, warmed
from estimation.preprocessing import resample, rows_at_rest, smooth
from estimation.preprocessing.smoothing import low_pass
from estimation.regressions.preparation import torque_of
from estimation.regressions.torque_meanings import as_joint_torque
from robots.common.arrays import Array, Flags
from robots.common.errors import InputError
from robots.common.plain import joints_in_words, percent
from robots.common.records import Finding, Result, axes_for, findings_of
from robots.common.tables.table_files import write_table
from robots.signals import Log, Motion

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from estimation.thermal import ThermalTorqueModel


@dataclass(frozen=True, kw_only=True)
class Prediction(Result):
    """Torques of a motion.

    Attributes:
        motion: smoothed as the model's data were.
        predicted: torque (N, n) [N m or N].
        measured: torque (N, n) as logged, or None.
        joint_names: names (n,).
        band: half-widths (N, n) of a band that is to hold 95 % of the errors: that of the fitted logs, widened by what
            the parameters' errors make of this motion. The widening holds 98 % where parts of the logs predicted other
            parts. None of a model that states none.
        extrapolates: where (N, n) the parameters' errors make more of the motion than of any recorded one: the fit has
            not seen the like. None without a band.
        beyond: what exceeds the recorded motions, in words.
        cutoff: of the model's smoothing [Hz]: above it, no motion is known.
        gate: the check of the log; None without one.
        rest: rows (N, n) in which the joint stands: friction may hold it with any torque, and the band is that wide.
            They do not count in the errors. None for none.
        ends: rows (N,) at the ends of the log or of a gap, where the smoothing has positions on one side only.
            As in a fit, they do not count in the errors.
    """

    ENTRIES = (
        "samples=motion.t.size",
        "extrapolates=extrapolated",
        "at_rest",
        "beyond_the_recorded=beyond",
        "cutoff_hz=cutoff",
        "gate",
        "error_rms",
        "nrmse",
        "error_std_over_torque_std=relative_spread",
        "error_std_over_torque_std_below_cutoff=band_limited_spread",
        "band95_coverage=band_coverage",
    )

    motion: Motion
    predicted: Array
    measured: Array | None
    joint_names: tuple[str, ...]
    band: Array | None = None
    extrapolates: NDArray[np.bool_] | None = None
    beyond: tuple[str, ...] = ()
    cutoff: float = np.inf
    gate: GateReport | None = None
    rest: NDArray[np.bool_] | None = None
    ends: NDArray[np.bool_] | None = None

    @property
    def error_rms(self) -> Array:
        """RMS of measured minus predicted torque (n,); NaN without measurement."""
        if self.measured is None:
            return np.full(self.predicted.shape[1], np.nan)
        return self._rms(self.measured - self.predicted)

    @property
    def nrmse(self) -> Array:
        """Error RMS over torque RMS (n,)."""
        return self._over(self.error_rms, None if self.measured is None else self._rms(self.measured))

    @property
    def relative_spread(self) -> Array:
        """Standard deviation of the error over that of the torque (n,): 1 is no better than a constant."""
        if self.measured is None:
            return self.error_rms
        return self._over(self._std(self.measured - self.predicted), self._std(self.measured))

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
        return self._over(self._std(error), self._std(torque))

    @property
    def band_coverage(self) -> Array:
        """Share of the measured torque within the band (n,); NaN without measurement or band."""
        if self.measured is None or self.band is None:
            return np.full(self.predicted.shape[1], np.nan)
        within = np.abs(self.measured - self.predicted) <= self.band
        return np.asarray((within if self.ends is None else within[~self.ends]).mean(axis=0))

    @property
    def extrapolated(self) -> Array | None:
        """Share of the samples in which each joint's model extrapolates (n,); None where it is not known."""
        return None if self.extrapolates is None else np.asarray(self.extrapolates.mean(axis=0))

    @property
    def at_rest(self) -> Array | None:
        """Share of the samples in which each joint rests (n,); None where it is not known."""
        return None if self.rest is None else np.asarray(self.rest.mean(axis=0))

    @property
    def judged(self) -> Flags:
        """Rows (N, n) that count in the errors: the joint moves, and the smoothing has positions on both sides."""
        judged = np.ones(self.predicted.shape, dtype=bool) if self.rest is None else ~self.rest
        return judged if self.ends is None else judged & ~self.ends[:, None]

    def _rms(self, signal: Array) -> Array:
        return np.asarray(np.sqrt(np.average(signal**2, axis=0, weights=self.judged)))

    def _std(self, signal: Array) -> Array:
        return self._rms(signal - np.average(signal, axis=0, weights=self.judged))

    def _over(self, error: Array, scale: Array | None) -> Array:
        if scale is None:
            return error
        return np.divide(error, scale, out=np.full_like(error, np.nan), where=scale > 0)

    @property
    def conclusion(self) -> str:
        """How well the model predicts the motion, where torque was logged."""
        if self.measured is None:
            return "The torques are predicted; the log has none to compare with."
        return f"The model predicts this motion to {100 * np.median(self.nrmse):.1f} % of the torque RMS (median)."

    @property
    def remarks(self) -> tuple[Finding, ...]:
        """What extrapolates, and what the gate found."""
        share = self.extrapolated
        texts = []
        if share is not None and share.any():
            texts = [f"{percent(float(share.mean()))} of the torques extrapolate: the fit has seen no such motion."]
        return (
            *findings_of("prediction.extrapolates", (*texts, *self.beyond)),
            *(() if self.gate is None else self.gate.remarks),
        )

    def summary(self) -> str:
        """Gives the error per joint, where torque was logged."""
        samples = len(self.motion)
        if self.measured is None:
            first = f"torques of {samples} samples; the log has no torques to compare with"
            return "\n".join([first, *self._extrapolation()])
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
        worse = np.flatnonzero(self.relative_spread > 1.0) + 1
        if len(worse):
            lines.append(
                f"  worse than a constant on {joints_in_words(worse.tolist())}: check that the log is of this robot, "
                "and what its torque columns hold (oed check)"
            )
        # Share of the torques within the band below which a joint is said to be outside.
        outside = np.flatnonzero((self.band_coverage < 0.5) & ~(self.relative_spread > 1.0)) + 1
        if len(outside):
            lines.append(
                f"  most torques of {joints_in_words(outside.tolist())} are outside the band: this log shows what the "
                "fit's logs do not, such as a payload, a mounting, a unit, heat or damage (oed check, oed diagnose)"
            )
        if self.rest is not None:
            lines.append(
                f"  {percent(float(self.rest.mean()))} of the torques are of joints at rest: friction may hold them "
                "with any torque; they do not count in the errors"
            )
        return "\n".join([*lines, *self._extrapolation()])

    def _extrapolation(self) -> list[str]:
        """Says how much of the motion is beyond what the fit has seen."""
        if self.extrapolates is None or not (self.extrapolates.any() or self.beyond):
            return []
        share = percent(float(self.extrapolates.mean()))
        first = f"{share} of the torques extrapolate: the parameters' errors matter more than in any recorded row"
        if not self.extrapolates.any():
            first = "the motion leaves the recorded one, where the parameters' errors matter no more than within it"
        return [f"  {first}", *(f"    {text}" for text in self.beyond)]

    def to_frame(self) -> pd.DataFrame:
        """Gives t, tau1.. as a table, and of a model with a band its limits and where it extrapolates."""
        import pandas as pd

        return pd.DataFrame(self._columns())

    def plot(self, ax: Axes | None = None, *, joint: int = 1) -> Axes:
        """Draws the torque of a joint over time: predicted with its 95 % band, and as logged.

        Args:
            ax: where to draw; a new figure by default.
            joint: counted from 1.

        Raises:
            InputError: a joint that there is not.
        """
        n = self.predicted.shape[1]
        if not 1 <= joint <= n:
            raise InputError("there is no such joint", joint=joint, allowed=f"1 to {n}")
        axes, t, predicted = axes_for(ax, (7, 4)), self.motion.t, self.predicted[:, joint - 1]
        if self.measured is not None:
            axes.plot(t, self.measured[:, joint - 1], linewidth=0.8, color="0.6", label="logged")
        axes.plot(t, predicted, label="predicted")
        if self.band is not None:
            half = self.band[:, joint - 1]
            axes.fill_between(t, predicted - half, predicted + half, alpha=0.3, label="95 % band")
        axes.set_xlabel("time [s]")
        axes.set_ylabel(f"torque of {self.joint_names[joint - 1]} [N m or N]")
        axes.legend()
        return axes

    def save(self, path: str | Path, *, force: bool = False) -> None:
        """Writes CSV or Parquet: t, tau1..taun, and the band: tau1_lower, tau1_upper, tau1_extrapolates (0 or 1) ...

        Args:
            path: the file, ending in .csv or .parquet.
            force: replace a file that is there.

        Raises:
            InputError: the file is there, and force is not given.
        """
        write_table(path, self._columns(), {"content": "predicted joint torques"}, force=force)

    def _columns(self) -> dict[str, Array]:
        joints = range(self.predicted.shape[1])
        columns = {"t": self.motion.t, **{f"tau{j + 1}": self.predicted[:, j] for j in joints}}
        if self.band is not None and self.extrapolates is not None:
            for j in joints:
                columns[f"tau{j + 1}_lower"] = self.predicted[:, j] - self.band[:, j]
                columns[f"tau{j + 1}_upper"] = self.predicted[:, j] + self.band[:, j]
                columns[f"tau{j + 1}_extrapolates"] = self.extrapolates[:, j].astype(float)
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
    check: bool = True,
) -> Prediction:
    """Predicts the torques of a log's motion, which is checked and repaired first (`checked_motion`).

    Args:
        model: an identified model.
        log: positions over time; its torque, if any, is compared with the prediction and not used otherwise. A payload
            or a gravity that it states counts. Where it overlaps in time the logs in which a model's change was found,
            it counts as recorded after them (`clock_shift`).
        thermal: this model with its thermal models: friction falls as the motion heats the joints.
        start: temperatures (z,) of each joint's z zones at first [degC]; ambient temperature by default.
        ambient: ambient temperature where the log does not state it [degC]; each model's by default.
        later: how much later [s] than its own clock says the log counts; by default what `clock_shift` says.
        before: logs of what the robot did before, for a model whose effects keep heat: without any it begins cold.
            With `later` their times are as they count (`warmed`). Beside `thermal`, `start` says what was before.
        check: whether the log passes the gate first.

    Returns:
        The torques at the log's own times, without parts that are too short to be smoothed.

    Raises:
        InputError: another number of joints, too few rows, a motion that the gate refuses; a gravity that needs missing
            parameters; a payload or gravity beside heat; `before` after the motion, or for a model that keeps no heat.
    """
    robot = model.robot
    if log.n != robot.n:
        raise InputError(
            f"{log.n} joints", file=log.metadata.get("file"), allowed=f"{robot.n}, as in the model of {robot.name}"
        )
    cutoff = model.cutoff
    log = as_joint_torque(robot, log) if log.tau is not None or log.current is not None else log
    note_meaning(model, log)
    gate, parts = checked_motion(robot, log) if check else (None, [log])
    log, smoother = joined(parts), smoother_of(model, cutoff)
    smoothed = [smooth(resample(part.t, part.q), smoother) for part in parts]
    motion = Motion.concatenate(smoothed)
    has_torque = log.tau is not None or log.current is not None
    if thermal is None:
        states = (motion.q, motion.dq, motion.ddq)
        if later is None:
            later = clock_shift(model, log)[0]
            before = warmed(model, before, log, later)[0]
        clock = motion.t + later
        earlier = [smooth(resample(own.t, own.q), smoother) for own in before]
        predicted = model.torque(*states, clock, gravity=log.gravity, payload=log.payload, before=earlier)
    else:
        from estimation.thermal.history import surroundings

        require_plain([log], HEAT)
        predicted, _ = thermal.simulate(motion, ambient=surroundings(log, motion.t, ambient), start=start)
    inside = [smoother.inside(part.t) for part in smoothed]
    rest = np.concatenate([_at_rest(*each) for each in zip(parts, smoothed, inside, strict=True)])
    band = band_of_motion(model, motion, log.gravity, rest)
    return Prediction(
        motion=motion,
        predicted=predicted,
        measured=torque_of(robot, log) if has_torque else None,
        joint_names=robot.joint_names,
        band=None if band is None else band[0],
        extrapolates=None if band is None else band[1],
        beyond=beyond_the_recorded(model, motion),
        cutoff=cutoff,
        gate=gate,
        rest=rest if rest.any() else None,
        ends=~np.concatenate(inside),
    )


def _at_rest(part: Log, motion: Motion, inside: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Rows (N, n) at rest, found as a fit finds them; the ends are as the rows next to them."""
    rows = np.flatnonzero(inside)
    speed = np.sqrt(np.mean(motion.dq[rows] ** 2, axis=0))
    found = rows_at_rest(part.t[rows], part.q[rows], speed)
    return found[np.clip(np.arange(len(part.t)) - rows[0], 0, len(rows) - 1)]
