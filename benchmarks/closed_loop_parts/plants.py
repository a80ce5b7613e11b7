"""Robots in MuJoCo with one effect in their mechanics, under a position loop at 2 kHz.

The engine integrates the motion of two bodies per joint, or of an arm on a base with springs. No formula of the
catalogue is used. The arm is a UR10 whose masses, rotors and friction differ from its description.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Element = ElementTree.Element

URDF = Path(__file__).parents[2] / "robots" / "catalog" / "ur10.urdf"
JOINTS = 6
STEP, EVERY = 0.0005, 8  # [s], steps per row of a log
LEAD, DURATION, UNSEEN = 2.0, 66.0, 30.0  # [s]
HARMONICS, BASE_FREQUENCY = 8, 0.08
CENTRE = np.array([0.0, -1.4, 0.6, -0.5, 0.6, 0.0])
SIZE = np.array([1.3, 0.7, 1.0, 1.3, 1.3, 1.6])
ROTORS = np.array([0.8, 0.8, 0.5, 0.08, 0.08, 0.08])  # [kg m2], at the joint
DAMPING = np.array([12.0, 15.0, 9.0, 2.0, 2.0, 1.5])  # [N m s/rad]
FRICTION = np.array([9.0, 10.0, 6.0, 1.5, 1.2, 1.0])  # [N m]
GAINS = np.array([9000.0, 9000.0, 6000.0, 900.0, 900.0, 600.0])  # [N m/rad]
RATES = np.array([350.0, 350.0, 200.0, 25.0, 25.0, 18.0])  # [N m s/rad]
SPREAD = 0.2
RING = 0.03  # damping ratio of elastic gears and bases
PEDESTAL = (15.0, 0.6)  # mass [kg] and moments of inertia [kg m2] of the part of the base that moves
KINDS = ("backlash", "joint_elasticity", "base_compliance", "spring")


@dataclass(frozen=True, kw_only=True)
class Plant:
    """One robot.

    Attributes:
        kind: the effect, or empty for none.
        place: the joint, from 1; for a flexible base 1 for equal springs, 2 for a softer x axis, 3 for a softer y axis.
        amount: play [rad], compliance of the gear or base [rad/(N m)], or stiffness [N m/rad].
        seed: of the robot's own masses and friction, and of its motion.
    """

    kind: str
    place: int
    amount: float
    seed: int

    def of(self, amount: float) -> Plant:
        """Returns the same robot with another size of the effect."""
        return replace(self, amount=amount)

    @property
    def rest(self) -> float:
        """Angle [rad] at which a spring has no torque."""
        return float(CENTRE[self.place - 1] + np.random.default_rng([self.seed, 3]).uniform(-0.4, 0.4))


@dataclass(frozen=True, eq=False, kw_only=True)
class Ride:
    """A motion of the motors (N, 6), with the torque that the loop demanded, at the log's rate."""

    t: Array
    q: Array
    dq: Array
    ddq: Array
    tau: Array
    slack: Array  # position of the second body beside the motor (N,) [rad]


@cache
def _described() -> str:
    """MuJoCo's MJCF of the URDF. Fixed links stay, because fusing them rotates their inertias wrongly."""
    urdf = ElementTree.fromstring(URDF.read_bytes())
    for link in urdf.findall("link"):
        for tag in ("visual", "collision"):
            for element in link.findall(tag):
                link.remove(element)
    settings = ElementTree.SubElement(urdf, "mujoco")
    ElementTree.SubElement(settings, "compiler", fusestatic="false", discardvisual="true")
    spec = mujoco.MjSpec.from_string(ElementTree.tostring(urdf, encoding="unicode"))
    spec.compile()
    return str(spec.to_xml())


def model_of(plant: Plant) -> tuple[mujoco.MjModel, list[int], list[int]]:
    """Builds the robot.

    Returns:
        The model, and the indices of the motors' coordinates and of the other coordinates.
    """
    root = ElementTree.fromstring(_described())
    rng = np.random.default_rng([plant.seed, 1])

    def vary() -> float:
        return float(1.0 + rng.uniform(-SPREAD, SPREAD))

    compiler = root.find("compiler")
    compiler = ElementTree.SubElement(root, "compiler") if compiler is None else compiler
    compiler.set("angle", "radian")
    option = root.find("option")
    option = ElementTree.SubElement(root, "option") if option is None else option
    option.set("timestep", repr(STEP))
    option.set("integrator", "implicitfast")
    for inertial in root.iter("inertial"):
        factor = vary()
        for key in ("mass", "diaginertia", "fullinertia"):
            if key in inertial.attrib:
                inertial.set(key, " ".join(repr(factor * float(x)) for x in inertial.get(key, "").split()))
    bodies = [body for body in root.iter("body") if body.find("joint") is not None]
    actuators = ElementTree.SubElement(root, "actuator")
    for i, body in enumerate(bodies):
        joint = body.find("joint")
        assert joint is not None
        for key in ("range", "limited", "actuatorfrcrange", "actuatorfrclimited"):
            joint.attrib.pop(key, None)
        joint.set("limited", "false")
        joint.set("armature", repr(float(ROTORS[i]) * vary()))
        joint.set("damping", repr(float(DAMPING[i]) * vary()))
        joint.set("frictionloss", repr(float(FRICTION[i]) * vary()))
        # Otherwise dry friction would fade below .1 rad/s.
        joint.set("solreffriction", f"{2 * STEP!r} 1")
        ElementTree.SubElement(actuators, "motor", joint=str(joint.get("name")))
    if plant.kind and plant.amount > 0:
        _add(plant, root, bodies, np.random.default_rng([plant.seed, 2]))
    model = mujoco.MjModel.from_xml_string(ElementTree.tostring(root, encoding="unicode"))
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    motors = [int(model.jnt_qposadr[model.actuator_trnid[i, 0]]) for i in range(JOINTS)]
    return model, motors, [k for k in range(model.nq) if k not in motors]


def _add(plant: Plant, root: Element, bodies: list[Element], rng: np.random.Generator) -> None:
    """Adds the effect's bodies and springs."""
    body = bodies[plant.place - 1]
    joint = body.find("joint")
    assert joint is not None
    if plant.kind == "spring":
        joint.set("stiffness", repr(plant.amount))
        joint.set("springref", repr(plant.rest))
    elif plant.kind in ("backlash", "joint_elasticity"):
        # A second coordinate about the same axis: the rotor turns by the first one, the link by their sum.
        second = ElementTree.Element(
            "joint", name="second", axis=joint.get("axis", "0 0 1"), pos=joint.get("pos", "0 0 0")
        )
        body.insert(list(body).index(joint) + 1, second)
        if plant.kind == "backlash":
            half = plant.amount / 2
            second.set("limited", "true")
            second.set("range", f"{-half!r} {half!r}")
            second.set("solreflimit", f"{float(rng.uniform(0.002, 0.006))!r} {float(rng.uniform(0.3, 1.0))!r}")
            second.set("solimplimit", "0.95 0.99 0.00001")
        else:
            second.set("stiffness", repr(1.0 / plant.amount))
            second.set("damping", repr(2 * RING * float(np.sqrt(1.0 / plant.amount))))
    else:
        world = root.find("worldbody")
        assert world is not None
        content = list(world)
        base = ElementTree.Element("body", name="pedestal")
        mass, inertia = PEDESTAL
        ElementTree.SubElement(
            base, "inertial", pos="0 0 0", mass=repr(mass), diaginertia=" ".join([repr(inertia)] * 3)
        )
        softer = {1: (1.0, 1.0), 2: (1.0, 0.4), 3: (0.4, 1.0)}[plant.place]
        for axis, factor in zip(("1 0 0", "0 1 0"), softer, strict=True):
            stiffness = 1.0 / (plant.amount * factor)
            ElementTree.SubElement(
                base,
                "joint",
                name=f"tilt_{axis[0]}",
                axis=axis,
                stiffness=repr(stiffness),
                damping=repr(2 * RING * float(np.sqrt(stiffness * 8.0))),
            )
        for element in content:
            world.remove(element)
            base.append(element)
        world.append(base)


def reference(seed: int, duration: float) -> tuple[Array, Array]:
    """Positions and velocities (N, 6) of a random Fourier motion, after a rest of `LEAD` and from rest to rest."""
    rng = np.random.default_rng(seed)
    t = np.arange(round((LEAD + duration) / STEP)) * STEP - LEAD
    harmonics = np.arange(1, HARMONICS + 1)
    a, b = rng.normal(size=(2, HARMONICS, JOINTS)) / np.sqrt(harmonics)[:, None]
    # Frequencies are no multiples of one another, so the motion does not repeat.
    angle = 2 * np.pi * BASE_FREQUENCY * t[:, None] * (harmonics + 0.3 * rng.uniform(-1, 1, HARMONICS))
    waves = np.sin(angle) @ a + np.cos(angle) @ b
    waves *= SIZE / np.abs(waves).max(axis=0)
    x = np.clip(np.minimum(t, t[-1] - t) / 2.0, 0.0, 1.0)[:, None]
    q = CENTRE + waves * (10 * x**3 - 15 * x**4 + 6 * x**5)
    return q, np.gradient(q, STEP, axis=0)


def ride(plant: Plant, motion: tuple[Array, Array]) -> Ride:
    """Integrates the loop along a motion; the lead is left out."""
    model, motors, others = model_of(plant)
    data = mujoco.MjData(model)
    q, dq = motion
    data.qpos[motors] = q[0]
    mujoco.mj_forward(model, data)
    start = data.qfrc_bias[motors] - data.qfrc_passive[motors]
    count = len(q) // EVERY
    rows = np.empty((count, 4, JOINTS))
    slack = np.zeros(count)
    for k in range(count * EVERY):
        own, rate = data.qpos[motors], data.qvel[motors]
        tau = start + GAINS * (q[k] - own) + RATES * (dq[k] - rate)
        data.ctrl[:] = tau
        if k % EVERY:
            mujoco.mj_step(model, data)
            continue
        at = k // EVERY
        if others:
            slack[at] = data.qpos[others[0]]
        mujoco.mj_step(model, data)
        # A step's acceleration, and the velocity in its middle, belong to its torque.
        rows[at] = own, 0.5 * (rate + data.qvel[motors]), (data.qvel[motors] - rate) / STEP, tau
    first = round(LEAD / (STEP * EVERY))
    t = np.arange(count - first) * STEP * EVERY
    return Ride(
        t=t,
        q=rows[first:, 0],
        dq=rows[first:, 1],
        ddq=rows[first:, 2],
        tau=rows[first:, 3],
        slack=slack[first:],
    )
