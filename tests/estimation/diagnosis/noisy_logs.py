"""Recordings of joints at rest, and coloured noise that is correlated between two joints."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from estimation.diagnosis.recordings.recording import Recording

STEP = 0.004


def recording_of(rows: int = 10_000, n: int = 2, unsure: np.ndarray | None = None) -> Recording:
    """Builds a recording with zero motion and torque, for given numbers of rows and joints."""
    zero = np.zeros((rows, n))
    return Recording(
        t=STEP * np.arange(rows),
        starts=(0,),
        q=zero,
        dq=zero,
        ddq=zero,
        tau=zero,
        step=STEP,
        cycles=(None,),
        cutoff=50.0,
        floor=np.full(n, 1e-20),
        sign_unknown=np.zeros((rows, n), dtype=bool) if unsure is None else unsure,
        sign_known_from_velocity=np.zeros((rows, n), dtype=bool),
        reversal_acceleration_error=np.zeros(n),
        names=("log",),
    )


def noise_of(rows: int, seed: int = 0) -> np.ndarray:
    """Draws noise (rows, 2), half of it AR(1) and half white; the second joint's contains some of the first's."""
    rng = np.random.default_rng(seed)
    white = rng.standard_normal((rows, 2))
    coloured = lfilter([np.sqrt(1 - 0.9**2)], [1, -0.9], rng.standard_normal((rows, 2)), axis=0)
    mixed = (white + coloured) * [2.0, 0.5]
    mixed[:, 1] += 0.1 * mixed[:, 0]
    return mixed
