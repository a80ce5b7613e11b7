"""Contacts: samples beyond the threshold, joined to one event for one push, with time, force and place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.external_forces.localisation import Place
from estimation.external_forces.residuals.signals import Signals
from estimation.external_forces.thresholds.calibrations import Calibration
from estimation.external_forces.thresholds.observations import Observed
from estimation.external_forces.wrenches import tool_load
from estimation.uncertainty.quantiles import NORMAL_95
from robots.common.arrays import Array
from robots.common.records import Record
from robots.common.stretches import joined_spans
from robots.geometry.chain import Chain


@dataclass(frozen=True, kw_only=True, eq=False)
class Contact(Record):
    """One contact.

    Attributes:
        detected: when the statistic passed the threshold [s].
        start: when the torque began [s], the most likely time.
        end: when it ended [s].
        peak: largest statistic over the threshold.
        peak_time: when that is [s].
        force: mean force at the tool, in the base frame, if there is no moment (3,) [N].
        covariance: of it (3, 3) [N2], by noise and by the model's error.
        torque: mean external joint torque (n,) [N m or N].
        place: where it acts.
        extrapolates: whether the model extrapolates at that time.
    """

    ENTRIES = (
        "detected",
        "start",
        "end",
        "peak_over_threshold=peak",
        "peak_time",
        "force",
        "force_standard_deviation=force_deviation",
        "force_covariance=covariance",
        "magnitude",
        "magnitude_standard_deviation=magnitude_deviation",
        "magnitude_interval95=magnitude_interval",
        "torque",
        "link=place.link",
        "reacting_joints=place.reacting",
        "tool=place.tool",
        "extrapolates",
    )

    detected: float
    start: float
    end: float
    peak: float
    peak_time: float
    force: Array
    covariance: Array
    torque: Array
    place: Place
    extrapolates: bool

    @property
    def force_deviation(self) -> Array:
        """Standard deviation of the force's components (3,) [N]."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def magnitude(self) -> float:
        """Size of the mean force [N]."""
        return float(np.linalg.norm(self.force))

    @property
    def magnitude_deviation(self) -> float:
        """Standard deviation of the size [N]; infinite where the joints do not feel some direction."""
        if not np.isfinite(self.covariance).all():
            return float("inf")
        along = self.force / max(self.magnitude, np.finfo(float).tiny)
        return float(np.sqrt(max(float(along @ self.covariance @ along), 0.0)))

    @property
    def magnitude_interval(self) -> tuple[float, float]:
        """95 % interval of the size [N]."""
        half = NORMAL_95 * self.magnitude_deviation
        return max(self.magnitude - half, 0.0), self.magnitude + half


def find_contacts(
    chain: Chain, signals: Signals, observed: Observed, calibration: Calibration
) -> tuple[NDArray[np.bool_], tuple[Contact, ...]]:
    """Finds the contacts of a log.

    Args:
        chain: the robot's joints.
        signals: of the log.
        observed: the same, filtered and scaled.
        calibration: of a healthy robot.

    Returns:
        Where (N,) a contact is detected: from when the statistic passes the threshold until it has been below for the
        observer's memory. And the contacts: exceedances closer than that belong to one.
    """
    beyond, t = observed.statistic > calibration.threshold.value, signals.t
    runs = joined_spans(beyond, t, calibration.memory)
    flagged = np.zeros(len(t), dtype=bool)
    for first, last in runs:
        flagged[first : int(np.searchsorted(t, t[last - 1] + calibration.memory, side="right"))] = True
    return flagged, tuple(_contact(chain, signals, observed, calibration, *run) for run in runs)


def _contact(
    chain: Chain, signals: Signals, observed: Observed, calibration: Calibration, first: int, last: int
) -> Contact:
    errors = calibration.errors
    peak = first + int(np.argmax(observed.statistic[first:last]))
    covariance = errors.covariance(observed.deviation[peak])
    start, end = _window(signals, observed, calibration, first, last, peak, covariance)
    rows = slice(start, end)
    # The first and the last step hold a part of the contact only.
    inner = slice(start + 1, end - 1) if end - start > 2 else rows
    torque = signals.external[inner].mean(axis=0)
    # As the torque, the mean of each step: a fast arm turns within one.
    before = slice(max(inner.start - 1, 0), max(inner.stop - 1, 1))
    jacobian = (signals.jacobian[inner, :3].mean(axis=0) + signals.jacobian[before, :3].mean(axis=0)) / 2.0
    # The filter's noise is that of a mean over two time constants; the model's error is alike over the contact.
    shorter = max(2.0 * calibration.constant / (signals.period * (inner.stop - inner.start)), 1.0)
    mean = shorter * errors.covariance(observed.deviation[inner]).mean(axis=0)
    force, spread = tool_load(torque[None], mean[None], jacobian[None])
    place = calibration.localiser.locate(
        chain, signals.q[peak], observed.residual[peak], covariance, signals.jacobian[peak]
    )
    # Each step's torque is the mean since the sample before.
    return Contact(
        detected=float(signals.t[first]),
        start=float(signals.t[max(start - 1, 0)]),
        end=float(signals.t[end - 1]),
        peak=float(observed.statistic[peak] / calibration.threshold.value),
        peak_time=float(signals.t[peak]),
        force=force[0],
        covariance=spread[0],
        torque=torque,
        place=place,
        extrapolates=bool(signals.extrapolates[rows].any()),
    )


def _window(
    signals: Signals,
    observed: Observed,
    calibration: Calibration,
    first: int,
    last: int,
    peak: int,
    covariance: Array,
) -> tuple[int, int]:
    """Most likely (first, last + 1) of a constant torque in the pattern of the peak, in noise of one level.

    It maximises (sum of the projected torque)^2 / length over all windows about the exceedances.
    """
    around = max(round(calibration.memory / signals.period), 1)
    low, high = max(first - around, 1), min(last + around // 3, len(signals.t))
    weights = np.linalg.solve(covariance, observed.residual[peak])
    series = signals.external[low:high] @ weights
    # Samples that stand for a longer contact where its first and last moment are sought.
    step = max(1, len(series) // 400)
    sums = np.concatenate([[0.0], np.cumsum(series)])[::step]
    lengths = np.arange(len(sums))
    length = lengths[None, :] - lengths[:, None]
    gain = (sums[None, :] - sums[:, None]) * np.sign(series.sum() or 1.0)
    score = np.where((length > 0) & (gain > 0), gain**2 / np.maximum(length, 1), 0.0)
    begin, stop = np.unravel_index(int(np.argmax(score)), score.shape)
    return low + step * int(begin), low + max(step * int(stop), step * int(begin) + 1)
