"""Shares of a residual that are noise, that repeat with the motion, and that change with time."""

from __future__ import annotations

import numpy as np

from estimation.diagnosis.hypothesis_tests.problem import Problem
from robots.common.arrays import Array

# Number of repetitions below which a log is not split.
FEWEST = 3
# Frequency below which differences between repetitions may count as a change with time [cycles per period].
SLOW = 3.0


def residual_shares(problem: Problem) -> Array:
    """Splits the squared residual of the base model by its repetition with the motion.

    The mean over P repetitions contains the repeating part and 1/P of the noise power. Differences between repetitions
    are noise, except at the lowest frequencies. Power there that exceeds the noise level at the next higher
    frequencies is a change with time.

    Args:
        problem: data, with the residual of the base model.

    Returns:
        Shares (n, 3): noise, repeating with the motion, changing with time; NaN if no log repeats three times.
    """
    recording = problem.recording
    totals, states, times = (np.zeros(recording.n) for _ in range(3))
    for run, cycle in zip(recording.runs, recording.cycles, strict=True):
        if cycle is None or cycle.count < FEWEST:
            continue
        # Rows with unknown friction sign have an error that repeats with the motion but is no effect.
        own = (problem.base_residual[run] * ~recording.sign_unknown[run])[cycle.start : cycle.stop]
        period = cycle.period / recording.step
        mean = period_mean(own, period, cycle.count)
        differences = period_differences(own, period, cycle.count)
        noise = (differences**2).sum(axis=0)
        repeated = (mean**2).sum(axis=0) - noise / cycle.count
        power = np.abs(np.fft.rfft(differences, axis=0)) ** 2 / len(own) * 2
        f = np.fft.rfftfreq(len(own)) * period
        slow, beside = (f > 0) & (f < SLOW), (f >= SLOW) & (f < 3 * SLOW)
        excess = power[slow].sum(axis=0) - np.median(power[beside], axis=0) / np.log(2) * slow.sum()
        totals += (own**2).sum(axis=0)
        states += np.maximum(repeated, 0.0)
        times += np.clip(excess, 0.0, noise)
    if not totals.any():
        return np.full((recording.n, 3), np.nan)
    safe = np.maximum(totals, 1e-300)
    state, time = np.clip(states / safe, 0, 1), np.clip(times / safe, 0, 1)
    return np.column_stack([np.clip(1 - state - time, 0, 1), state, time])


def period_differences(series: Array, period: float, count: int) -> Array:
    """Subtracts the mean over repetitions, and corrects for the variance that this removes.

    Args:
        series: signal r (M, n).
        period: period [samples], not necessarily an integer.
        count: number of repetitions P.

    Returns:
        (r - mean) sqrt(P / (P - 1)), (M, n).
    """
    return (series - period_mean(series, period, count)) * np.sqrt(count / (count - 1))


def period_mean(series: Array, period: float, count: int) -> Array:
    """Computes the mean over repetitions at each row.

    Args:
        series: signal (M, n).
        period: period [samples], not necessarily an integer.
        count: number of repetitions.

    Returns:
        The mean of the rows with the same phase, to within one sample (M, n).
    """
    rows = len(series)
    samples = max(1, round(period))
    phase = np.floor(np.mod(np.arange(rows) + 1e-6, period) / period * samples).astype(int) % samples
    hits = np.bincount(phase, minlength=samples)
    mean = np.stack([np.bincount(phase, column, samples) for column in series.T], axis=1) / np.maximum(hits, 1)[:, None]
    return np.asarray(mean[phase])
