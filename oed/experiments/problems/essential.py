"""The base parameters that a criterion judges, where it leaves the others out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from oed.experiments.problems.problem import FourierProblem
from robots.base_parameters import BaseParameters
from robots.common.errors import InputError


def essential_part(problem: FourierProblem, share: float) -> BaseParameters:
    """Keeps the base parameters whose torque matters by the robot's description (thesis section 1.3).

    One matters when, on random motions within the limits, the RMS of its own torque exceeds a share of the torque's RMS
    on at least one joint.

    Args:
        problem: over all base parameters.
        share: 0 to below 1.

    Returns:
        The base parameters that are left.

    Raises:
        InputError: a share out of range, a description that lacks nominal parameters, or no parameter left.
    """
    if not 0 <= share < 1:
        raise InputError(f"the threshold of essential parameters is {share}", allowed="0 to below 1")
    base = problem.base
    nominal = base.model.require_description("the choice of essential parameters")
    rng = np.random.default_rng(0)
    # Random motions on which the shares are measured: enough that every joint moves in all of its range and speed.
    drawn = [problem.shrunk(rng.normal(size=problem.size), 0.95, halvings=6) for _ in range(20)]
    q, dq, ddq = (np.concatenate(part) for part in zip(*map(problem.limit_states, drawn), strict=True))
    kept = base.essential(q, dq, ddq, base.from_standard(nominal), share)
    if not kept:
        raise InputError(f"no parameter reaches the threshold {share}", remedy="use a smaller threshold")
    return restricted(base, kept)


def restricted(base: BaseParameters, kept: Sequence[int]) -> BaseParameters:
    """Takes some of the base parameters; the others count as zero."""
    rows = list(kept)
    return replace(base, independent=tuple(base.independent[row] for row in rows), grouping=base.grouping[rows])
