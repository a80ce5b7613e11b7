"""The body that can exist and suits a least-squares payload."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimation.linear_algebra.conic import ConicProgram
from estimation.linear_algebra.log_determinant import LOG_DETERMINANT_VARIABLES, add_log_determinant
from estimation.linear_algebra.scaled import floored_inverse
from estimation.uncertainty.quantiles import chi2_limit
from robots.common.arrays import Array
from robots.consistency import BASIS, normalised_eigenvalues, pseudo_inertia
from robots.geometry.inertia import BODY_PARAMETERS, inertial_parameters


@dataclass(frozen=True, kw_only=True)
class PhysicalBody:
    """A body that can exist.

    Attributes:
        parameters: (10,), the most plausible body.
        nearest: (10,), the one that fits best.
        distance: squared distance of least squares from the nearest body, in standard deviations.
    """

    parameters: Array
    nearest: Array
    distance: float

    @property
    def contradicted(self) -> bool:
        """Whether least squares lie farther from all bodies than chance explains."""
        # The probability with which least squares of a real payload lie farther from all bodies.
        return self.distance > chi2_limit(1e-3, BODY_PARAMETERS)


def physical_body(values: Array, covariance: Array) -> PhysicalBody:
    """Finds the most plausible body of a payload.

    ``min (p - v)' C^-1 (p - v) / 2 + D(p, p_0)`` over bodies with a positive definite pseudo-inertia. D is the entropic
    distance (Lee, Wensing, Park 2020, 10.1109/TRO.2019.2926491) to a ball p_0 of the same mass and centre. Where the
    log determines a parameter, D does not matter; moments of inertia that it leaves open are those of the ball.

    Args:
        values: least squares v (10,), with a positive mass.
        covariance: C of the values (10, 10).
    """
    reference = ball(values)
    mass, length = reference[0], _size(reference)
    scale = mass * np.array([1.0] + [length] * 3 + [length**2] * 6)
    precision = floored_inverse(covariance)
    quadratic = precision * scale[:, None] * scale
    wanted = -quadratic @ (values / scale)

    program = ConicProgram(BODY_PARAMETERS)
    # Smallest eigenvalue of a pseudo-inertia, in units in which the reference body has a unit mass and a unit size.
    margin = 1e-6
    program.semidefinite(BASIS, -margin * np.eye(4))
    nearest = values
    if not (normalised_eigenvalues(values) > margin).all():
        nearest = scale * program.solve(quadratic, wanted, "payload")
    off = nearest - values

    full = ConicProgram(BODY_PARAMETERS + LOG_DETERMINANT_VARIABLES)
    weighted, linear = np.zeros((full.size, full.size)), np.zeros(full.size)
    weighted[:BODY_PARAMETERS, :BODY_PARAMETERS], linear[:BODY_PARAMETERS] = quadratic, wanted
    # The distance to that body counts as much as what its own parameters scatter by.
    linear[:BODY_PARAMETERS] += np.tensordot(BASIS, np.linalg.inv(pseudo_inertia(reference / scale)), axes=2)
    add_log_determinant(full, linear, range(BODY_PARAMETERS), BODY_PARAMETERS, 1.0)
    plausible = scale * full.solve(weighted, linear, "payload")[:BODY_PARAMETERS]
    return PhysicalBody(parameters=plausible, nearest=nearest, distance=float(off @ precision @ off))


def ball(values: Array) -> Array:
    """Gives the parameters (10,) of a ball of usual density with the mass and centre of mass of parameters (10,)."""
    mass = float(values[0])
    # Mean density of tools and workpieces with their hollows [kg/m3]: the size of a body whose shape is unknown.
    radius = (3 * mass / (4 * np.pi * 700.0)) ** (1 / 3)
    return inertial_parameters(mass, values[1:4] / mass, 0.4 * mass * radius**2 * np.eye(3), np.eye(4))


def _size(parameters: Array) -> float:
    """Radius of gyration about the frame's origin [m]."""
    return float(np.sqrt(np.trace(pseudo_inertia(parameters)[:3, :3]) / parameters[0]))
