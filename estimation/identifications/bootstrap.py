"""The verb: checks an estimate's standard errors by resampling its logs, without a model of the noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import pairwise
from operator import add
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from estimation.identifications.estimate import Estimate
from estimation.linear_algebra.scaled import LEAST_RIDGE, lengths
from estimation.preprocessing import Harmonics
from estimation.regressions.joint_regressor import JointRegressor
from estimation.regressions.moments import Moments
from estimation.regressions.preparation import Prepared, Rows
from estimation.uncertainty.blocks import circular_block_counts
from robots.base_parameters import find_base_parameters
from robots.common.arrays import Array
from robots.common.errors import InputError, NotIdentifiableError
from robots.common.parallel import one_blas_thread, threaded
from robots.common.records import Record
from robots.common.stretches import chunks

if TYPE_CHECKING:
    import pandas as pd


# Quantiles one standard deviation from the middle of a normal distribution: a resample that has lost a direction does
# not distort them.
SPREAD = (0.158655, 0.841345)
METHODS = ("wls", "ols")


@dataclass(frozen=True, kw_only=True, eq=False)
class Bootstrap(Record):
    """The scatter of refits to resampled data.

    Attributes:
        names: of the parameters (b,).
        errors: standard errors (b,) by resampling.
        stated: standard errors (b,) of the estimate.
        determined: which parameters the estimate calls determined (b,).
        values: the refits (R, b).
        kind: what was resampled: ``logs``, ``periods`` or ``blocks``.
        blocks: how many of them the data hold.
    """

    ENTRIES = ("kind", "blocks", "ratio", "names", "bootstrap=errors", "stated", "determined")

    names: tuple[str, ...]
    errors: Array
    stated: Array
    determined: NDArray[np.bool_]
    values: Array
    kind: str
    blocks: int

    @property
    def ratio(self) -> float:
        """Median of the errors by resampling over the stated ones, of the determined parameters; 1 without any."""
        known = self.determined & (self.stated > 0)
        return float(np.median(self.errors[known] / self.stated[known])) if known.any() else 1.0

    def summary(self) -> str:
        """Says what was resampled, and how the two errors compare."""
        return (
            f"{len(self.values)} refits to resampled {self.kind} ({self.blocks} blocks): bootstrap standard errors "
            f"are {self.ratio:.2f} times the stated ones (median of the determined parameters)"
        )

    def to_frame(self) -> pd.DataFrame:
        """Gives a row per parameter: both errors, and whether it is determined."""
        import pandas as pd

        columns = {"bootstrap": self.errors, "stated": self.stated, "determined": self.determined}
        return pd.DataFrame(columns, index=pd.Index(self.names, name="parameter"))


@one_blas_thread()
def bootstrap(estimate: Estimate, *, resamples: int = 500, seed: int = 0) -> Bootstrap:
    """Refits to resampled data, and compares the scatter with the stated standard errors.

    Whole logs are drawn if there are eight or more, whole periods if the motion repeats eight times or more, otherwise
    moving blocks of a thirtieth of the data. The blocks preserve the noise's correlation in time. Normal equations are
    sums over rows, so that a refit is a sum and a solution, without a pass over the data. The refits are those of least
    squares without regularisation, smoothing and weights as the estimate has them. With K blocks the scatter is
    multiplied by sqrt(K / (K - 1)), and is itself uncertain by a share of 1 / sqrt(2 K).

    Args:
        estimate: by ``wls`` or ``ols``, with its recording.
        resamples: how many refits.
        seed: of the draws.

    Returns:
        Both standard errors of each parameter.

    Raises:
        InputError: an estimate of another method or of a log that was read in pieces, or less than two resamples.
        NotIdentifiableError: too little data to be resampled.

    Source: Kuensch, "The jackknife and the bootstrap for general stationary observations", Ann. Stat. 17 (1989).
    """
    if not isinstance(estimate, Estimate):
        raise InputError(f"a {type(estimate).__name__}", allowed="an estimate, which has the logs of its model")
    model, choice = estimate.model, estimate.choice
    method = str(model.provenance.get("method"))
    if method not in METHODS:
        raise InputError(f"an estimate by {method}", allowed=" or ".join(METHODS))
    if resamples < 2:
        raise InputError(f"{resamples} resamples", allowed="2 or more")
    base = find_base_parameters(model.torque_model, gravities=model.gravities)
    prepared = estimate.require_recording().prepared
    rows = [log.rows(choice.smoother) for log in prepared]
    kind, pieces, moving = _pieces(prepared, rows, estimate)
    regressor = JointRegressor(base)
    found = list(threaded(lambda piece: _moments(regressor, *piece), pieces))
    total = reduce(add, found)
    weights = 1.0 / total.level(model.values) ** 2 if method == "wls" else np.ones(model.robot.n)
    gram = np.array([np.tensordot(weights, part.gram, axes=1) for part in found])
    cross = np.array([weights @ part.cross for part in found])
    values = _refits(gram, cross, moving, resamples, np.random.default_rng(seed))
    count = max(len(found) // moving, 2)
    low, high = np.quantile(values, SPREAD, axis=0)
    return Bootstrap(
        names=model.names,
        errors=(high - low) / 2 * np.sqrt(count / (count - 1)),
        stated=model.standard_errors,
        determined=model.determined,
        values=values,
        kind=kind,
        blocks=count,
    )


def _pieces(
    prepared: Sequence[Prepared], rows: Sequence[Rows], estimate: Estimate
) -> tuple[str, list[tuple[Rows, slice]], int]:
    """What is drawn: its kind, its rows, and how many consecutive pieces make a block."""
    # Fewer blocks than this say too little of a spread.
    least = 8
    if len(rows) >= least:
        return "logs", [(part, slice(0, len(part.motion))) for part in rows], 1
    smoother = estimate.choice.smoother
    periods = [smoother.period if isinstance(smoother, Harmonics) else log.period for log in prepared]
    cut: list[tuple[Rows, slice]] = []
    for part, period in zip(rows, periods, strict=True):
        t = part.motion.t
        whole = round((t[-1] - t[0]) / period) if period else 0
        if period and whole:
            # Smoothing takes the ends; what is left of the last period goes with it: each row counts once.
            bounds = [*np.searchsorted(t, t[0] + period * np.arange(whole)).tolist(), len(t)]
            cut += [(part, slice(first, stop)) for first, stop in pairwise(bounds)]
    if all(periods) and len(cut) >= least:
        return "periods", cut, 1
    total = sum(len(part.motion) for part in rows)
    # A log without a period is cut into so many cells.
    size = -(-total // 120)
    cells = [(part, at) for part in rows for at in chunks(len(part.motion), size)]
    # Blocks of a log without a period are so many consecutive cells.
    moving = 4
    if len(cells) < least * moving:
        raise NotIdentifiableError("too few rows for a bootstrap", remedy="record a longer log")
    return "blocks", cells, moving


def _moments(regressor: JointRegressor, part: Rows, piece: slice) -> Moments:
    motion = part.motion
    sums = []
    for rows in chunks(piece.stop - piece.start):
        at = slice(piece.start + rows.start, piece.start + rows.stop)
        states = (motion.q[at], motion.dq[at], motion.ddq[at])
        sums.append(regressor.moments(*states, part.tau[at], part.mask[at], part.gravity))
    return reduce(add, sums)


def _refits(gram: Array, cross: Array, moving: int, resamples: int, rng: np.random.Generator) -> Array:
    """Solutions (R, b) of sums of drawn blocks, each of `moving` consecutive pieces, in a circle."""
    scale = lengths(gram.sum(axis=0))
    gram, cross = gram / scale[:, None] / scale, cross / scale
    # A resample may have lost a direction.
    faint = LEAST_RIDGE * np.eye(len(scale))
    values = np.empty((resamples, len(scale)))
    for k, counts in enumerate(circular_block_counts(len(gram), moving, resamples, rng)):
        values[k] = np.linalg.solve(np.tensordot(counts, gram, axes=1) + faint, counts @ cross) / scale
    return values
