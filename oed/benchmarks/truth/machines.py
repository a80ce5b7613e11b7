"""Robots for tests: true pinocchio models, and the described models that a user knows."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin

CATALOG = Path(__file__).parents[3] / "robots" / "catalog"
PANDA_HAND = ("panda_finger_joint1", "panda_finger_joint2")


@dataclass(frozen=True, kw_only=True)
class Machine:
    """The true robot (``model``, ``rotor``, ``friction``) and its description (``known``, ``known_rotor``).

    Units are SI. Friction (n, 4) holds f1..f4 of f1 sign v + f2 v + f3 v|v| + f4 v^3, with sign v = tanh(v / v0).
    """

    name: str
    model: pin.Model
    known: pin.Model
    rotor: np.ndarray
    known_rotor: np.ndarray
    gear: np.ndarray
    friction: np.ndarray
    known_friction: np.ndarray
    sign_width: np.ndarray
    offset: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    speed: np.ndarray
    acceleration: np.ndarray
    bandwidth: np.ndarray
    damping: float
    feedforward: float
    wrist: tuple[int, int]

    @property
    def n(self) -> int:
        """The number of joints."""
        return int(self.model.nv)


@dataclass(frozen=True, kw_only=True)
class _Frame:
    """Nominal values of one kind of robot."""

    model: pin.Model
    gear: np.ndarray
    rotor: np.ndarray
    coulomb: np.ndarray
    viscous: np.ndarray
    acceleration: np.ndarray
    wrist: tuple[int, int]


def draw_machine(kind: str, rng: np.random.Generator) -> Machine:
    """Draws a robot whose link parameters differ from its description by up to 8 %, and rotor inertias by 15 %."""
    frame = _FRAMES[kind]()
    n = frame.model.nv
    true = perturbed(frame.model, rng)
    strength = rng.uniform(0.7, 1.3, n)
    f1, f2 = frame.coulomb * strength, frame.viscous * rng.uniform(0.7, 1.3, n)
    speed = np.asarray(frame.model.velocityLimit)
    f3 = f2 / speed * rng.uniform(-0.15, 0.05, n)
    f4 = f2 / speed**2 * rng.uniform(-0.05, 0.1, n)
    friction = np.column_stack([f1, f2, f3, f4])
    known = np.column_stack([f1 * rng.uniform(0.7, 1.3, n), f2 * rng.uniform(0.7, 1.3, n), 0 * f1, 0 * f1])
    # Largest relative error of described rotor inertias.
    drive_error = 0.15
    # Position limit [rad] of joints with a larger range.
    largest = 3.0
    return Machine(
        name=kind,
        model=true,
        known=frame.model,
        rotor=frame.rotor * rng.uniform(1 - drive_error, 1 + drive_error, n),
        known_rotor=frame.rotor,
        gear=frame.gear,
        friction=friction,
        known_friction=known,
        sign_width=np.full(n, rng.uniform(1e-3, 4e-3)),
        offset=f1 * rng.uniform(-0.3, 0.3, n),
        lower=np.maximum(np.asarray(frame.model.lowerPositionLimit), -largest),
        upper=np.minimum(np.asarray(frame.model.upperPositionLimit), largest),
        speed=speed,
        acceleration=frame.acceleration,
        # A natural frequency of 8 to 20 Hz, as of position loops of 10 to 30 1/s around velocity loops of 20 to 60 Hz.
        bandwidth=2 * np.pi * rng.uniform(8.0, 20.0, n),
        damping=float(rng.uniform(1.0, 1.8)),
        feedforward=float(rng.choice([0.0, 1.0], p=[0.3, 0.7])),
        wrist=frame.wrist,
    )


def perturbed(model: pin.Model, rng: np.random.Generator, error: float = 0.08) -> pin.Model:
    """Draws a copy of a model with other masses, centres of mass and inertias, which are physically consistent.

    Args:
        model: the model.
        rng: random numbers.
        error: largest relative error of masses, centres of mass and second moments.
    """
    copy = pin.Model(model)
    for joint in range(1, model.njoints):
        body = model.inertias[joint]
        shift = rng.uniform(-error, error, 3) * np.abs(body.lever) + rng.uniform(-1, 1, 3) * 2e-3
        moments, axes = np.linalg.eigh(body.inertia)
        # Scaling the three second moments of mass keeps the triangle inequality of the principal moments of inertia.
        second = np.maximum(moments.sum() / 2 - moments, 1e-9) * rng.uniform(1 - error, 1 + error, 3)
        inertia = axes @ np.diag(second.sum() - second) @ axes.T
        mass = body.mass * rng.uniform(1 - error, 1 + error)
        copy.inertias[joint] = pin.Inertia(float(mass), body.lever + shift, inertia)
    return copy


def _ur10() -> _Frame:
    strength = np.array([12.0, 12.0, 8.0, 3.0, 3.0, 3.0])
    return _Frame(
        model=pin.buildModelFromUrdf(str(CATALOG / "ur10.urdf")),
        gear=np.full(6, 101.0),
        rotor=0.15 * strength,
        coulomb=strength,
        viscous=0.8 * strength,
        acceleration=np.array([5.0, 5.0, 5.0, 8.0, 8.0, 8.0]),
        wrist=(5, 6),
    )


def _panda() -> _Frame:
    whole = pin.buildModelFromUrdf(str(CATALOG / "panda.urdf"))
    fingers = [whole.getJointId(name) for name in PANDA_HAND]
    strength = np.array([1.2, 1.2, 1.0, 1.0, 0.5, 0.4, 0.4])
    return _Frame(
        model=pin.buildReducedModel(whole, fingers, pin.neutral(whole)),
        gear=np.full(7, 100.0),
        rotor=0.5 * strength,
        coulomb=strength,
        viscous=0.9 * strength,
        acceleration=np.array([15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0]) * 0.6,
        wrist=(6, 7),
    )


# Per joint (about z): placement xyz and rpy, mass, centre of mass, and inertia about it (Ixx Ixy Ixz Iyy Iyz Izz).
_RIGHT_ANGLE = np.pi / 2
_ER3A = (
    (
        (0, 0, 0.3215),
        (0, 0, 0),
        4.563,
        (0.0001, -0.0001, -0.0516),
        (0.02115, -1.9e-5, -3.4e-5, 0.02143, 2.9e-5, 0.01555),
    ),
    (
        (0.05, 0, 0),
        (_RIGHT_ANGLE, -_RIGHT_ANGLE, 0),
        5.816,
        (0.1012, -0.0008, 0.0021),
        (0.03862, -8.5e-5, 7.514e-4, 0.08974, 1.5e-5, 0.06185),
    ),
    (
        (0.27, 0, 0),
        (0, 0, 0),
        4.380,
        (0.0579, -0.0228, -0.0011),
        (0.01889, -2.126e-3, 2.711e-4, 0.01243, -1.193e-4, 0.02487),
    ),
    (
        (0.07, -0.299, 0),
        (_RIGHT_ANGLE, 0, 0),
        1.976,
        (0.0004, -0.0001, -0.0773),
        (0.007817, -2e-5, -2.4e-5, 0.005972, 3.2e-5, 0.004236),
    ),
    ((0, 0, 0), (-_RIGHT_ANGLE, 0, 0), 0.812, (0.0001, 0.0011, 0), (0.001213, -1.3e-6, 0, 0.0006024, 2.4e-6, 0.001328)),
    ((0, -0.078, 0), (_RIGHT_ANGLE, 0, 0), 0.204, (0, 0.0002, -0.0071), (1.488e-4, 0, 0, 1.488e-4, 0, 1.488e-4)),
)
_HEAVY = (
    ((0, 0, 0.675), (0, 0, 0), 340.0, (0.12, 0.02, -0.18), (22.0, 0.8, -1.5, 26.0, 0.6, 24.0)),
    ((0.35, 0, 0), (_RIGHT_ANGLE, -_RIGHT_ANGLE, 0), 260.0, (0.52, -0.02, 0.11), (7.0, -0.5, 0.9, 38.0, 0.2, 36.0)),
    ((1.15, 0, 0), (0, 0, 0), 210.0, (0.10, -0.18, 0.03), (14.0, -1.1, 0.3, 9.0, -0.4, 17.0)),
    ((0.041, -1.0, 0), (_RIGHT_ANGLE, 0, 0), 62.0, (0.004, -0.003, -0.34), (3.1, 0.02, 0.05, 2.9, -0.04, 0.9)),
    ((0, 0, 0), (-_RIGHT_ANGLE, 0, 0), 34.0, (0.002, 0.055, 0.003), (0.46, 0.004, 0.001, 0.27, 0.006, 0.44)),
    ((0, -0.215, 0), (_RIGHT_ANGLE, 0, 0), 96.0, (0.035, 0.02, 0.16), (2.6, 0.05, -0.14, 3.0, 0.08, 2.2)),
)


def _by_code(rows: tuple, name: str, lower: list, upper: list, speed: list) -> pin.Model:
    model = pin.Model()
    model.name = name
    parent = 0
    for index, (xyz, rpy, mass, com, about) in enumerate(rows):
        placement = pin.SE3(pin.rpy.rpyToMatrix(*map(float, rpy)), np.array(xyz, dtype=float))
        bounds = [np.array([float(np.radians(x))]) for x in (speed[index], lower[index], upper[index])]
        effort = np.array([1e5])
        parent = model.addJoint(parent, pin.JointModelRZ(), placement, f"J{index + 1}", effort, *bounds)
        xx, xy, xz, yy, yz, zz = about
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        model.appendBodyToJoint(
            parent, pin.Inertia(float(mass), np.array(com, dtype=float), inertia), pin.SE3.Identity()
        )
    return model


def _er3a() -> _Frame:
    lower, upper = [-167, -130, -71, -180, -113, -360], [167, 90, 101, 180, 113, 360]
    motor = np.array([3.0, 3.0, 1.7, 0.5, 0.5, 0.5]) * 1e-5
    gear = np.array([100.0, 100.0, 100.0, 80.0, 80.0, 50.0])
    return _Frame(
        model=_by_code(_ER3A, "er3a", lower, upper, [230, 230, 250, 320, 320, 420]),
        gear=gear,
        rotor=motor * gear**2,
        coulomb=np.array([8.0, 9.0, 5.0, 2.0, 2.0, 1.0]),
        viscous=np.array([6.0, 6.5, 4.0, 1.2, 1.2, 0.5]),
        acceleration=np.array([16.0, 16.0, 18.0, 24.0, 24.0, 32.0]) * 0.6,
        wrist=(5, 6),
    )


def _heavy() -> _Frame:
    lower, upper = [-180, -100, -60, -180, -120, -180], [180, 50, 120, 180, 120, 180]
    motor = np.array([4.0, 4.0, 3.0, 0.8, 0.8, 0.5]) * 1e-3
    gear = np.array([214.0, 220.0, 208.0, 178.0, 160.0, 108.0])
    return _Frame(
        model=_by_code(_HEAVY, "heavy", lower, upper, [120, 115, 120, 190, 180, 260]),
        gear=gear,
        rotor=motor * gear**2,
        coulomb=np.array([260.0, 300.0, 210.0, 60.0, 50.0, 32.0]),
        viscous=np.array([170.0, 190.0, 120.0, 32.0, 30.0, 16.0]),
        acceleration=np.array([4.0, 3.5, 4.5, 8.0, 8.0, 10.0]),
        wrist=(5, 6),
    )


_FRAMES = {"ur10": _ur10, "panda": _panda, "er3a": _er3a, "heavy": _heavy}
