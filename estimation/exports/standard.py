"""Standard parameters for an identified model: bodies that can exist, nearest to the robot's description."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from estimation.linear_algebra.conic import ConicProgram
from estimation.models.model import Model
from estimation.regressions.parameter_priors import link_spreads
from robots.base_parameters import find_base_parameters
from robots.common.arrays import Array
from robots.common.errors import InfeasibleError, InputError
from robots.consistency import BASIS, normalised_eigenvalues
from robots.geometry.inertia import BODY_PARAMETERS

# Smallest eigenvalue of a pseudo-inertia, in units of the link's own mass and reach.
BODY_MARGIN = 1e-6
REMEDY = "identify with --method consistent, which fits physically possible bodies"


def standard_parameters(model: Model, inertia: Array | None = None) -> Array:
    """Gives inertial parameters of all links that make the model's rigid-body torque.

    Base parameters leave directions open. Where the fit itself chose standard parameters, those are given; otherwise
    the ones nearest to the description, in units of each link's mass and reach, among bodies with a positive definite
    pseudo-inertia (Wensing, Kim, Slotine 2018) that have exactly these base parameters.

    Args:
        model: an identified model.
        inertia: the description to stay near to (n, 10); by default the robot's own.

    Returns:
        (n, 10) ``m, mPx, mPy, mPz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz`` about the link frames.

    Raises:
        InputError: no description to stay near to.
        InfeasibleError: no body that can exist has these base parameters.
    """
    known = np.asarray(model.robot.inertia if inertia is None else inertia, dtype=float)
    chosen = _chosen(model)
    if chosen is not None:
        return chosen[0]
    # Parameters grouped with a rotor's inertia stay with the link, because a URDF has no rotors.
    grouping, values, _ = rigid_grouping(model, known)
    return _nearest(grouping, values, known)


def standard_and_rotors(model: Model, inertia: Array, rotor_inertia: Array) -> tuple[Array, Array]:
    """Gives inertial parameters of all links and rotor inertias that make the model's torque together.

    A rotor's inertia that only occurs in sums with a link's stays as described, if bodies that can exist make up the
    rest; otherwise the link gets it. See `standard_parameters` for the other choices.

    Args:
        model: an identified model.
        inertia: the description to stay near to (n, 10).
        rotor_inertia: the described rotor inertias at the joints (n,).

    Returns:
        (n, 10) parameters about the link frames, and (n,) rotor inertias at the joints; those are 0 in a model without
        rotors, and may be negative where the data made them so.

    Raises:
        InputError: no description to stay near to.
        InfeasibleError: no body that can exist has these base parameters.
    """
    chosen = _chosen(model)
    if chosen is not None:
        return chosen
    grouping, values, grouped = rigid_grouping(model, inertia)
    n = model.robot.n
    joints = [int(column.joint or 1) - 1 for column in model.torque_model.columns if column.term == "rotor_inertia"]
    found = np.zeros(n)
    for column, value in zip(model.parameters, model.values, strict=True):
        if column.term == "rotor_inertia" and column.joint is not None:
            found[column.joint - 1] = value
    open_ = [k for k, joint in enumerate(joints) if grouped[:, k].any() and rotor_inertia[joint] > 0.0]
    if open_:
        described = np.asarray([rotor_inertia[joints[k]] for k in open_], dtype=float)
        with suppress(InfeasibleError):
            links = _nearest(grouping, values - grouped[:, open_] @ described, inertia)
            found[[joints[k] for k in open_]] = described
            return links, found
    return _nearest(grouping, values, inertia), found


def _chosen(model: Model) -> tuple[Array, Array] | None:
    """The standard parameters that the fit itself chose: links (n, 10), rotors (n,)."""
    chosen = model.provenance.get("standard_parameters")
    if chosen is None:
        return None
    values, n = np.asarray(chosen, dtype=float), model.robot.n
    columns, rotors = model.torque_model.columns, np.zeros(n)
    for column, value in zip(columns, values, strict=True):
        if column.term == "rotor_inertia" and column.joint is not None:
            rotors[column.joint - 1] = value
    return values[[i for i, column in enumerate(columns) if column.term == "rigid_body"]].reshape(
        n, BODY_PARAMETERS
    ), rotors


def rigid_grouping(model: Model, described: Array) -> tuple[Array, Array, Array]:
    """Gives how links make up the rigid base parameters, their values, and how rotor inertias enter.

    Args:
        model: an identified model.
        described: the description (n, 10), which must be there.

    Returns:
        (b, 10 n), (b,) and (b, r) for the r rotors of the model.

    Raises:
        InputError: no description, or parameters that are not the robot's base parameters.
    """
    torque_model = model.torque_model
    if not np.isfinite(described).all():
        raise InputError(
            (
                f"{model.robot.name}: the robot's description states no inertial parameters, which are needed to "
                f"complete the identified ones"
            ),
            remedy=REMEDY,
        )
    base = find_base_parameters(torque_model, gravities=model.gravities)
    if base.independent != model.columns:
        raise InputError("the model's parameters are not the robot's base parameters", remedy="identify it again")
    own = [i for i, column in enumerate(base.columns) if column.term == "rigid_body"]
    rigid = [i for i, column in enumerate(torque_model.columns) if column.term == "rigid_body"]
    rotors = [i for i, column in enumerate(torque_model.columns) if column.term == "rotor_inertia"]
    return base.grouping[np.ix_(own, rigid)], model.values[own], base.grouping[np.ix_(own, rotors)]


def _nearest(grouping: Array, values: Array, described: Array) -> Array:
    """Minimises |(pi - described) / spread|^2 with grouping pi = values and every pseudo-inertia positive definite."""
    n = len(described)
    spread = link_spreads(described)
    scaled = grouping * spread.reshape(-1)
    start = described / spread
    unit = np.maximum(np.abs(scaled).max(axis=1), np.finfo(float).tiny)
    program = ConicProgram(BODY_PARAMETERS * n)
    program.equal(scaled / unit[:, None], -values / unit)
    semidefinite_bodies(program, spread, BODY_PARAMETERS * n, BODY_MARGIN)
    try:
        found = program.solve(np.eye(BODY_PARAMETERS * n), -start.reshape(-1), "standard parameters")
    except InfeasibleError as error:
        raise InfeasibleError(
            "no physically possible bodies have the identified base parameters", remedy=REMEDY
        ) from error
    # Onto the base parameters to the last digit: the solver stops at some 1e-8.
    found = found + scaled.T @ np.linalg.solve(scaled @ scaled.T, values - scaled @ found)
    standard = np.asarray(found.reshape(n, BODY_PARAMETERS) * spread)
    if not (normalised_eigenvalues(standard) > 0).all():
        raise InfeasibleError("no physically possible bodies have the identified base parameters", remedy=REMEDY)
    return standard


def semidefinite_bodies(program: ConicProgram, spread: Array, size: int, margin: float) -> None:
    """Demands that the pseudo-inertias of all links are positive definite.

    Args:
        program: its first 10 n variables are the inertial parameters in units of `spread`.
        spread: (n, 10) units, see `link_spreads`.
        size: number of the program's variables.
        margin: smallest eigenvalue, in units of the link's mass and reach.
    """
    for link in range(len(spread)):
        basis = np.zeros((size, 4, 4))
        place = slice(BODY_PARAMETERS * link, BODY_PARAMETERS * (link + 1))
        # A congruence by mass and reach makes the units of the matrix one, and keeps its signs.
        scale = np.array([1.0, 1.0, 1.0, spread[link, 1] / spread[link, 0]]) / np.sqrt(spread[link, 4])
        basis[place] = BASIS * spread[link][:, None, None] * scale[:, None] * scale
        program.semidefinite(basis, -margin * np.eye(4))
