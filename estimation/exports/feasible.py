"""The model nearest to an identified one whose links are bodies that can exist."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimation.exports.standard import BODY_MARGIN, rigid_grouping, semidefinite_bodies
from estimation.linear_algebra.conic import ConicProgram
from estimation.models.model import Model
from estimation.regressions.parameter_priors import link_spreads
from robots.common.arrays import Array

NEAREST = (
    "no bodies that can exist have exactly the identified inertial parameters; those of the nearest ones differ by up "
    "to {:.2g} standard errors"
)
"""Remark of a file whose model was moved."""


def nearest_feasible(model: Model, inertia: Array, rotor_inertia: Array) -> tuple[Model, float]:
    """Moves the base parameters to those of bodies that can exist, by as little as their covariance allows.

    With the change d of the rigid-body parameters it minimises ``d' C^-1 d``, C their covariance. Friction, rotors and
    offsets follow by their covariance with them.

    Args:
        model: an identified model.
        inertia: the description (n, 10), which decides what the data leave open.
        rotor_inertia: described rotor inertias (n,), for those that only occur in sums with a link's inertia.

    Returns:
        The model, and the largest change of a determined parameter in standard errors.

    Raises:
        InputError: no description.
        SolverError: the solver gave up.
    """
    grouping, values, grouped = rigid_grouping(model, inertia)
    rotors = [int(c.joint or 1) - 1 for c in model.torque_model.columns if c.term == "rotor_inertia"]
    own = np.array([column.term == "rigid_body" for column in model.parameters])
    rest = values - grouped @ np.asarray(rotor_inertia, dtype=float)[rotors]
    spread = link_spreads(inertia)
    scaled = grouping * spread.reshape(-1)
    # Ten times the margin that `standard_parameters` demands, so that its own search has an interior.
    return nearest_within_errors(
        model,
        own,
        scaled,
        rest,
        (inertia / spread).reshape(-1),
        lambda program: semidefinite_bodies(program, spread, program.size, 10.0 * BODY_MARGIN),
        "bodies that can exist",
    )


def nearest_within_errors(
    model: Model,
    own: NDArray[np.bool_],
    scaled: Array,
    rest: Array,
    start: Array,
    constrain: Callable[[ConicProgram], None],
    what: str,
) -> tuple[Model, float]:
    """Moves base parameters to those of standard parameters x that obey constraints, by as little as errors allow.

    With the change d = scaled x - rest it minimises ``d' C^-1 d``, C the covariance of the moved parameters. The others
    follow by their covariance with them.

    Args:
        model: an identified model.
        own: which of its b parameters are moved; c of them.
        scaled: makes them of x (c, k), whose units are those of links.
        rest: what they are (c,), less what x does not make.
        start: x by the description (k,), which decides what the data leave open.
        constrain: adds the constraints to a program of k + c variables, x first.
        what: is solved for, for messages.

    Returns:
        The model, and the largest change of a determined parameter in standard errors.

    Raises:
        InfeasibleError: no parameters obey the constraints.
        SolverError: the solver gave up.
    """
    determined, covariance = model.determined[own], model.covariance[np.ix_(own, own)]
    error = np.sqrt(np.diag(covariance))
    # What is not determined may be anything within the sizes of links.
    error = np.where(determined & (error > 0.0), error, np.abs(scaled).sum(axis=1))
    correlation = np.where(np.outer(determined, determined), covariance / np.outer(error, error), np.eye(len(error)))
    # Keeps a correlation matrix definite against rounding.
    correlation = correlation + 1e-9 * np.eye(len(error))
    whiten = np.linalg.inv(np.linalg.cholesky(correlation)) / error
    count, free = scaled.shape
    program = ConicProgram(free + count)
    rows = np.hstack([whiten @ scaled, -np.eye(count)])
    unit = np.maximum(np.abs(rows).max(axis=1), 1.0)
    program.equal(rows / unit[:, None], -(whiten @ rest) / unit)
    constrain(program)
    # The description decides what the data leave open: a weak prior, in units of each link's mass and reach.
    weights = np.concatenate([np.full(free, 1e-2), np.ones(count)])
    found = program.solve(np.diag(weights), -weights * np.concatenate([start, np.zeros(count)]), what)
    change = scaled @ found[:free] - rest
    moved = np.array(model.values)
    moved[own] += change
    cross = model.covariance[np.ix_(~own, own)] / error
    moved[~own] += cross @ np.linalg.solve(correlation, change / error)
    return replace(model, values=moved), float(np.abs(change / error)[determined].max(initial=0.0))
