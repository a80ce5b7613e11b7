"""Payloads, forces, comparisons, weeks of the monitor, and thermal fits on virtual robots."""

from __future__ import annotations

import json
import tempfile
from dataclasses import asdict
from pathlib import Path
from typing import Any

from benchmarks import comparison, forces, monitoring, payloads, thermal
from estimation.thermal import fit_thermal

# Of a model: the robot is an input, and covariances act on the standard errors.
INPUTS = frozenset({"robot", "terms", "covariance"})


def run_payloads(kind: str, seed: int) -> dict[str, Any]:
    """Identifies three payloads of one robot in two ways."""
    return {f"{one.mass:g} kg, {one.way}": asdict(one) for one in payloads.run((kind, seed))}


def run_forces(seed: int) -> dict[str, Any]:
    """Detects pushes on one robot, with and without heat."""
    return forces.run_seed(seed)


def run_comparison(seed: int, damaged: int | None) -> dict[str, Any]:
    """Compares two runs of one robot; one joint may have 10 % more friction in the second one."""
    return comparison.pair(seed, True, damaged).to_dict()


def run_week(number: int, stops: bool) -> dict[str, Any]:
    """Identifies a robot's plain and thermal model, and monitors a week of it."""
    with tempfile.TemporaryDirectory() as folder:
        return monitoring.week(Path(folder), number, stops=stops)


def run_campaign(seed: int) -> dict[str, Any]:
    """Identifies a robot's thermal model from a warm-up campaign."""
    with tempfile.TemporaryDirectory() as folder:
        monitoring.trained(Path(folder), seed)
        found = json.loads((Path(folder) / f"robot{seed}.json").read_text())
    return {name: {key: model[key] for key in model if key not in INPUTS} for name, model in found.items()}


def run_thermal(order: str, seed: int) -> dict[str, Any]:
    """Fits a thermal model to runs of known truth."""
    return fit_thermal(thermal.experiment(seed), order=order, alpha=thermal.TRUTH["alpha"]).to_dict()
