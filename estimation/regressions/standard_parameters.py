"""Standard parameters under constraints: physical bounds, and a description as reference."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.regressions.moments import Moments
from estimation.regressions.regression_data import RegressionData
from robots.base_parameters import BaseParameters
from robots.common.arrays import Array
from robots.consistency import inertial_from_pseudo, pseudo_inertia
from robots.geometry.inertia import BODY_PARAMETERS
from robots.geometry.usual_arms import usual_body
from robots.regressor import TorqueModel
from robots.robot import Robot

# Speeds, as shares of the largest, at which friction must not drive the joint, and from which on it must not fall.
SPEEDS = np.linspace(0.0, 1.0, 13)


@dataclass(frozen=True)
class Scaling:
    """Units in which every parameter is of the order of one.

    Attributes:
        reference: per link a body that can exist, towards which the fit is regularised (n, 10).
        described: per link, whether the reference is the description's (n,).
        scale: of all standard parameters (p,): a parameter is its scale times a number.
        bodies: column indices of each link's ten parameters (n, 10); empty (0, 10) without a rigid body.
    """

    reference: Array
    described: NDArray[np.bool_]
    scale: Array
    bodies: NDArray[np.intp]

    @property
    def unit_reference(self) -> Array:
        """The reference in these units (n, 10)."""
        return np.asarray(self.reference / self.scale[self.bodies])


def scaling(data: RegressionData) -> Scaling:
    """Chooses units for the model's standard parameters from the description, or from the data where there is none."""
    model = data.base.model
    reference, described = reference_bodies(model.robot, mass_from_torque(model.robot, _largest_torque(data)))
    bodies = body_columns(model)
    rows = np.maximum(data.moments.count, 1)
    torque = np.sqrt(np.maximum(data.moments.square / rows, np.finfo(float).tiny))
    level = column_levels(data.base, data.moments)
    own = torque[[column.joint - 1 for column in model.columns]]
    scale = np.divide(own, level, out=own.copy(), where=level > 0)
    for link, columns in enumerate(bodies):
        mass, length = _size(reference[link])
        scale[columns] = mass * np.array([1.0] + [length] * 3 + [length**2] * 6)
    return Scaling(reference[: len(bodies)], described[: len(bodies)], scale, bodies)


def column_levels(base: BaseParameters, moments: Moments) -> Array:
    """RMS of every standard column on the joint of its own (p,), zero where the data do not move it.

    A column that others span acts as its share of them does, so that no unit is needed for it.
    """
    levels = np.zeros(base.model.size)
    for k, column in enumerate(base.model.columns):
        joint, part = column.joint - 1, base.grouping[:, k]
        square = float(part @ moments.gram[joint] @ part)
        largest = float((part**2) @ np.diag(moments.gram[joint]))
        # A column whose share of those that span it cancels to this part of their squares does not act.
        levels[k] = np.sqrt(square / max(moments.count[joint], 1)) if square > 1e-12 * largest else 0.0
    return levels


def body_columns(model: TorqueModel) -> NDArray[np.intp]:
    """Finds each link's ten parameters among the model's columns (n, 10), (0, 10) where it has no rigid body."""
    found = [k for k, column in enumerate(model.columns) if column.term == "rigid_body"]
    return np.array(found, dtype=np.intp).reshape(-1, BODY_PARAMETERS)


def reference_bodies(robot: Robot, mass: float) -> tuple[Array, NDArray[np.bool_]]:
    """Gives a physically possible body per link: the description's, corrected if degenerate, or a plausible one.

    Exporters write tiny masses for links without material. Such placeholders are no description.

    Args:
        robot: the robot.
        mass: of an arm without description [kg].

    Returns:
        Parameters (n, 10), and whether the description states them (n,).
    """
    inertia = np.asarray(robot.inertia, dtype=float)
    joints = robot.chain.joints
    ends = [joint.translation for joint in joints[1:]] + [robot.chain.tip[:3, 3]]
    lengths = np.array([float(np.linalg.norm(end)) for end in ends])
    arm = max(float(lengths.sum()), float(np.linalg.norm(joints[0].translation)), 0.1)
    bodies = np.empty((robot.n, BODY_PARAMETERS))
    described = np.isfinite(inertia).all(axis=1) & (inertia[:, 0] > 0)
    masses = np.where(described, inertia[:, 0], 0.0)
    # Placeholders: all links of a description that together weigh less than a tenth of what the torques suggest, and a
    # link below a thousandth of the heaviest one.
    described &= (masses > 1e-3 * masses.max()) & (masses.sum() > 0.1 * mass)
    for link in range(robot.n):
        if described[link]:
            bodies[link] = _corrected_body(inertia[link], 0.01 * arm)
        else:
            bodies[link] = usual_body(mass / robot.n, ends[link], arm)
    return bodies, described


def nonnegative_rows(model: TorqueModel, speed: Array) -> Array:
    """Lists quantities that must not be negative: rotor inertias, Coulomb and viscous friction, and the total friction.

    Friction brakes at every speed that was seen, and does not fall from the middle of that range on. Its further
    coefficients alone may have either sign, as measured curves that flatten show.

    Args:
        model: the torque model with p standard parameters.
        speed: largest speed of each joint in the data (n,) [rad/s or m/s].

    Returns:
        Rows (m, p), each of which times the parameters must be zero or more.
    """
    single = [
        k
        for k, column in enumerate(model.columns)
        if column.term == "rotor_inertia" or (column.friction and column.symbol in ("f1", "f2"))
    ]
    rows = [np.eye(model.size)[single]]
    curves = np.array([model.friction_at(share * speed) for share in SPEEDS])
    rises = np.diff(curves, axis=0)[SPEEDS[:-1] >= 0.5]
    for joint in range(1, model.robot.n + 1):
        own = np.array([column.friction and column.joint == joint for column in model.columns])
        if own.sum() > 2:
            rows += [curves[1:] * own, rises * own]
    return np.concatenate(rows)


def box_rows(model: TorqueModel, boxes: Mapping[int, tuple[Array, Array]]) -> Array:
    """Writes "the centre of mass lies in the box", lower m <= m c <= upper m, as rows (6 k, p) that must be >= 0.

    Args:
        model: the torque model.
        boxes: link, counted from 1, to its lowest and highest corner in the link's frame, (3,) [m].
    """
    bodies = body_columns(model)
    rows = np.zeros((6 * len(boxes), model.size))
    for index, (link, (lower, upper)) in enumerate(sorted(boxes.items())):
        columns = bodies[link - 1]
        for axis in range(3):
            low, high = rows[6 * index + 2 * axis], rows[6 * index + 2 * axis + 1]
            low[columns[1 + axis]], low[columns[0]] = 1.0, -lower[axis]
            high[columns[1 + axis]], high[columns[0]] = -1.0, upper[axis]
    return rows


def largest_speed(data: RegressionData) -> Array:
    """Finds each joint's largest speed in the data (n,) [rad/s or m/s]."""
    return np.max([np.abs(part.motion.dq).max(axis=0) for part in data.parts], axis=0)


def _size(body: Array) -> tuple[float, float]:
    """Mass, and radius of gyration about the frame's origin."""
    pseudo = pseudo_inertia(body)
    return float(body[0]), float(np.sqrt(np.trace(pseudo[:3, :3]) / body[0]))


def _corrected_body(body: Array, shortest: float) -> Array:
    """Lifts the eigenvalues of a body's normalised pseudo-inertia to a share of their sum."""
    mass = float(body[0])
    pseudo = pseudo_inertia(body) / mass
    length = max(float(np.sqrt(max(np.trace(pseudo[:3, :3]), 0.0))), shortest)
    unit = np.array([length] * 3 + [1.0])
    values, vectors = np.linalg.eigh(pseudo / unit[:, None] / unit)
    # Eigenvalues of a described pseudo-inertia below this share of its trace are lifted: thin rods and point masses,
    # and files that breach the triangle inequality, would pull towards bodies that cannot exist.
    thin = 0.02
    lifted = (vectors * np.maximum(values, thin)) @ vectors.T
    lifted[3, 3] = max(lifted[3, 3], thin)
    return inertial_from_pseudo(mass * lifted * unit[:, None] * unit)


def mass_from_torque(robot: Robot, torque: float) -> float:
    """Gives the mass [kg] of an arm whose gravity makes the largest joint's torque [N m]."""
    chain = robot.chain
    reach = sum(float(np.linalg.norm(joint.translation)) for joint in chain.joints[1:])
    reach = max(reach + float(np.linalg.norm(chain.tip[:3, 3])), 0.1)
    return max(3.0 * torque / (9.81 * reach), np.finfo(float).tiny ** 0.5)


def _largest_torque(data: RegressionData) -> float:
    return float(np.sqrt((data.moments.square / np.maximum(data.moments.count, 1)).max()))
