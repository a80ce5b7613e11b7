"""A merged estimate of all runs: inverse-covariance weights, with the scatter between runs as random effects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimation.comparisons.common_parameters import CommonParameters
from estimation.comparisons.differences import parts_of
from estimation.comparisons.runs import Run
from estimation.models.model import Model
from robots.common.arrays import Array
from robots.version import VERSION


@dataclass(frozen=True, kw_only=True)
class MergedModel:
    """The merged estimate.

    Attributes:
        model: that `oed predict` takes.
        scatter: standard deviation between runs of each parameter (b,) beyond their errors.
        notes: limitations.
    """

    model: Model
    scatter: Array
    notes: tuple[str, ...]


def merge(runs: Sequence[Run], common: CommonParameters) -> MergedModel:
    """Merges the runs.

    x = (sum W_i)^-1 sum W_i x_i with W_i = (C_i + T)^-1. T is diagonal: the variance between runs by DerSimonian and
    Laird's moments, parameter by parameter within the parts that differ, zero where runs agree. The covariance is
    (sum W_i)^-1, widened by what runs share: the prior's pull does not average out.

    Args:
        runs: the runs; the first gives robot and terms.
        common: their parameters in its basis.

    Source:
        DerSimonian and Laird 1986.
    """
    x, C = common.values, common.covariances
    tau = np.zeros(x.shape[1])
    for members in parts_of(common).values():
        tau[members] = between_run_variance(x[:, members], np.einsum("kii->ki", C[:, members][:, :, members]))
    scale = np.sqrt(np.maximum(np.einsum("kii->ki", C).mean(axis=0) + tau, np.finfo(float).tiny))
    W = np.array([_inverse((c + np.diag(tau)) / scale[:, None] / scale) for c in C])
    total = _inverse(W.sum(axis=0))
    origin = x.mean(axis=0)
    values = origin + scale * (total @ np.einsum("kij,kj->i", W, (x - origin) / scale))
    covariance = total * scale[:, None] * scale
    covariance, notes = _with_shared_prior(runs, common, (covariance + covariance.T) / 2)
    first = runs[0].model
    determined = np.any([_determined(run.model, first) for run in runs], axis=0)
    model = Model(
        torque_model=first.torque_model,
        columns=first.columns,
        values=values,
        covariance=covariance,
        determined=determined,
        formulas=first.formulas,
        provenance=_provenance(runs, np.sqrt(tau)),
    )
    return MergedModel(model=model, scatter=np.sqrt(tau), notes=notes)


def between_run_variance(values: Array, variances: Array) -> Array:
    """Variance between runs (d,) of each parameter beyond its errors, by DerSimonian and Laird; zero where they agree.

    Args:
        values: (k, d).
        variances: squared standard errors (k, d).
    """
    safe = np.where(variances > 0, variances, np.inf)
    w = np.where(np.isfinite(safe), 1 / safe, 0.0)
    total = w.sum(axis=0)
    good = total > 0
    total = np.where(good, total, 1.0)
    mean = (w * values).sum(axis=0) / total
    Q = (w * (values - mean) ** 2).sum(axis=0)
    scale = total - (w**2).sum(axis=0) / total
    excess = Q - (len(values) - 1)
    return np.asarray(np.where(good & (scale > 0), np.maximum(excess / np.where(scale > 0, scale, 1.0), 0.0), 0.0))


def _inverse(matrix: Array) -> Array:
    return np.asarray(np.linalg.pinv((matrix + matrix.T) / 2, rcond=1e-12, hermitian=True), dtype=float)


def _with_shared_prior(
    runs: Sequence[Run], common: CommonParameters, covariance: Array
) -> tuple[Array, tuple[str, ...]]:
    """Widens a covariance of independent runs by the prior's pull, which all runs have alike."""
    first, notes, shares = runs[0].model, [], []
    variance = np.einsum("kii->ki", common.covariances)
    unknown = [run.label for run in runs if _prior_share(run.model, first) is None]
    for run in runs:
        share = _prior_share(run.model, first)
        shares.append(np.ones(variance.shape[1]) if share is None else share)
    if unknown:
        notes.append(
            f"{', '.join(unknown)}: the model does not state how much of its errors the prior makes; the merged "
            "standard errors are not made smaller than those of single runs. Identify the logs again."
        )
    pulled = np.array(shares) * variance
    independent = np.diag(covariance)
    # What is left of the noise after averaging, and the pull at its mean size, in full.
    share = pulled.sum(axis=0) / np.maximum(variance.sum(axis=0), np.finfo(float).tiny)
    wanted = independent * (1 - share) + pulled.mean(axis=0)
    factor = np.sqrt(np.maximum(wanted, independent) / np.maximum(independent, np.finfo(float).tiny))
    return covariance * factor[:, None] * factor, tuple(notes)


def _prior_share(model: Model, first: Model) -> Array | None:
    share = model.provenance.get("prior_share")
    return None if share is None else np.asarray(share, dtype=float)[_order(model, first)]


def _determined(model: Model, first: Model) -> NDArray[np.bool_]:
    return np.asarray(model.determined[_order(model, first)], dtype=bool)


def _order(model: Model, first: Model) -> list[int]:
    position = {name: i for i, name in enumerate(model.names)}
    return [position[name] for name in first.names]


def _provenance(runs: Sequence[Run], scatter: Array) -> dict[str, Any]:
    """Provenance of the merged model: bands of the run with the widest ones, ranges of all runs."""
    known = [run.model.provenance for run in runs]
    banded = [p for p in known if p.get("band95") is not None]
    widest = max(banded, key=lambda p: float(np.mean(p["band95"])), default=known[0])
    found = {key: value for key, value in widest.items() if key not in ("prior_share", "recorded", "logs")}
    for key in ("band95", "residual_rms", "held_out_rms", "noise_floor", "torque_rms"):
        rows = [p[key] for p in known if p.get(key) is not None]
        if len(rows) == len(known):
            combine = np.mean if key == "torque_rms" else np.max
            found[key] = combine(np.array(rows, dtype=float), axis=0).tolist()
    ranges = [p["recorded"] for p in known if p.get("recorded")]
    if len(ranges) == len(known):
        found["recorded"] = {
            "position": [
                np.min([r["position"][0] for r in ranges], axis=0).tolist(),
                np.max([r["position"][1] for r in ranges], axis=0).tolist(),
            ],
            "velocity": [np.max([r["velocity"][0] for r in ranges], axis=0).tolist()],
            "acceleration": [np.max([r["acceleration"][0] for r in ranges], axis=0).tolist()],
        }
    merged = {"runs": [run.label for run in runs], "scatter_between_runs": scatter.tolist(), "tool_version": VERSION}
    logs = [log for p in known for log in p.get("logs", ())]
    return found | {"method": f"merged from {len(runs)} runs", "logs": logs, "merged": merged}
