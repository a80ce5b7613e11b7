"""Estimates, their errors and bands: on measured logs and on virtual robots, by every estimator."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import estimators
from benchmarks.transfer_parts import splits, virtual
from benchmarks.transfer_parts.splits import Split
from estimation import Estimate, Prediction, identify, predict
from robots import simulate
from robots.plants import Sensors

VIRTUAL = (0, 1, 2)
# Covariances act on the standard errors, and on the band of a prediction.
LARGE = frozenset({"band_covariance"})
CHOSEN = ("low_pass", "ridge", "velocity_scales", "position", "held_out", "spread", "cost")


def of_estimate(estimate: Estimate) -> dict[str, Any]:
    """What an estimate states."""
    model = estimate.model.to_dict()
    provenance = {name: value for name, value in model["provenance"].items() if name not in LARGE}
    return {
        "parameters": model["parameters"],
        "provenance": provenance,
        "choice": {name: _plain(getattr(estimate.choice, name)) for name in CHOSEN},
        "smoother": repr(estimate.choice.smoother),
        "joints": [asdict(joint) for joint in estimate.joints],
        "white_noise_errors": estimate.white_noise_errors.tolist(),
        "predicted_rms": np.sqrt(np.mean(estimate.predicted**2, axis=0)).tolist(),
        "samples": estimate.samples,
        "dropped_rows": estimate.dropped_rows,
    }


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else value


def of_prediction(prediction: Prediction) -> dict[str, Any]:
    """What a prediction states, joint by joint."""
    band, beyond = prediction.band, prediction.extrapolates
    return {
        "error_rms": prediction.error_rms.tolist(),
        "nrmse": prediction.nrmse.tolist(),
        "band_limited_spread": prediction.band_limited_spread.tolist(),
        "band": None if band is None else band.mean(axis=0).tolist(),
        "band_coverage": prediction.band_coverage.tolist(),
        # A row at the edge itself is on either side by rounding.
        "extrapolates": None if beyond is None else beyond.mean(axis=0).round(2).tolist(),
        "cutoff": prediction.cutoff,
    }


def run_splits(name: str, folder: Path) -> dict[str, Any]:
    """Identifies and predicts the splits of one published set."""
    return {split.name: _run(split) for split in splits.SETS[name](folder)}


def run_virtual(kind: str, seed: int) -> dict[str, Any]:
    """Identifies a virtual robot from a slow and from the full motion, and predicts the full one."""
    return {split.name: _run(split) for split in virtual.slowed(kind, seed)}


def _run(split: Split) -> dict[str, Any]:
    estimate = identify(split.robot, list(split.fit), check=False)
    return {**of_estimate(estimate), **of_prediction(predict(estimate.model, split.test))}


def run_estimator(robot: str, method: str) -> dict[str, Any]:
    """Identifies a virtual robot with one estimator."""
    plant = estimators.plant_of(robot, Sensors())
    log, unseen = (simulate(plant, estimators.fourier_motion(plant.robot, seed), seed=seed) for seed in (0, 1))
    estimate = identify(plant.robot, log, method=method)
    return {**of_estimate(estimate), **of_prediction(predict(estimate.model, unseen))}


def tasks() -> Iterator[tuple[str, int]]:
    """Virtual robots."""
    for seed in VIRTUAL:
        for kind in virtual.KINDS:
            yield kind, seed
