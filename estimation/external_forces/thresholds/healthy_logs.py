"""What healthy logs say of the residual: error model, threshold, levels of the localisation, and a check of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from estimation.external_forces.localisation import fit_localiser
from estimation.external_forces.options import Velocity
from estimation.external_forces.residuals.filters import time_constant
from estimation.external_forces.residuals.friction_levels import contact_weight
from estimation.external_forces.residuals.signals import SETTLING_CONSTANTS, Signals
from estimation.external_forces.thresholds.alarm_rates import alarm_threshold
from estimation.external_forces.thresholds.calibrations import Calibration
from estimation.external_forces.thresholds.error_models import fit_error_model
from estimation.external_forces.thresholds.observations import lag_of, observe, observe_robustly
from estimation.external_forces.thresholds.rate_checks import RateCheck
from estimation.models.model import Model
from estimation.uncertainty.quantiles import robust_deviation
from robots.common.arrays import Array, Flags
from robots.common.errors import InputError
from robots.common.stretches import joined_spans

# Rows that stand for a longer log: for the levels of the localisation, and where a repeated motion is sought.
MOST_HEALTHY_ROWS = 20_000


def calibrate_signals(
    model: Model,
    healthy: Sequence[Signals],
    *,
    bandwidth: float,
    velocity: Velocity,
    false_alarms: float,
    own: bool = False,
    in_fit: bool = False,
) -> Calibration:
    """Learns the settings from logs of a healthy robot.

    The peaks that make the threshold are those of new motions (`first_visits`): a motion that repeats shows the same
    error of the model again.

    Args:
        model: the identified model.
        healthy: signals of the logs.
        bandwidth: of the observer [Hz].
        velocity: what velocities the signals have.
        false_alarms: an hour.
        own: whether the logs may contain contacts: those are left out, until nothing changes.
        in_fit: whether the model was fitted to these logs, so that they say nothing new about its parameters.

    Raises:
        InputError: too little data.
    """
    whole = _joined(healthy)
    new = first_visits(whole.t, whole.q, whole.dq)
    seconds = 0.0 if in_fit else whole.period * int(new.sum())
    lag = lag_of(whole, bandwidth)
    # The filter begins with zero, and its first moments know little of the residual.
    settled = _since(whole) > SETTLING_CONSTANTS * time_constant(bandwidth)
    counts = settled.copy()
    if not (counts & new).any():
        raise InputError(
            f"the healthy log of {whole.t[-1] - whole.t[0]:.3g} s is too short for the observer to settle",
            remedy="give a longer healthy log with --healthy: a minute or more",
        )
    noise = np.median(whole.velocity_noise, axis=0)
    for number in range(8 if own else 1):
        first = own and number == 0
        residual = lag(whole.external, from_zero=True)
        # Contacts are not known at first: they must not enter the size of the errors.
        fitted = _winsorised(residual, settled) if first else residual
        errors = fit_error_model(
            model,
            fitted,
            whole.dq,
            whole.friction,
            whole.variance,
            counts,
            lag,
            seconds=seconds,
            velocity_noise=noise,
        )
        seen = observe(whole, errors.seen, bandwidth)
        statistic, deviation = seen.statistic, seen.deviation
        threshold = alarm_threshold(statistic[counts & new], whole.period, false_alarms, robust=first)
        reach = max(round(SETTLING_CONSTANTS * time_constant(bandwidth) / whole.period), 1)
        kept = settled & ~_near(statistic > threshold.value, reach)
        if (kept == counts).all():
            break
        if own:
            counts = kept
            whole = whole.levelled(contact_weight(statistic / threshold.value))
    rows = np.flatnonzero(counts)[:: max(1, int(counts.sum()) // MOST_HEALTHY_ROWS)]
    spread = errors.covariance(deviation[rows])
    localiser = fit_localiser(model.robot.chain, whole.q[rows], residual[rows], spread, whole.jacobian[rows])
    return Calibration(
        bandwidth=bandwidth,
        velocity=velocity,
        period=whole.period,
        errors=errors,
        threshold=threshold,
        localiser=localiser,
        friction_square=np.maximum((whole.friction**2).mean(axis=0), np.finfo(float).tiny),
        own=own,
    )


def check_rate(
    model: Model, healthy: Sequence[Signals], calibration: Calibration, *, in_fit: bool = False
) -> RateCheck:
    """Counts false alarms in each half of the healthy logs by the threshold of the other half.

    Only motion counts that the other half has not shown.

    Args:
        model: the identified model.
        healthy: signals of the logs.
        calibration: by all of them.
        in_fit: as for `calibrate_signals`.
    """
    rate, alarms, seconds = calibration.threshold.rate, 0, 0.0
    halves = _halves(healthy)
    for own, other in (halves, halves[::-1]):
        try:
            found = calibrate_signals(
                model, other, bandwidth=calibration.bandwidth, velocity=calibration.velocity, false_alarms=rate,
                in_fit=in_fit,
            )  # fmt: skip
        except InputError:
            # Too few peaks for a threshold.
            continue
        whole = _joined([*other, *own])
        new = first_visits(whole.t, whole.q, whole.dq)
        flags = np.split(new, np.cumsum([len(part.t) for part in [*other, *own]])[:-1])[len(other) :]
        for part, fresh in zip(own, flags, strict=True):
            _, observed = observe_robustly(part, found)
            counts = fresh & (_since(part) > found.memory)
            seconds += part.period * int(counts.sum())
            beyond = (observed.statistic > found.threshold.value) & counts
            alarms += len(joined_spans(beyond, part.t, found.memory))
    return RateCheck(alarms=alarms, hours=seconds / 3600.0, rate=rate)


def _halves(parts: Sequence[Signals]) -> tuple[list[Signals], list[Signals]]:
    """Two halves of the logs, or of the one log."""
    if len(parts) > 1:
        return list(parts[: len(parts) // 2]), list(parts[len(parts) // 2 :])
    whole = parts[0]
    middle = len(whole.t) // 2
    return [_rows(whole, slice(0, middle))], [_rows(whole, slice(middle, None))]


def _rows(signals: Signals, rows: slice) -> Signals:
    changed = {f.name: getattr(signals, f.name)[rows] for f in fields(Signals)}
    changed["begins"] = np.concatenate([[True], changed["begins"][1:]])
    return replace(signals, **changed)


def _winsorised(residual: Array, counts: Flags) -> Array:
    """Cuts residuals (N, n) off at three robust standard deviations."""
    # Where the first round cuts residuals off, in standard deviations.
    level = 3.0 * robust_deviation(residual[counts])
    return np.clip(residual, -level, level)


def _since(signals: Signals) -> Array:
    """Time (N,) since the observer began [s]."""
    starts = np.flatnonzero(signals.begins)
    return signals.t - signals.t[starts[np.cumsum(signals.begins) - 1]]


def _near(marked: Flags, reach: int) -> Flags:
    """Marks samples within `reach` samples of marked ones."""
    return np.convolve(marked.astype(float), np.ones(2 * reach + 1), mode="same") > 0.5


def _joined(parts: Sequence[Signals]) -> Signals:
    """One after the other, on one clock that goes on."""
    if len(parts) == 1:
        return parts[0]
    arrays = {f.name: np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Signals)}
    step, times, end = parts[0].period, [], 0.0
    for part in parts:
        times.append(part.t - part.t[0] + end)
        end = float(times[-1][-1]) + step
    return Signals(**{**arrays, "t": np.concatenate(times)})


def first_visits(t: Array, q: Array, dq: Array) -> NDArray[np.bool_]:
    """Marks the samples (N,) whose positions and velocities no sample of an earlier time had.

    The model's error is a function of the motion. A motion that repeats shows it again, and says nothing new about it.

    Args:
        t: times (N,) [s], on one clock.
        q: positions (N, n).
        dq: velocities (N, n).
    """
    state = np.concatenate([q, dq], axis=1)
    spread = state.std(axis=0)
    # A joint whose velocity varies less than this [rad/s or m/s] rests.
    moves = np.tile(dq.std(axis=0) > 1e-6, 2)
    new = np.ones(len(t), dtype=bool)
    if not moves.any():
        return new
    step = -(-len(t) // MOST_HEALTHY_ROWS)
    points = state[::step, moves] / spread[moves]
    # A motion may repeat after 5 s, and a log is split into at most fifty times.
    length = max(5.0, float(t[-1] - t[0]) / 50)
    block = ((t[::step] - t[0]) // length).astype(int)
    seen = np.zeros(len(points), dtype=bool)
    for number in range(2, int(block[-1]) + 1):
        earlier, own = points[(block < number - 1) & ~seen], np.flatnonzero(block == number)
        if len(earlier) and len(own):
            # Distance in each position and velocity, in their standard deviations, below which a motion is the same
            # one.
            distance, _ = cKDTree(earlier).query(points[own], p=np.inf, distance_upper_bound=0.2)
            seen[own] = np.isfinite(distance)
    new &= ~np.repeat(seen, step)[: len(t)]
    return new
