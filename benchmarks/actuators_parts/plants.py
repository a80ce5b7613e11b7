"""Virtual robots in MuJoCo under position control: stick friction, delayed commands, encoders with steps.

Nothing here imports our simulator: MuJoCo is the oracle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

STEP = 1e-4
"""Time step of the plant [s]."""
STICK = 'solreffriction="0.0002 1" solimpfriction="0.9999 0.9999 0.0001"'
"""Dry friction that sticks: MuJoCo's default lets a joint creep."""


@dataclass(frozen=True, kw_only=True)
class Body:
    """One link with its joint: place in the parent, axis, mass [kg], centre [m], principal inertia [kg m2]."""

    name: str
    pos: tuple[float, float, float]
    axis: str
    mass: float
    com: tuple[float, float, float]
    inertia: tuple[float, float, float]
    range: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Machine:
    """A kind of robot: links, nominal drive (kp, kd, armature, viscous, coulomb, limit) and encoder step [rad]."""

    name: str
    bodies: tuple[Body, ...]
    kp: tuple[float, ...]
    kd: tuple[float, ...]
    armature: tuple[float, ...]
    viscous: tuple[float, ...]
    coulomb: tuple[float, ...]
    limit: tuple[float, ...]
    encoder: float
    home: tuple[float, ...]
    reach: tuple[float, ...]
    fastest: float

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.bodies)


@dataclass(frozen=True, kw_only=True)
class Truth:
    """A plant: its drive, and hidden effects.

    Attributes:
        armature: [kg m2] (n,).
        viscous: [N m s/rad] (n,).
        coulomb: [N m] (n,).
        delay: of the command [s].
        effect: name of a hidden effect; empty for none.
        joint: where it acts, counted from 0.
        size: of the effect, in its own unit: stiffness [N m/rad] of an elastic gear, width [rad] of a gap.
        notes: more of it: damping [N m s/rad] of an elastic gear, stiffness of the flanks of a gap.
    """

    armature: Array
    viscous: Array
    coulomb: Array
    delay: float
    effect: str = ""
    joint: int = 0
    size: float = 0.0
    notes: dict[str, float] = field(default_factory=dict)


def leg() -> Machine:
    """A leg like the Go2's."""
    bodies = (
        Body(
            name="hip",
            pos=(0, 0, 0),
            axis="1 0 0",
            mass=0.678,
            com=(-0.0054, 0.00194, 0),
            inertia=(9e-4, 6e-4, 5e-4),
            range=(-1.05, 1.05),
        ),
        Body(
            name="thigh",
            pos=(0, 0.0955, 0),
            axis="0 1 0",
            mass=1.152,
            com=(-0.0037, -0.0223, -0.0327),
            inertia=(6e-3, 5.8e-3, 9e-4),
            range=(-1.57, 3.49),
        ),
        Body(
            name="calf",
            pos=(0, 0, -0.213),
            axis="0 1 0",
            mass=0.241,
            com=(0.0063, 0, -0.141),
            inertia=(1.5e-3, 1.46e-3, 5.3e-5),
            range=(-2.72, -0.84),
        ),
    )
    return Machine(
        name="leg",
        bodies=bodies,
        kp=(20, 20, 20),
        kd=(1.0, 1.0, 1.0),
        armature=(0.012, 0.012, 0.025),
        viscous=(0.1, 0.1, 0.15),
        coulomb=(0.2, 0.2, 0.4),
        limit=(23.7, 23.7, 45.4),
        encoder=2 * np.pi / 32768,
        home=(0.0, 0.8, -1.6),
        reach=(0.4, 0.4, 0.5),
        fastest=4.0,
    )


def so101() -> Machine:
    """An arm of the SO-101's size on hobby servos."""
    lengths = (0.06, 0.115, 0.135, 0.06, 0.05, 0.06)
    masses = (0.15, 0.12, 0.11, 0.09, 0.08, 0.03)
    axes = ("0 0 1", "0 1 0", "0 1 0", "0 1 0", "0 0 1", "0 1 0")
    names = ("pan", "lift", "elbow", "wrist_flex", "wrist_roll", "gripper")
    bodies = []
    above = 0.05
    for name, length, mass, axis in zip(names, lengths, masses, axes, strict=True):
        size = mass * (length**2 / 12 + 2e-4)
        bodies.append(
            Body(
                name=name,
                pos=(0, 0, above),
                axis=axis,
                mass=mass,
                com=(0.012, 0.002, length / 2),
                inertia=(size, size, mass * 2e-4),
                range=(-1.9, 1.9),
            )
        )
        above = length
    n = len(bodies)
    return Machine(
        name="so101",
        bodies=tuple(bodies),
        kp=(17.8,) * n,
        kd=(0.6,) * n,
        armature=(0.028,) * n,
        viscous=(0.3,) * n,
        coulomb=(0.052,) * n,
        limit=(3.35,) * n,
        encoder=2 * np.pi / 4096,
        home=(0.0, -0.6, 0.9, 0.4, 0.0, 0.2),
        reach=(0.7, 0.5, 0.5, 0.5, 0.7, 0.4),
        fastest=2.5,
    )


def ur5() -> Machine:
    """An arm of the UR5's size under stiff position control."""
    rows = (
        ("pan", (0, 0, 0.163), "0 0 1", 3.761, (0, 0, 0), (0.0102, 0.0102, 0.0067)),
        ("lift", (0, 0.138, 0), "0 1 0", 8.058, (0, 0, 0.2125), (0.1339, 0.1339, 0.0151)),
        ("elbow", (0, -0.131, 0.425), "0 1 0", 2.846, (0, 0, 0.196), (0.0312, 0.0312, 0.0041)),
        ("wrist_1", (0, 0, 0.392), "0 1 0", 1.37, (0, 0.127, 0), (0.0026, 0.0026, 0.0022)),
        ("wrist_2", (0, 0.127, 0), "0 0 1", 1.3, (0, 0, 0.1), (0.0026, 0.0026, 0.0022)),
        ("wrist_3", (0, 0, 0.1), "0 1 0", 0.365, (0, 0.077, 0), (0.0003, 0.0003, 0.0002)),
    )
    bodies = tuple(
        Body(name=name, pos=pos, axis=axis, mass=mass, com=com, inertia=inertia, range=(-6.2, 6.2))
        for name, pos, axis, mass, com, inertia in rows
    )
    return Machine(
        name="ur5",
        bodies=bodies,
        kp=(2000, 2000, 2000, 500, 500, 500),
        kd=(80, 80, 60, 12, 12, 12),
        armature=(1.5, 1.5, 1.0, 0.2, 0.2, 0.2),
        viscous=(8, 8, 6, 1.5, 1.5, 1.5),
        coulomb=(5, 5, 3, 0.8, 0.8, 0.8),
        limit=(150, 150, 150, 28, 28, 28),
        encoder=2 * np.pi / 65536,
        home=(0.0, -0.9, 1.2, -0.6, 0.4, 0.0),
        reach=(0.4, 0.25, 0.3, 0.4, 0.4, 0.4),
        fastest=1.2,
    )


TWO_MASSES = ("joint_elasticity", "backlash")
"""Effects that part a joint into a motor and a link."""
MACHINES = {"leg": leg, "so101": so101, "ur5": ur5}


def mjcf(machine: Machine, truth: Truth | None = None, *, laws: bool = True, step: float | None = None) -> str:
    """Writes the MJCF: as described without a truth, else of the plant."""
    n = machine.n
    values = [
        (machine.armature, machine.viscous, machine.coulomb)
        if truth is None
        else (truth.armature, truth.viscous, truth.coulomb)
    ][0]
    opened, closed = "", ""
    for j, body in enumerate(machine.bodies):
        mass = body.mass * (truth.size if truth and truth.effect == "payload_change" and truth.joint == j else 1.0)
        ratio = mass / body.mass
        inertia = " ".join(repr(float(ratio * x)) for x in body.inertia)
        opened += (
            f'<body name="{body.name}" pos="{body.pos[0]} {body.pos[1]} {body.pos[2]}">'
            f'<inertial mass="{mass!r}" pos="{body.com[0]} {body.com[1]} {body.com[2]}" diaginertia="{inertia}"/>'
            f'<joint name="{body.name}_joint" axis="{body.axis}" armature="{float(values[0][j])!r}" '
            f'damping="{float(values[1][j])!r}" frictionloss="{float(values[2][j])!r}" {STICK} '
            f'range="{body.range[0]} {body.range[1]}"/>'
        )
        if truth and truth.effect in TWO_MASSES and truth.joint == j:
            # A second hinge turns the link against the motor.
            spring = truth.size if truth.effect == "joint_elasticity" else 0.0
            opened += (
                f'<joint name="{body.name}_gear" axis="{body.axis}" stiffness="{float(spring)!r}" '
                f'damping="{float(truth.notes["gear_damping"])!r}"/>'
            )
        closed += "</body>"
    limits = [
        truth.size if truth and truth.effect == "current_clipping" and truth.joint == j else machine.limit[j]
        for j in range(n)
    ]
    actuators = "".join(
        f'<position name="{body.name}" joint="{body.name}_joint" kp="{machine.kp[j]}" kv="{machine.kd[j]}" '
        f'forcerange="{-limits[j]} {limits[j]}"/>'
        for j, body in enumerate(machine.bodies)
    )
    return (
        f'<mujoco model="{machine.name}"><compiler angle="radian" autolimits="true"/>'
        f'<option timestep="{STEP if step is None else step}" integrator="RK4" iterations="100" tolerance="1e-12">'
        '<flag contact="disable" limit="disable"/></option>'
        f"<worldbody>{opened}{closed}</worldbody>" + (f"<actuator>{actuators}</actuator>" if laws else "") + "</mujoco>"
    )


def random_truth(machine: Machine, rng: np.random.Generator, longest: float = 0.012) -> Truth:
    """Draws a plant around the nominal drive: factors from half to twice, a delay up to `longest` [s]."""

    def around(values: Sequence[float]) -> Array:
        return np.array(values) * np.exp(rng.uniform(-np.log(2), np.log(2), machine.n))

    return Truth(
        armature=around(machine.armature),
        viscous=around(machine.viscous),
        coulomb=around(machine.coulomb),
        # A whole number of the plant's steps, so that edges of the command fall where it says.
        delay=STEP * round(rng.uniform(0, longest) / STEP),
    )


def multisine(machine: Machine, duration: float, rng: np.random.Generator, period: float = 1e-3) -> tuple[Array, Array]:
    """Draws commands: harmonics up to the machine's fastest, that start at home; times (N,) and commands (N, n)."""
    t = np.arange(round(duration / period)) * period
    frequencies = np.geomspace(0.15, machine.fastest, 7)
    command = np.empty((len(t), machine.n))
    for j in range(machine.n):
        phases = rng.uniform(0, 2 * np.pi, len(frequencies))
        weights = rng.uniform(0.5, 1.0, len(frequencies)) / np.sqrt(frequencies)
        wave = np.sin(2 * np.pi * np.outer(t, frequencies * rng.uniform(0.9, 1.1)) + phases) @ weights
        wave *= machine.reach[j] / np.abs(wave).max()
        command[:, j] = machine.home[j] + wave * np.minimum(1.0, t / 0.5)
    return t, command


def play(machine: Machine, truth: Truth, t: Array, command: Array) -> Array:
    """Plays commands on the plant; positions by its encoders at the commands' times (N, n)."""
    model = mujoco.MjModel.from_xml_string(mjcf(machine, truth))
    data = mujoco.MjData(model)
    effect, j = truth.effect, truth.joint
    # Behind the joint of an elastic gear there is one coordinate more.
    motors = np.arange(machine.n) + (np.arange(machine.n) > j) * (model.nv - machine.n)
    data.qpos[motors] = command[0]
    mujoco.mj_forward(model, data)
    substeps = round((t[1] - t[0]) / STEP)
    q = np.empty_like(command)
    kp = machine.kp[j]
    period, late = t[1] - t[0], np.full(machine.n, truth.delay)
    if effect == "time_delay":
        late[j] += truth.size
    columns, load = np.arange(machine.n), np.zeros(model.nv)
    for k in range(len(t)):
        q[k] = data.qpos[motors]
        for s in range(substeps):
            at = np.clip(np.floor((k * period + s * STEP - late) / period + 1e-9).astype(int), 0, None)
            control = command[at, columns].copy()
            v, position = data.qvel[motors[j]], data.qpos[motors[j]]
            data.qfrc_applied[:] = 0
            if effect == "stribeck":
                model.dof_frictionloss[j] = truth.coulomb[j] + truth.size * np.exp(-((v / 0.15) ** 2))
            elif effect == "position_dependent_friction":
                model.dof_frictionloss[j] = max(0.0, truth.coulomb[j] + truth.size * np.cos(2 * position))
            elif effect == "load_dependent_friction":
                # What the links ask of the gears: the rotor is not among them.
                mujoco.mj_rne(model, data, 1, load)
                model.dof_frictionloss[j] = truth.coulomb[j] + truth.size * abs(load[j])
            elif effect == "dead_band":
                error = control[j] - position
                control[j] = position + error - np.clip(error, -truth.size, truth.size)
            elif effect == "encoder_offset":
                control[j] = control[j] - truth.size
            elif effect == "joint_limit":
                stop = machine.home[j] + truth.size * machine.reach[j]
                data.qfrc_applied[j] = -(50 * kp) * max(position - stop, 0.0)
            elif effect == "backlash":
                behind = data.qpos[j + 1]
                beyond = behind - np.clip(behind, -truth.size / 2, truth.size / 2)
                data.qfrc_applied[j + 1] = -truth.notes["stiffness"] * beyond
            data.ctrl[:] = control
            mujoco.mj_step(model, data)
    if effect == "encoder_offset":
        q[:, j] += truth.size
    return np.asarray(np.round(q / machine.encoder) * machine.encoder)
