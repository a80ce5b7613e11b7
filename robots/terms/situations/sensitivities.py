"""Sensitivities of the rigid-body torque to position, velocity, acceleration, gravity and a body at the flange."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, partial

import casadi
import numpy as np

from robots.batch import BatchFunction, batch_function, builds_expressions
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.stretches import chunks
from robots.geometry.chain import Chain
from robots.geometry.symbolic import cleaned, symbolic_placement
from robots.regressor import TorqueModel


def evaluate(kind: str, model: TorqueModel, parameters: Array, q: Array, dq: Array, ddq: Array) -> Array:
    """Evaluates one kind of `Situation.sensitivity`.

    Args:
        kind: a key of `KINDS`.
        model: the torque model.
        parameters: its standard parameters (p,).
        q: positions (N, n).
        dq: velocities (N, n).
        ddq: accelerations (N, n).

    Returns:
        The sensitivity (N, r, c).

    Raises:
        InputError: the kind is unknown.
    """
    if kind not in KINDS:
        raise InputError(f"sensitivity {kind!r}", allowed=", ".join(KINDS))
    evaluator = _evaluator(model.robot.chain, kind)
    rigid = [i for i, column in enumerate(model.columns) if column.term == "rigid_body"]
    pi = parameters[rigid] if rigid else np.zeros(10 * model.robot.n)
    result = np.empty((len(q), *evaluator.output_shapes[0]))
    # In chunks, because the parameters are repeated for every sample; for a long log they would not fit into memory.
    for rows in chunks(len(q)):
        repeated = np.broadcast_to(pi, (rows.stop - rows.start, len(pi)))
        evaluator(q[rows], dq[rows], ddq[rows], repeated, out=(result[rows],))
    return result


@lru_cache(maxsize=64)
@builds_expressions
def _evaluator(chain: Chain, kind: str) -> BatchFunction:
    n = chain.n
    inputs = [casadi.SX.sym(name, size) for name, size in (("q", n), ("dq", n), ("ddq", n), ("pi", 10 * n))]
    function = casadi.Function(kind, inputs, [casadi.densify(KINDS[kind](chain, *inputs))])
    return batch_function(function)


def rigid_torque(
    chain: Chain, q: casadi.SX, dq: casadi.SX, ddq: casadi.SX, bodies: list[casadi.SX], gravity: casadi.SX
) -> casadi.SX:
    """Builds the Newton-Euler torque (n, k) of bodies with k sets of inertial parameters, on a base at rest.

    The arguments are those of `_rigid_torque_and_moment`.
    """
    still = casadi.SX(3, 1)
    return _rigid_torque_and_moment(chain, q, dq, ddq, bodies, gravity, still, still)[0]


def _rigid_torque_and_moment(
    chain: Chain,
    q: casadi.SX,
    dq: casadi.SX,
    ddq: casadi.SX,
    bodies: list[casadi.SX],
    gravity: casadi.SX,
    omega: casadi.SX,
    alpha: casadi.SX,
) -> tuple[casadi.SX, casadi.SX]:
    """Builds the Newton-Euler torque (n, k) and the base's moment on the robot (3, k), on a base that rotates.

    Args:
        chain: the chain of n joints.
        q: positions (n,).
        dq: velocities (n,).
        ddq: accelerations (n,).
        bodies: per link, inertial parameters (10, k) about its frame; an empty matrix for none.
        gravity: gravity in the base frame (3,) [m/s2].
        omega: angular velocity of the base about its origin (3,) [rad/s].
        alpha: its angular acceleration (3,) [rad/s2].
    """
    from robots.terms.rigid_body import _parameter_map

    axes = [casadi.SX(cleaned(joint.axis)) for joint in chain.joints]
    placements = [symbolic_placement(joint, q[i]) for i, joint in enumerate(chain.joints)]
    acceleration = -gravity
    wrenches = []
    for i, joint in enumerate(chain.joints):
        rotation, offset = placements[i]
        spun = casadi.cross(alpha, offset) + casadi.cross(omega, casadi.cross(omega, offset))
        acceleration, omega, alpha = rotation.T @ (acceleration + spun), rotation.T @ omega, rotation.T @ alpha
        if joint.kind == "revolute":
            alpha = alpha + casadi.cross(omega, axes[i]) * dq[i] + axes[i] * ddq[i]
            omega = omega + axes[i] * dq[i]
        else:
            acceleration = acceleration + 2 * casadi.cross(omega, axes[i]) * dq[i] + axes[i] * ddq[i]
        wrenches.append(_parameter_map(omega, alpha, acceleration) @ bodies[i] if bodies[i].numel() else None)
    width = max(body.shape[1] for body in bodies)
    torque = casadi.SX(chain.n, width)
    total = casadi.SX(6, width)
    for i in range(chain.n - 1, -1, -1):
        own = wrenches[i]
        total = total if own is None else total + own
        part = total[3:, :] if chain.joints[i].kind == "revolute" else total[:3, :]
        torque[i, :] = axes[i].T @ part
        rotation, offset = placements[i]
        force = rotation @ total[:3, :]
        total = casadi.vertcat(force, rotation @ total[3:, :] + casadi.skew(offset) @ force)
    return torque, total[3:, :]


def _torque(chain: Chain, q: casadi.SX, dq: casadi.SX, ddq: casadi.SX, pi: casadi.SX, gravity: casadi.SX) -> casadi.SX:
    return rigid_torque(chain, q, dq, ddq, _bodies(chain, pi), gravity)


def _bodies(chain: Chain, pi: casadi.SX) -> list[casadi.SX]:
    return [pi[10 * i : 10 * i + 10] for i in range(chain.n)]


def _position(chain: Chain, q: casadi.SX, dq: casadi.SX, ddq: casadi.SX, pi: casadi.SX) -> casadi.SX:
    return casadi.jacobian(_torque(chain, q, dq, ddq, pi, casadi.SX(chain.gravity)), q)


def _velocity(chain: Chain, q: casadi.SX, dq: casadi.SX, ddq: casadi.SX, pi: casadi.SX) -> casadi.SX:
    return casadi.jacobian(_torque(chain, q, dq, ddq, pi, casadi.SX(chain.gravity)), dq)


def _inertia(chain: Chain, q: casadi.SX, dq: casadi.SX, ddq: casadi.SX, pi: casadi.SX) -> casadi.SX:
    return casadi.jacobian(_torque(chain, q, dq, ddq, pi, casadi.SX(chain.gravity)), ddq)


def _gravity(chain: Chain, q: casadi.SX, dq: casadi.SX, ddq: casadi.SX, pi: casadi.SX) -> casadi.SX:
    gravity = casadi.SX.sym("gravity", 3)
    return casadi.jacobian(_torque(chain, q, dq, ddq, pi, gravity), gravity)


def _tool(chain: Chain, q: casadi.SX, dq: casadi.SX, ddq: casadi.SX, pi: casadi.SX) -> casadi.SX:
    none = [casadi.SX(10, 0)] * (chain.n - 1)
    carried = casadi.SX(cleaned(moved_body(chain.tip)))
    return rigid_torque(chain, q, dq, ddq, [*none, carried], casadi.SX(chain.gravity))


def _bodies_on_links(chain: Chain, q: casadi.SX, dq: casadi.SX, ddq: casadi.SX, pi: casadi.SX) -> casadi.SX:
    each = [casadi.SX(np.kron(np.eye(chain.n)[i], np.eye(10))) for i in range(chain.n)]
    return rigid_torque(chain, q, dq, ddq, each, casadi.SX(chain.gravity))


def _jacobian(chain: Chain, q: casadi.SX, dq: casadi.SX, ddq: casadi.SX, pi: casadi.SX) -> casadi.SX:
    poses, flange = _forward(chain, q)
    columns = [
        casadi.vertcat(casadi.cross(axis, flange - at), axis)
        if kind == "revolute"
        else casadi.vertcat(axis, casadi.SX(3, 1))
        for kind, axis, at in poses
    ]
    return casadi.horzcat(*columns)


def _flange(chain: Chain, q: casadi.SX, dq: casadi.SX, ddq: casadi.SX, pi: casadi.SX) -> casadi.SX:
    return _forward(chain, q)[1]


def _links(chain: Chain, q: casadi.SX, dq: casadi.SX, ddq: casadi.SX, pi: casadi.SX) -> casadi.SX:
    return casadi.horzcat(*(casadi.vertcat(casadi.vec(turn.T), origin) for turn, origin in _frames(chain, q)))


def _frames(chain: Chain, q: casadi.SX) -> list[tuple[casadi.SX, casadi.SX]]:
    """Builds each link's rotation and origin in the base frame."""
    rotation, origin = casadi.SX.eye(3), casadi.SX(3, 1)
    frames = []
    for i, joint in enumerate(chain.joints):
        turn, offset = symbolic_placement(joint, q[i])
        origin, rotation = origin + rotation @ offset, rotation @ turn
        frames.append((rotation, origin))
    return frames


def _forward(chain: Chain, q: casadi.SX) -> tuple[list[tuple[str, casadi.SX, casadi.SX]], casadi.SX]:
    """Builds each joint's kind, axis and origin, and the flange's position, in the base frame."""
    frames = _frames(chain, q)
    poses: list[tuple[str, casadi.SX, casadi.SX]] = [
        (joint.kind, rotation @ casadi.SX(cleaned(joint.axis)), origin)
        for joint, (rotation, origin) in zip(chain.joints, frames, strict=True)
    ]
    rotation, origin = frames[-1]
    return poses, origin + rotation @ casadi.SX(chain.tip[:3, 3])


def _moment(chain: Chain, q: casadi.SX, dq: casadi.SX, ddq: casadi.SX, pi: casadi.SX) -> casadi.SX:
    # First moment S of the links' masses. The potential energy under gravity g is -g' S.
    total = casadi.SX(3, 1)
    for i, (rotation, origin) in enumerate(_frames(chain, q)):
        total = total + pi[10 * i] * origin + rotation @ pi[10 * i + 1 : 10 * i + 4]
    return total


def _by_base_motion(
    of: int, by: int, chain: Chain, q: casadi.SX, dq: casadi.SX, ddq: casadi.SX, pi: casadi.SX
) -> casadi.SX:
    """Builds the slope of the torque (`of` 0) or the base's moment (1) by its velocity (`by` 0) or acceleration (1)."""
    motion, still = (casadi.SX.sym("omega", 3), casadi.SX.sym("alpha", 3)), casadi.SX.zeros(6)
    found = _rigid_torque_and_moment(chain, q, dq, ddq, _bodies(chain, pi), casadi.SX(chain.gravity), *motion)
    return casadi.substitute(casadi.jacobian(found[of], motion[by]), casadi.vertcat(*motion), still)


def _base_moment(chain: Chain, q: casadi.SX, dq: casadi.SX, ddq: casadi.SX, pi: casadi.SX) -> casadi.SX:
    still = casadi.SX(3, 1)
    return _rigid_torque_and_moment(chain, q, dq, ddq, _bodies(chain, pi), casadi.SX(chain.gravity), still, still)[1]


def moved_body(tip: Array) -> Array:
    """Builds the map (10, 10) from inertial parameters in the flange's frame to those in the last link's frame."""
    columns = []
    for unit in np.eye(10):
        mass, moment = unit[0], unit[1:4]
        Ixx, Ixy, Ixz, Iyy, Iyz, Izz = unit[4:]
        inertia = np.array([[Ixx, Ixy, Ixz], [Ixy, Iyy, Iyz], [Ixz, Iyz, Izz]])
        R, p = tip[:3, :3], tip[:3, 3]
        # Sigma holds the second moments of mass. The pseudo-inertia J transforms as T J T^T.
        sigma = 0.5 * np.trace(inertia) * np.eye(3) - inertia
        rotated = R @ moment
        moved_sigma = R @ sigma @ R.T + np.outer(rotated, p) + np.outer(p, rotated) + mass * np.outer(p, p)
        moved = np.trace(moved_sigma) * np.eye(3) - moved_sigma
        first = rotated + mass * p
        columns.append([mass, *first, moved[0, 0], moved[0, 1], moved[0, 2], moved[1, 1], moved[1, 2], moved[2, 2]])
    return np.array(columns).T


KINDS: dict[str, Callable[..., casadi.SX]] = {
    "position": _position,
    "velocity": _velocity,
    "inertia": _inertia,
    "gravity": _gravity,
    "tool": _tool,
    "bodies": _bodies_on_links,
    "jacobian": _jacobian,
    "flange": _flange,
    "moment": _moment,
    "links": _links,
    "base_rate": partial(_by_base_motion, 0, 0),
    "base_acceleration": partial(_by_base_motion, 0, 1),
    "base_moment": _base_moment,
    "base_inertia": partial(_by_base_motion, 1, 1),
    "base_damping": partial(_by_base_motion, 1, 0),
}
