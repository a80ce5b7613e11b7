"""A payload's ten inertial parameters, from a run that carries it and a model of the robot without."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.estimators.base import Array
from estimation.linear_algebra.conic import ConicProgram
from estimation.regressions.moments import Moments
from estimation.regressions.regression_data import CHUNK, FittedRows
from robots.common.errors import InputError, NotIdentifiableError
from robots.consistency import BASIS, normalised_eigenvalues
from robots.geometry.inertia import SIZE
from robots.regressor import TorqueModel
from robots.terms import RigidBody

# A body's smallest pseudo-inertia eigenvalue, in units of the least-squares mass and the arm's size.
EPSILON = 1e-6
# A direction of the ten parameters whose column is this much weaker than the strongest is not seen at all.
UNSEEN = 1e-7


@dataclass(frozen=True, kw_only=True)
class Payload:
    """A payload, rigidly on the last link.

    Attributes:
        parameters: ``m, mPx, mPy, mPz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz`` about the last link's frame (10,).
        covariance: (10, 10), from the residual and, where it was given, the model's own.
        determined: (10,), False where the run does not tell the parameter by itself.
        residual_rms: of the torque with the payload's (n,) [N m or N].
        unloaded_rms: of the torque without it (n,): what the payload explains is the difference.
    """

    parameters: Array
    covariance: Array
    determined: NDArray[np.bool_]
    residual_rms: Array
    unloaded_rms: Array

    @property
    def mass(self) -> float:
        """[kg]."""
        return float(self.parameters[0])

    @property
    def centre(self) -> Array:
        """Centre of mass (3,) in the last link's frame [m]."""
        return self.parameters[1:4] / self.parameters[0]

    @property
    def standard_errors(self) -> Array:
        """(10,), infinite where a parameter is not determined."""
        return np.where(self.determined, np.sqrt(np.diag(self.covariance)), np.inf)

    @property
    def eigenvalues(self) -> Array:
        """Eigenvalues of the normalised pseudo-inertia (4,): all positive for a physically possible body."""
        return normalised_eigenvalues(self.parameters)


def fit_payload(
    model: TorqueModel,
    parameters: Array,
    parts: Sequence[FittedRows],
    *,
    columns: Sequence[int] | None = None,
    covariance: Array | None = None,
    consistent: bool = True,
) -> Payload:
    """Fits what a run's torque has beyond the model without payload: tau - Y pi = Y_last pi_L (Khalil et al. 2007).

    Weighted least squares on the last link's ten columns, the joints weighted by their inverse noise; a second, conic
    fit keeps the payload a body that can exist. Friction that grows with the load is not modelled and biases it.

    Args:
        model: the torque model, with a rigid body.
        parameters: of the robot without payload (p',), those of `columns` where given.
        parts: smoothed motion, torque and mask of the runs with the payload.
        columns: indices of the model's columns that carry a parameter.
        covariance: of the parameters (p', p'), added to the payload's.
        consistent: whether the pseudo-inertia must be positive definite.

    Returns:
        The payload.

    Raises:
        InputError: no runs, a model without links, or parameters of another number.
        NotIdentifiableError: runs in which the last link's parameters make no torque.
    """
    names = [k for k, column in enumerate(model.columns) if column.term == RigidBody().name]
    if not names or not parts:
        raise InputError("no runs with the payload" if names else "the model has no links", allowed="one or more")
    last = names[-SIZE:]
    moments: Moments | None = None
    for part in parts:
        motion = part.motion
        rest = part.tau - model.torque(motion.q, motion.dq, motion.ddq, parameters, columns=columns)
        for start in range(0, len(motion), CHUNK):
            rows = slice(start, start + CHUNK)
            Y = model.regressor(motion.q[rows], motion.dq[rows], motion.ddq[rows], columns=last)
            of = Moments.of(Y, rest[rows], part.mask[rows])
            moments = of if moments is None else moments + of
    assert moments is not None
    values, weights, inverse, seen = _least_squares(moments)
    if consistent and not (normalised_eigenvalues(values) > 0).all():
        values = _nearest_body(moments, weights, values)
    level = moments.level(values)
    noise = inverse @ np.tensordot((weights * level) ** 2, moments.gram, axes=1) @ inverse
    if covariance is not None:
        coupling = np.zeros((SIZE, len(parameters)))  # Y_last' W Y: how the model's own errors enter
        for part in parts:
            motion = part.motion
            for start in range(0, len(motion), CHUNK):
                rows = slice(start, start + CHUNK)
                state = motion.q[rows], motion.dq[rows], motion.ddq[rows]
                loaded = model.regressor(*state, columns=last) * (weights * part.mask[rows])[:, :, None]
                own = model.regressor(*state, columns=columns)
                coupling += np.tensordot(loaded, own, axes=([0, 1], [0, 1]))
        transfer = inverse @ coupling
        noise = noise + transfer @ covariance @ transfer.T
    return Payload(
        parameters=values,
        covariance=noise,
        determined=seen,
        residual_rms=level,
        unloaded_rms=np.sqrt(moments.square / np.maximum(moments.count, 1)),
    )


def _least_squares(moments: Moments) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
    """Minimum-norm weighted least squares: values, weights, inverse of the Gram matrix, and which it determines."""
    weights = np.ones(len(moments.count))
    values, inverse, seen = _minimum_norm(moments, weights)
    for _ in range(2):
        weights = moments.level(values) ** -2
        values, inverse, seen = _minimum_norm(moments, weights)
    return values, weights, inverse, seen


def _minimum_norm(moments: Moments, weights: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
    gram = np.tensordot(weights, moments.gram, axes=1)
    scale = np.sqrt(np.diag(gram))
    if not scale.any():
        raise NotIdentifiableError("the payload does not move in the run", remedy="record a run in which the arm moves")
    # Columns of moments of inertia are weaker than that of the mass, not unseen: each is measured by itself.
    used = np.where(scale > UNSEEN * scale.max(), scale, np.inf)
    lengths, vectors = np.linalg.eigh(gram / used[:, None] / used)
    keep = lengths > UNSEEN * lengths[-1]
    inverse = (vectors[:, keep] / lengths[keep]) @ vectors[:, keep].T / used[:, None] / used
    # A parameter is determined by itself when no direction that the data leave open touches it.
    open_part = (vectors[:, ~keep] ** 2).sum(axis=1)
    return inverse @ (weights @ moments.cross), inverse, (open_part < 1e-6) & np.isfinite(used)


def _nearest_body(moments: Moments, weights: Array, values: Array) -> Array:
    """The body that can exist and fits best."""
    gram = np.tensordot(weights, moments.gram, axes=1)
    # Where the mass itself is open, first moments and inertias say what it is at least.
    second, first = max(float(np.abs(values[4:]).max()), 1e-9), float(np.linalg.norm(values[1:4]))
    mass = max(abs(float(values[0])), first**2 / second, 1e-6)
    length = float(np.sqrt(second / mass))
    scale = mass * np.array([1.0] + [length] * 3 + [length**2] * 6)
    program = ConicProgram(SIZE)
    program.semidefinite(BASIS, -EPSILON * np.eye(4))
    quadratic = gram * scale[:, None] * scale
    quadratic += 1e-7 * np.trace(quadratic) / SIZE * np.eye(SIZE)
    return scale * program.solve(quadratic, -scale * (weights @ moments.cross), "payload")
