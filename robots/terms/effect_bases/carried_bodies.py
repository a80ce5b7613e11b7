"""Bodies that a robot picks up or puts down: the one that explains a torque best, and how it may vary."""

from __future__ import annotations

from itertools import product

import clarabel
import numpy as np
from scipy import sparse

from robots.common.arrays import Array
from robots.consistency import BASIS, inertial_from_pseudo, pseudo_inertia

# Coordinates [m] of the centres of mass at which a search starts, about the flange. Finer ones change no result.
_COORDINATES = (-0.4, -0.15, -0.05, 0.0, 0.05, 0.15, 0.4)
# Length [m] that makes kg, kg m and kg m2 comparable: the size of a tool.
TOOL_LENGTH = 0.1


def _point_masses(centres: Array) -> Array:
    """Gives the parameters (N, 10) of unit masses at centres (N, 3) [m]."""
    homogeneous = np.column_stack([centres, np.ones(len(centres))])
    return inertial_from_pseudo(homogeneous[:, :, None] * homogeneous[:, None, :])


_CENTRES = np.array(list(product(_COORDINATES, repeat=3)))
_UNITS = _point_masses(_CENTRES)
# Factors that turn the parameters into kg.
_UNIT = TOOL_LENGTH ** -np.array([0.0, 1, 1, 1, 2, 2, 2, 2, 2, 2])
_UPPER = tuple((i, j) for j in range(4) for i in range(j + 1))
_CONE = sparse.csc_matrix([[-BASIS[k][i, j] * (1.0 if i == j else np.sqrt(2.0)) for k in range(10)] for i, j in _UPPER])
_KIND = [clarabel.PSDTriangleConeT(4)]
_SETTINGS = clarabel.DefaultSettings()
_SETTINGS.verbose = False


def nearest_point_mass(matrix: Array, target: Array) -> Array:
    """Finds the point mass, of either sign, that minimises ``|matrix @ parameters - target|``.

    For a given centre the mass is linear. The centre is searched from the best of a grid, by Gauss-Newton steps.

    Args:
        matrix: (k, 10), see `robots.consistency.pseudo_inertia` for the order.
        target: (k,).

    Returns:
        Its parameters (10,); negative ones of a mass that was put down.
    """
    images = _UNITS @ matrix.T
    norms = np.maximum(np.einsum("nk,nk->n", images, images), np.finfo(float).tiny)
    masses = images @ target / norms
    gains = masses**2 * norms
    starts = {int(np.argmax(np.where(sign * masses > 0, gains, -1.0))) for sign in (1.0, -1.0)}
    fits = [_refined(matrix, target, masses[k] * _UNITS[k]) for k in starts]
    return min(fits, key=lambda parameters: float(np.sum((matrix @ parameters - target) ** 2)))


def _refined(matrix: Array, target: Array, parameters: Array) -> Array:
    """Moves a point mass (10,) by Gauss-Newton steps until they gain little."""
    left = target - matrix @ parameters
    cost = float(left @ left)
    # Gauss-Newton steps of a centre of mass.
    for _ in range(30):
        if not parameters[0]:
            break
        step = np.linalg.lstsq(matrix @ point_mass_tangent(parameters), left, rcond=None)[0]
        for halving in range(8):
            share = 0.5**halving
            centre = parameters[1:4] / parameters[0] + share * step[1:]
            trial = (parameters[0] + share * step[0]) * _point_masses(centre[None])[0]
            remaining = target - matrix @ trial
            if (reached := float(remaining @ remaining)) < cost:
                break
        else:
            break
        gained, parameters, left, cost = cost - reached, trial, remaining, reached
        # They end when the gain in chi-square, or its share, is below 1e-6.
        if gained < 1e-6 * (1.0 + cost):
            break
    return parameters


def nearest_body(matrix: Array, target: Array) -> Array:
    """Finds the rigid body, picked up or put down, that minimises ``|matrix @ parameters - target|``.

    Its pseudo-inertia is positive semidefinite, or negative if it was put down: two small semidefinite programmes.

    Args:
        matrix: (k, 10), see `robots.consistency.pseudo_inertia` for the order.
        target: (k,).

    Returns:
        Its parameters (10,).
    """
    scaled = matrix / _UNIT
    gram = scaled.T @ scaled
    # Added in all directions: one that the data do not contain stays small.
    gram += 1e-12 * max(float(np.trace(gram)), np.finfo(float).tiny) * np.eye(len(gram))
    cross = scaled.T @ target
    fits = [_solve(gram, sign * cross) * sign for sign in (1.0, -1.0)]
    return np.asarray(min(fits, key=lambda x: float(x @ gram @ x - 2.0 * x @ cross)) / _UNIT)


def _solve(gram: Array, cross: Array) -> Array:
    """Minimises x' gram x / 2 - cross' x over the bodies x (10,), in scaled units."""
    size = max(float(np.abs(np.diag(gram)).max()), np.finfo(float).tiny)
    # The bounds of the numbers do not depend on units: the solver's tolerances are absolute ones, too.
    length = max(float(np.abs(cross).max()) / size, np.finfo(float).tiny)
    solver = clarabel.DefaultSolver(
        sparse.triu(gram / size, format="csc"), -cross / (size * length), _CONE, np.zeros(10), _KIND, _SETTINGS
    )
    values, vectors = np.linalg.eigh(pseudo_inertia(np.asarray(solver.solve().x) * length))
    # An interior-point solution may lie outside of the cone by the solver's tolerance.
    return inertial_from_pseudo((vectors * np.maximum(values, 0.0)) @ vectors.T)


def is_body(parameters: Array) -> bool:
    """Whether parameters (10,) are those of a body, picked up or put down, up to rounding."""
    sign = np.sign(parameters[0])
    values = np.linalg.eigvalsh(sign * pseudo_inertia(parameters * _UNIT))
    return bool(sign and values[0] >= -1e-9 * values[-1])


def point_mass_tangent(parameters: Array) -> Array:
    """Gives the derivatives (10, 4) of a point mass by its mass and centre.

    Args:
        parameters: (10,) of a point mass that is not zero.
    """
    mass, centre = parameters[0], parameters[1:4] / parameters[0]
    homogeneous = np.append(centre, 1.0)
    changes = [np.outer(homogeneous, homogeneous)]
    for axis in range(3):
        unit = np.eye(4)[axis]
        changes.append(mass * (np.outer(unit, homogeneous) + np.outer(homogeneous, unit)))
    return np.asarray(inertial_from_pseudo(np.array(changes)).T)


def point_mass_rows(parameters: Array) -> Array:
    """Gives the rows (6, 10) that take a body's moments of inertia about its own centre, over their usual size.

    That is a third of the mass times the squared distance of the centre, as of a rod that begins at the flange.

    Args:
        parameters: (10,) of a point mass that is not zero.
    """
    mass, centre = parameters[0], parameters[1:4] / parameters[0]
    size = abs(mass) * max(float(centre @ centre), TOOL_LENGTH**2) / 3.0
    own = np.vstack([np.zeros((4, 6)), size * np.eye(6)])
    return np.asarray(np.linalg.inv(np.hstack([point_mass_tangent(parameters), own]))[4:])


__all__ = ["is_body", "nearest_body", "nearest_point_mass", "point_mass_rows", "point_mass_tangent"]
