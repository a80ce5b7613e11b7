"""The model nearest to an identified one whose links are bodies that can exist."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimation.exports.standard import MARGIN, rigid_grouping, semidefinite_bodies
from estimation.linear_algebra.conic import ConicProgram
from estimation.models.model import Model
from estimation.regressions.parameter_priors import link_spreads
from robots.geometry.inertia import SIZE

Array = NDArray[np.float64]

ROOM = 10.0  # of the margin that `standard_parameters` demands, so that its own search has an interior
PRIOR = 1e-2  # weight of the description, in units of each link's mass and reach: it decides what the data leave open
FLOOR = 1e-9  # of a correlation matrix, against rounding


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
    error = np.sqrt(np.diag(model.covariance)[own])
    # What is not determined may be anything within the sizes of links.
    error = np.where(model.determined[own] & (error > 0.0), error, np.abs(scaled).sum(axis=1))
    correlation = np.where(
        np.outer(model.determined[own], model.determined[own]),
        model.covariance[np.ix_(own, own)] / np.outer(error, error),
        np.eye(len(error)),
    )
    whiten = np.linalg.inv(np.linalg.cholesky(correlation + FLOOR * np.eye(len(error)))) / error
    n, count = len(inertia), len(values)
    size = SIZE * n + count
    program = ConicProgram(size)
    rows = np.hstack([whiten @ scaled, -np.eye(count)])
    unit = np.maximum(np.abs(rows).max(axis=1), 1.0)
    program.equal(rows / unit[:, None], -(whiten @ rest) / unit)
    semidefinite_bodies(program, spread, size, ROOM * MARGIN)
    start = np.concatenate([(inertia / spread).reshape(-1), np.zeros(count)])
    weights = np.concatenate([np.full(SIZE * n, PRIOR), np.ones(count)])
    found = program.solve(np.diag(weights), -weights * start, "bodies that can exist")
    change = scaled @ found[: SIZE * n] - rest
    moved = np.array(model.values)
    moved[own] += change
    cross = model.covariance[np.ix_(~own, own)] / error
    moved[~own] += cross @ np.linalg.solve(correlation + FLOOR * np.eye(len(error)), change / error)
    known = model.determined[own]
    return replace(model, values=moved), float(np.abs(change / error)[known].max(initial=0.0))
