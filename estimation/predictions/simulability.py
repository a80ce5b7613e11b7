"""Whether a model can be simulated: which body and direction make it unfit, and the nearest model that simulates.

A simulation divides by the inertia matrix. A fit of poor data may leave one that is not positive definite: some motion
then has negative kinetic energy, and no position loop can hold it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimation.closed_loops.closed_loop import inertia_matrices
from estimation.exports.feasible import nearest_within_errors
from estimation.linear_algebra.conic import ConicProgram
from estimation.models.model import Model
from estimation.regressions.parameter_priors import link_spreads
from robots.base_parameters import BaseParameters, find_base_parameters
from robots.common.arrays import Array
from robots.common.errors import InfeasibleError, InputError, SolverError
from robots.common.records import Record
from robots.consistency import BASIS, pseudo_inertia
from robots.geometry.inertia import BODY_PARAMETERS
from robots.plants.closed_loop import LEAST_INERTIA_SHARE
from robots.signals import Log, Motion


@dataclass(frozen=True, kw_only=True, eq=False)
class UnfitDirection(Record):
    """Why a model cannot be simulated.

    Attributes:
        q: the worst pose (n,) [rad or m].
        direction: joint velocities (n,) of the motion without inertia, the fastest 1.
        inertia: of this motion, v' M v [kg m2, or kg of prismatic joints].
        expected: the same of the nearest model.
        body: the link, from 1, whose parameters bring most inertia back in the nearest model.
        rotor: whether its rotor does most.
        parameter: the base parameter of that link that does most.
        value: identified.
        needed: of the nearest model.
        shift: the difference in standard errors; infinite where the logs do not determine it.
        nearest: the nearest model that simulates.
        change: largest change of a determined parameter in it, in standard errors.
    """

    ENTRIES = (
        "q",
        "direction",
        "inertia",
        "inertia_of_nearest=expected",
        "link=body",
        "rotor",
        "parameter",
        "value",
        "value_of_nearest=needed",
        "shift_in_standard_errors=shift",
        "largest_change_in_standard_errors=change",
    )

    q: Array
    direction: Array
    inertia: float
    expected: float
    body: int
    rotor: bool
    parameter: str
    value: float
    needed: float
    shift: float
    nearest: Model
    change: float

    @property
    def joints(self) -> tuple[int, ...]:
        """The joints that move, from 1, the fastest first."""
        speed = np.abs(self.direction)
        # Joints that move by less than this share of the fastest one are not named.
        return tuple(int(j) + 1 for j in np.argsort(-speed) if speed[j] >= 0.2 * speed.max())

    def summary(self) -> str:
        """Names body, direction and remedy in a few sentences."""
        first, *others = self.joints
        way = f"joint {first}"
        if others:
            signs = ["" if self.direction[j - 1] * self.direction[first - 1] > 0 else "against it " for j in others]
            way += " with " + " and ".join(f"joint {j} {sign}".strip() for j, sign in zip(others, signs, strict=True))
        shift = f"{self.shift:.2g} standard errors" if np.isfinite(self.shift) else "which the logs do not determine"
        part = f"The rotor of joint {self.body}" if self.rotor else f"Link {self.body}"
        return (
            f"The model cannot be simulated: moving {way} has an inertia of {self.inertia:.3g} kg m2. {part} makes it "
            f"so: {self.parameter} is {self.value:.3g}, and {self.needed:.3g} in the nearest model that simulates "
            f"({shift}). There the inertia is {self.expected:.3g} kg m2. The largest change of a determined parameter "
            f"in it is {self.change:.2g} standard errors."
        )


def find_unfit_direction(model: Model, motions: Motion | Sequence[Motion]) -> UnfitDirection | None:
    """Finds the motion to which a model gives no inertia, if there is one.

    A model is unfit where its inertia matrix is not positive definite. It is compared with the nearest model that can
    be simulated, see `nearest_simulable`.

    Args:
        model: an identified model.
        motions: the poses in which it should be simulated.

    Returns:
        The worst direction and the nearest model; None for a model that can be simulated.

    Raises:
        InputError: motions of another number of joints, or no description to stay near to.
        SolverError: the solver gave up.
    """
    listed = [motions] if isinstance(motions, Motion) else list(motions)
    robot = model.robot
    for motion in listed:
        if motion.n != robot.n:
            raise InputError(f"a motion of {motion.n} joints", allowed=f"{robot.n}, as {robot.name} has")
    base = find_base_parameters(model.torque_model, gravities=model.gravities)
    if base.independent != model.columns:
        raise InputError("the model's parameters are not the robot's base parameters", remedy="identify it again")
    # Poses of each motion that are looked at.
    count = 200
    if all(_definite(inertia_matrices(base, model.values, motion, count)) for motion in listed):
        return None
    nearest, change = nearest_simulable(model)
    worst: tuple[float, Array, Array] | None = None
    for motion in listed:
        at = np.linspace(0, len(motion) - 1, min(len(motion), count)).astype(int)
        own, sound = (inertia_matrices(base, values, motion, count) for values in (model.values, nearest.values))
        scale = 1.0 / np.sqrt(np.maximum(np.diagonal(sound, axis1=1, axis2=2), np.finfo(float).tiny))
        sizes, ways = np.linalg.eigh(own * scale[:, :, None] * scale[:, None, :])
        row = int(sizes[:, 0].argmin())
        if worst is None or sizes[row, 0] < worst[0]:
            worst = float(sizes[row, 0]), motion.q[at[row]], scale[row] * ways[row, :, 0]
    assert worst is not None
    _, q, way = worst
    direction = way / way[np.abs(way).argmax()]
    at_pose = Motion(np.zeros(1), q[None], np.zeros((1, robot.n)), np.zeros((1, robot.n)))
    taken = _inertia_of_each(base, model.values - nearest.values, at_pose, direction)
    bodies = np.array([0 if column.joint is None else column.joint for column in model.parameters])
    body = min(set(bodies.tolist()) - {0}, key=lambda link: float(taken[bodies == link].sum()))
    most = int(np.where(bodies == body, taken, np.inf).argmin())
    moved = nearest.values[most] - model.values[most]
    return UnfitDirection(
        q=q,
        direction=direction,
        inertia=_along(base, model.values, at_pose, direction),
        expected=_along(base, nearest.values, at_pose, direction),
        body=body,
        rotor=model.parameters[most].term == "rotor_inertia",
        parameter=model.names[most],
        value=float(model.values[most]),
        needed=float(nearest.values[most]),
        shift=float(abs(moved) / model.standard_errors[most]) if model.determined[most] else np.inf,
        nearest=nearest,
        change=change,
    )


def _definite(matrices: Array) -> bool:
    """Whether all inertia matrices (M, n, n) have room to be divided by, each joint measured by its own inertia."""
    diagonal = np.diagonal(matrices, axis1=1, axis2=2)
    if not (diagonal > 0.0).all():
        return False
    scale = 1.0 / np.sqrt(diagonal)
    return bool((np.linalg.eigvalsh(matrices * scale[:, :, None] * scale[:, None, :])[:, 0] > 0.0).all())


def _along(base: BaseParameters, values: Array, pose: Motion, direction: Array) -> float:
    return float(direction @ inertia_matrices(base, values, pose)[0] @ direction)


def _inertia_of_each(base: BaseParameters, values: Array, pose: Motion, direction: Array) -> Array:
    """What each base parameter (b,) adds to the inertia of a direction."""
    return np.array([_along(base, row, pose, direction) if row.any() else 0.0 for row in np.diag(values)])


def unfit_of(model: Model, logs: Sequence[Log]) -> UnfitDirection | None:
    """Finds why a model cannot be simulated in the poses of logs.

    Args:
        model: the model.
        logs: where it is simulated.

    Returns:
        None for a model that can be simulated, or without a description that gives a nearest one.
    """
    motions = [Motion(log.t, log.q, np.zeros_like(log.q), np.zeros_like(log.q)) for log in logs]
    try:
        return find_unfit_direction(model, motions)
    except (InputError, InfeasibleError, SolverError):
        return None


INERTIAL = ("rigid_body", "rotor_inertia")


def nearest_simulable(model: Model) -> tuple[Model, float]:
    """Moves the inertial base parameters by as little as their covariance allows, until the model can be simulated.

    With the change d of these parameters it minimises ``d' C^-1 d``, C their covariance. Each link keeps a twentieth of
    the described pseudo-inertia, and each rotor of the described inertia. So the inertia matrix keeps a twentieth of
    the described one in every pose. Friction and offsets follow by their covariance with the others.

    Args:
        model: an identified model.

    Returns:
        The model, and the largest change of a determined parameter in standard errors.

    Raises:
        InputError: no description to stay near to, or parameters that are not the robot's base parameters.
        SolverError: the solver gave up.
    """
    robot, torque_model = model.robot, model.torque_model
    described, rotor = np.asarray(robot.inertia), np.asarray(robot.rotor_inertia)
    if not np.isfinite(described).all():
        raise InputError(f"{robot.name}: the robot's description states no inertial parameters to stay near to")
    base = find_base_parameters(torque_model, gravities=model.gravities)
    if base.independent != model.columns:
        raise InputError("the model's parameters are not the robot's base parameters", remedy="identify it again")
    own = np.array([column.term in INERTIAL for column in base.columns])
    rigid, rotors = ([i for i, column in enumerate(torque_model.columns) if column.term == term] for term in INERTIAL)
    joints = np.array([int(torque_model.columns[i].joint or 1) - 1 for i in rotors], dtype=int)
    spread = link_spreads(described)
    # Where no rotor is described, the link that it turns sets the scale.
    rotor_spread = np.where(rotor > 0.0, rotor, spread[:, -1])[joints]
    unit = np.concatenate([spread.reshape(-1), rotor_spread])
    scaled = base.grouping[own][:, [*rigid, *rotors]] * unit

    def constrain(program: ConicProgram) -> None:
        _keep_bodies(program, described, spread)
        if len(joints):
            place = np.arange(BODY_PARAMETERS * robot.n, len(unit))
            program.nonnegative(np.eye(program.size)[place], -LEAST_INERTIA_SHARE * rotor[joints] / rotor_spread)

    start = np.concatenate([(described / spread).reshape(-1), rotor[joints] / rotor_spread])
    return nearest_within_errors(model, own, scaled, model.values[own], start, constrain, "a model that simulates")


def _keep_bodies(program: ConicProgram, described: Array, spread: Array) -> None:
    """Demands that each link keeps a share of its described pseudo-inertia, and is a body that can exist."""
    for link, own in enumerate(described):
        basis = np.zeros((program.size, 4, 4))
        # A congruence by mass and reach makes the units of the matrix one, and keeps its signs.
        scale = np.array([1.0, 1.0, 1.0, spread[link, 1] / spread[link, 0]]) / np.sqrt(spread[link, 4])
        weigh = scale[:, None] * scale
        basis[BODY_PARAMETERS * link : BODY_PARAMETERS * (link + 1)] = BASIS * spread[link][:, None, None] * weigh
        least = pseudo_inertia(own) * weigh
        if np.linalg.eigvalsh(least)[0] < 0.0:
            least = np.zeros((4, 4))
        # Smallest eigenvalue of a pseudo-inertia, in units of the link's own mass and reach.
        program.semidefinite(basis, -LEAST_INERTIA_SHARE * least - 1e-6 * np.eye(4))
