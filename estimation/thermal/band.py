"""How far torques predicted with heat are off: the half-widths that hold 95 % of a campaign's errors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimation.preprocessing import resample, smooth
from estimation.regressions.preparation import torque_of
from estimation.thermal.runs.condensed import Condensed
from estimation.thermal.torque import ThermalTorqueModel
from estimation.uncertainty.quantiles import band_of

Array = NDArray[np.float64]

# Of so many rows the 95 % quantile is known to a percent.
ROWS = 100_000


def error_band(model: ThermalTorqueModel, condensed: Condensed, factors: Sequence[Array]) -> list[float]:
    """Measures the 95 % quantile of the torque's error on rows of all logs.

    They are rows of the fit: a campaign has thousands a parameter.

    Args:
        model: the fitted model.
        condensed: its logs and their bins.
        factors: friction over that at T0 in each bin, (B,) by joint.

    Returns:
        Half-widths (n,) [N m or N].
    """
    cutoff = float(model.model.provenance.get("cutoff_hz", 10.0))
    stride = max(1, sum(len(log) for log in condensed.logs) // ROWS)
    errors = []
    for k, log in enumerate(condensed.logs):
        motion, tau = smooth(resample(log.t, log.q), cutoff), torque_of(model.model.robot, log)
        t, edges = motion.t[::stride], condensed.edges[k]
        part = slice(int(condensed.offsets[k]), int(condensed.offsets[k + 1]))
        middles = (edges[1:] + edges[:-1]) / 2.0
        factor = np.stack([np.interp(t, middles, values[part]) for values in factors], axis=-1)
        rigid, cold = model.split(motion.q[::stride], motion.dq[::stride], motion.ddq[::stride])
        errors.append(np.abs(tau[::stride] - rigid - factor * cold))
    return band_of(np.concatenate(errors)).tolist()
