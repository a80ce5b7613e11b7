"""What an MJCF can state of an identified model, in joint units, and what it cannot."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from estimation.exports.feasible import NEAREST, nearest_feasible
from estimation.exports.friction import NAMED_DIFFERENCE, LinearFriction, linear_friction
from estimation.exports.mjcf.couplings import Coupling, coupling_of
from estimation.exports.standard import REMEDY, standard_and_rotors
from estimation.exports.unstated import unstated_terms
from estimation.models.extension import Extension
from estimation.models.model import Model
from robots.common.arrays import Array
from robots.common.errors import InfeasibleError
from robots.consistency import pseudo_inertia
from robots.robot import Robot
from robots.terms.effects.payload_change import carrier
from robots.terms.situations.situation import situation

SPRING_POSITIONS = 50


@dataclass(kw_only=True, eq=False)
class Contents:
    """Numbers for the file; friction and armature without what `couplings` add to the same joints.

    Attributes:
        inertia: (n, 10) about the link frames.
        armature: (n,) [kg m2 or kg].
        coulomb: (n,) [N m or N]; None to keep the file's own friction.
        damping: (n,) [N m s/rad or N s/m]; None likewise.
        stiffness: (n,) [N m/rad or N/m].
        springref: (n,) position without spring torque [rad or m].
        payload: (10,) inertial parameters of a body on the flange, in its frame; None without one.
        couplings: tendons between neighbouring joints.
        stated: what the file states, in words.
        remarks: what it cannot state, or states nearly, in words.
    """

    inertia: Array
    armature: Array
    coulomb: Array | None
    damping: Array | None
    stiffness: Array
    springref: Array
    payload: Array | None = None
    couplings: list[Coupling] = field(default_factory=list)
    stated: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)


def contents_of(model: Model, robot: Robot) -> Contents:
    """Works out what an MJCF states of a model.

    Args:
        model: an identified or diagnosed model.
        robot: the robot with its description.

    Raises:
        InputError: no description to complete the base parameters with.
        InfeasibleError: no body that can exist is near to the identified base parameters.
    """
    described = np.asarray(robot.inertia), np.asarray(robot.rotor_inertia)
    moved = 0.0
    try:
        inertia, rotors = standard_and_rotors(model, *described)
    except InfeasibleError:
        # Noise makes the small inertias of a wrist negative; but a simulator needs bodies.
        model, moved = nearest_feasible(model, *described)
        inertia, rotors = standard_and_rotors(model, *described)
    if not (inertia[:, 0] > 0).all():
        raise InfeasibleError("a link's identified mass is not positive", remedy=REMEDY)
    friction, n = linear_friction(model), robot.n
    contents = Contents(
        inertia=inertia,
        armature=np.maximum(rotors, 0.0),
        coulomb=None if friction is None else friction.coulomb.copy(),
        damping=None if friction is None else friction.viscous.copy(),
        stiffness=np.zeros(n),
        springref=np.zeros(n),
        stated=["inertials", "armature"],
    )
    if moved:
        contents.remarks.append(NEAREST.format(moved))
    contents.remarks += [
        f"armature of joint {name} is 0 instead of the identified {value:.2g}"
        for name, value in zip(robot.joint_names, rotors, strict=True)
        if value < 0.0
    ]
    if friction is not None:
        contents.stated += ["damping", "frictionloss"]
        contents.remarks += _rough_friction(robot, friction)
    left = [extension for extension in model.extensions if not _state(contents, model, robot, extension)]
    _offsets(contents, model, robot)
    words = unstated_terms(model, {"rigid_body", "rotor_inertia", "torque_offset"})
    words += [e.effect.replace("_", " ") + ("" if e.joint is None else f" of joint {e.joint}") for e in left]
    if words:
        contents.remarks.append(f"MJCF cannot state: {', '.join(words)}")
    return contents


def _rough_friction(robot: Robot, friction: LinearFriction) -> list[str]:
    rough = [
        f"{friction.error[i]:.2g} {robot.limits.unit(i, 'torque')} at joint {name}"
        for i, name in enumerate(robot.joint_names)
        if friction.error[i] > NAMED_DIFFERENCE * friction.largest[i]
    ]
    text = "damping and frictionloss approximate the identified friction; largest difference up to the recorded speed:"
    return [f"{text} {', '.join(rough)}"] if rough else []


def _state(contents: Contents, model: Model, robot: Robot, extension: Extension) -> bool:
    """Adds an effect to the contents if MuJoCo has it."""
    if extension.effect == "spring":
        return _spring(contents, model, robot, extension)
    if extension.effect == "payload_change":
        return _payload(contents, extension)
    if extension.effect == "joint_coupling":
        coupling = coupling_of(extension, contents.armature, contents.damping)
        if coupling is None:
            return False
        contents.couplings.append(coupling)
        contents.stated.append(f"coupling of joints {coupling.inner + 1} and {coupling.inner + 2}")
        contents.remarks += coupling.remarks
        return True
    return False


def _spring(contents: Contents, model: Model, robot: Robot, extension: Extension) -> bool:
    """The straight line nearest to the spring's torque over the recorded positions."""
    assert extension.joint is not None
    i = extension.joint - 1
    low, high = _positions(model, robot, i)
    q, torque = np.linspace(low, high, SPRING_POSITIONS), _torque_at(model, extension, low, high)
    slope, intercept = (float(x) for x in np.polyfit(q, torque, 1))
    unit, name = robot.limits.unit(i, "torque"), robot.joint_names[i]
    if slope == 0.0:
        return False
    error, largest = float(np.abs(slope * q + intercept - torque).max()), float(np.ptp(torque))
    contents.stiffness[i], contents.springref[i] = slope, -intercept / slope
    contents.stated.append(f"spring of joint {name}")
    if error > NAMED_DIFFERENCE * largest:
        contents.remarks.append(
            f"stiffness approximates the identified spring of joint {name}; largest difference over the recorded "
            f"positions: {error:.2g} {unit}"
        )
    return True


def _torque_at(model: Model, extension: Extension, low: float, high: float) -> Array:
    assert extension.joint is not None
    n = model.robot.n
    q = np.zeros((SPRING_POSITIONS, n))
    q[:, extension.joint - 1] = np.linspace(low, high, SPRING_POSITIONS)
    parameters = np.zeros(model.torque_model.size)
    parameters[list(model.columns)] = model.values
    still = np.zeros_like(q)
    state = situation(model.torque_model, parameters, np.arange(SPRING_POSITIONS) * 1.0, q, still, still)
    return np.asarray(extension.torque(state)[:, extension.joint - 1])


def _positions(model: Model, robot: Robot, i: int) -> tuple[float, float]:
    recorded = model.provenance.get("recorded")
    if recorded is not None:
        low, high = (float(row[i]) for row in recorded["position"])
    else:
        low, high = float(robot.limits.lower[i]), float(robot.limits.upper[i])
    if not np.isfinite(low + high) or low >= high:
        low, high = -np.pi, np.pi
    return low, high


def _payload(contents: Contents, extension: Extension) -> bool:
    body = np.asarray(extension.coefficients, dtype=float)
    link = carrier(extension.shape)
    values = np.linalg.eigvalsh(pseudo_inertia(body))
    # A body without a positive mass, or with a negative eigenvalue beyond rounding, is none.
    if not body[0] > 0.0 or values[0] < -1e-9 * values[-1]:
        return False
    if link:
        contents.inertia[link - 1] += body
    else:
        contents.payload = body if contents.payload is None else contents.payload + body
    contents.stated.append(f"payload on link {link}" if link else "payload")
    contents.remarks.append(f"the payload is the one from t = {extension.shape[0]:.2f} s of the log on")
    return True


def _offsets(contents: Contents, model: Model, robot: Robot) -> None:
    """A spring takes up its joint's constant torque; without one MuJoCo has no place for it."""
    left = []
    for column, value in zip(model.parameters, model.values, strict=True):
        if column.term != "torque_offset" or column.joint is None:
            continue
        i = column.joint - 1
        if contents.stiffness[i]:
            contents.springref[i] -= value / contents.stiffness[i]
        elif value:
            left.append(f"{value:.2g} {robot.limits.unit(i, 'torque')} at joint {robot.joint_names[i]}")
    if left:
        contents.remarks.append(f"MJCF cannot state torque offsets: {', '.join(left)}")
