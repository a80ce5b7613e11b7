"""Decimation of recordings: torque and discontinuous model terms pass the same low-pass."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise

import numpy as np
from scipy.ndimage import maximum_filter1d
from scipy.signal import firwin, upfirdn

from estimation.diagnosis.recordings.recording import Recording
from estimation.preprocessing import Cycle
from robots.common.arrays import Array, Flags
from robots.common.stretches import spans

# Half-length of the low-pass before decimation, in rows after decimation: unknown torque in some rows must not ring far
# beyond them. `WINDOW` is the parameter beta of its Kaiser window, which attenuates aliases to about a hundredth.
REACH, WINDOW = 2, 3.4
# Three samples in a row within this share of the largest torque are a flat top.
FLAT = 1e-6


def decimate(series: Array, starts: Sequence[int], stride: int) -> Array:
    """Low-passes rows (N, ...) of logs that begin at `starts`, without delay, and keeps each `stride`-th of a log."""
    runs = [series[start:stop] for start, stop in pairwise((*starts, len(series)))]
    return np.concatenate([low_pass_rows(run, stride, stride) for run in runs])


def decimate_recording(finer: Recording, stride: int) -> Recording:
    """Low-passes and decimates a recording; `full_rate` of the result is the given recording."""
    rows = np.concatenate([np.arange(run.start, run.stop, stride) for run in finer.runs])
    width = 2 * stride + 1

    def near(flags: Array | Flags) -> Array:
        spread = [maximum_filter1d(np.asarray(flags[run], dtype=float), width, axis=0) for run in finer.runs]
        return np.concatenate(spread)[rows]

    unsure = near(finer.sign_unknown) > 0
    passed = keep_clipped_level(
        finer.tau, np.concatenate([low_pass_rows(finer.tau[run], stride) for run in finer.runs])
    )
    lengths = [-(-(run.stop - run.start) // stride) for run in finer.runs]
    return replace(
        finer,
        t=finer.t[rows],
        starts=tuple(int(start) for start in np.cumsum([0, *lengths[:-1]])),
        q=finer.q[rows],
        dq=finer.dq[rows],
        ddq=finer.ddq[rows],
        tau=passed[rows],
        step=stride * finer.step,
        cycles=tuple(None if cycle is None else _cycle(cycle, stride, finer.step) for cycle in finer.cycles),
        sign_unknown=unsure,
        sign_known_from_velocity=unsure & ~(near(finer.sign_unknown & ~finer.sign_known_from_velocity) > 0),
        reversal_time_error=None if finer.reversal_time_error is None else near(finer.reversal_time_error),
        position_residual=None,
        cutoffs=None,
        full_rate=finer,
    )


def shift_motion(recording: Recording, by: float) -> Recording:
    """Delays the motion of a recording by a time [s], to match torque that is logged late by that time."""
    if by == 0.0:
        return recording
    moved: dict[str, Array] = {}
    for name in ("q", "dq", "ddq"):
        values = getattr(recording, name)
        moved[name] = np.empty_like(values)
        for run in recording.runs:
            t = recording.t[run]
            at = np.clip(t - by, t[0], t[-1])
            moved[name][run] = np.column_stack([np.interp(at, t, x) for x in values[run].T])
    finer = None if recording.full_rate is None else shift_motion(recording.full_rate, by)
    return replace(recording, **moved, full_rate=finer)  # type: ignore[arg-type]


def evaluate_at_full_rate(recording: Recording, evaluate: Callable[[Recording], Array]) -> Array:
    """Evaluates rows (N, ...) on a recording, at the full rate if that is known, then decimated like the torque."""
    if recording.full_rate is None:
        return evaluate(recording)
    return decimate(evaluate(recording.full_rate), recording.full_rate.starts, recording.stride)


def low_pass_rows(series: Array, ratio: float, kept: int = 1) -> Array:
    """Low-passes rows (N, ...) of one log, without delay, for a sample period `ratio` times as long.

    Returns:
        Every `kept`-th row.
    """
    half = int(np.ceil(REACH * ratio))
    taps = _low_pass(half, ratio)
    # Beyond its ends a log is continued by point reflection.
    beyond = np.pad(series, ((half, half), *((0, 0),) * (series.ndim - 1)), mode="reflect", reflect_type="odd")
    first = 2 * half // kept
    return np.asarray(upfirdn(taps, beyond, down=kept, axis=0))[first : first + -(-len(series) // kept)]


@lru_cache(maxsize=16)
def _low_pass(half: int, ratio: float) -> Array:
    return np.asarray(firwin(2 * half + 1, min(1.0 / ratio, 0.99), window=("kaiser", WINDOW)))


def keep_clipped_level(tau: Array, passed: Array) -> Array:
    """Restores flat tops of torque (N, n) after a low-pass: a drive at its limit delivers no more."""
    result = passed.copy()
    for own, column in zip(result.T, tau.T, strict=True):
        most = float(np.abs(column).max(initial=0.0))
        flat = [slice(a, b) for a, b in spans(np.abs(column) >= (1.0 - FLAT) * most) if b - a >= 3]
        if flat:
            np.clip(own, -most, most, out=own)
        for rows in flat:
            own[rows] = column[rows]
    return result


def _cycle(cycle: Cycle, stride: int, step: float) -> Cycle:
    start, stop = -(-cycle.start // stride), cycle.stop // stride
    return Cycle(start, stop, cycle.period, int((stop - start) * stride * step / cycle.period + 0.1))
