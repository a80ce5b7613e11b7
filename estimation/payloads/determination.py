"""What a log does not determine of a payload, and which motion would."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from estimation.payloads.intervals import AXES, Quantity
from estimation.payloads.mounts import Mount
from estimation.uncertainty.quantiles import NORMAL_95
from robots.common.arrays import Array
from robots.common.errors import InputError, NotIdentifiableError
from robots.regressor import TorqueModel
from robots.terms import RigidBody
from robots.terms.situations.flange_body import payload_part
from robots.terms.situations.sensitivities import moved_body

# Quantities without which a payload is refused, unless no motion of the robot shows them.
SHOWABLE = ("mass", *(f"centre_{axis}" for axis in AXES))

LONGER = (
    "record a longer log, more acceleration, or a heavier payload; beside a log without the payload, the arm must be "
    "as warm in both"
)


def determined(found: Sequence[Quantity]) -> tuple[bool, ...]:
    """Finds which quantities of a payload a log determines by itself."""
    values = {item.name: item.value for item in found}
    moment = (values["Ixx"] + values["Iyy"] + values["Izz"]) / 3
    # The mass is determined if its 95 % interval reaches no farther than half of it to either side. That there is no
    # payload is known to the interval of the mass.
    share = 0.5 * abs(values["mass"]) if values["mass"] else np.inf
    # A coordinate of the centre is determined if its interval reaches no farther than 0.1 m, and a moment or product of
    # inertia if its interval reaches no farther than half of the mean moment.
    limits = {"kg": share, "m": 0.1, "kg m2": 0.5 * moment}
    return tuple(bool(item.half_width <= limits[item.unit]) for item in found)


def is_nothing(free: float, error: float, mount: Mount, q: ArrayLike, gravity: Array | None) -> bool:
    """Whether a log shows that there is no payload, within the error of the mass.

    A mass below zero may be what the arm's model misses. Only one beyond doubt is that of swapped logs.

    Args:
        free: mass by least squares without constraints [kg].
        error: its standard error [kg].
        mount: what carries the payload.
        q: positions (N, n) of the log with the payload [rad or m].
        gravity: in the base frame (3,) [m/s2]; None as described.
    """
    # From five standard errors below zero on, a mass is negative beyond doubt.
    if not -5.0 * error <= free <= NORMAL_95 * error:
        return False
    # Without the motion that shows it, a mass is open and not absent.
    return "mass" not in never_shown(mount, gravity) and not missing_motion(mount, q, gravity)


def require_determined(found: Sequence[Quantity], mount: Mount, q: ArrayLike, gravity: Array | None) -> None:
    """Refuses a payload whose mass or centre the log leaves open.

    Args:
        found: mass and centre with their intervals.
        mount: what carries the payload.
        q: positions (N, n) of the log with the payload [rad or m].
        gravity: in the base frame (3,) [m/s2]; None as described.

    Raises:
        InputError: a mass that is significantly negative.
        NotIdentifiableError: naming what is open, and the motion that would determine it.
    """
    known = dict(zip((item.name for item in found), determined(found), strict=True))
    mass = found[0]
    free = mass.unconstrained
    if free < 0 and free + mass.half_width < 0:
        raise InputError(
            f"the payload has a mass of {free:.3g} kg: the robot carries less in the log with the payload",
            remedy="check which log has the payload; of two logs, swap --log and --without",
        )
    open_ = [name for name in SHOWABLE if not known[name]]
    if not open_:
        return
    shown = f"{free:.3g} ({free - mass.half_width:.3g} to {free + mass.half_width:.3g}) kg"
    never = never_shown(mount, gravity)
    missing = missing_motion(mount, q, gravity)
    if not known["mass"]:
        if "mass" in never:
            missing = f"no motion of {mount.robot.name} shows the mass of a payload on its {mount.name}"
        raise NotIdentifiableError(
            f"the log does not determine the payload's mass: {shown}",
            remedy=missing or f"check that the payload was on the {mount.name} (--link names another place); {LONGER}",
        )
    axes = [name[-1] for name in open_ if name not in never]
    if axes:
        raise NotIdentifiableError(
            f"the log does not determine the payload's centre of mass along {', '.join(axes)} of the "
            f"{mount.name} (the mass "
            f"is {shown})",
            remedy=missing or LONGER,
        )


def never_shown(mount: Mount, gravity: Array | None) -> frozenset[str]:
    """Names what the torques of a robot show of no payload, whatever the motion.

    The height of the centre of mass on a SCARA is an example: the flange never tilts.

    Args:
        mount: what carries the payload.
        gravity: in the base frame (3,) [m/s2]; None as described.

    Returns:
        Of ``mass``, ``centre_x``, ``centre_y`` and ``centre_z`` in the frame of the mount, those that no motion shows.
    """
    model = TorqueModel(mount.robot.under(gravity), (RigidBody(),))
    grouping = payload_part(model, mount.link).grouping[:, list(mount.columns(model))] @ moved_body(mount.pose)
    space = np.linalg.qr(grouping.T)[0]
    parts = np.linalg.norm(space[:4], axis=1)  # of the unit vectors of mass and first moments
    # A parameter is in the torques of a robot if its unit vector lies in the space of those that are, but for this
    # part.
    return frozenset(name for name, part in zip(SHOWABLE, parts, strict=True) if part < 1 - 1e-6)


def missing_motion(mount: Mount, q: ArrayLike, gravity: Array | None) -> str:
    """Says which motion of the last joints before a payload a log lacks.

    It is empty if gravity acts along all axes of the payload's frame that it can.

    Args:
        mount: what carries the payload.
        q: positions (N, n) [rad or m].
        gravity: in the base frame (3,) [m/s2]; None as described.
    """
    positions = np.asarray(q, dtype=float)
    # Poses that are looked at.
    poses_looked_at = 300
    positions = positions[:: max(1, len(positions) // poses_looked_at)]
    ranges = np.ptp(positions, axis=0)
    robot = mount.robot
    anywhere = np.random.default_rng(0).uniform(-np.pi, np.pi, (poses_looked_at, robot.n))
    turned, possible = (_gravity_spread(mount, poses, gravity) for poses in (positions, anywhere))
    # A component of gravity's direction in the flange frame that varies by less than this (standard deviation) is
    # named.
    steady = [axis for k, axis in enumerate(AXES) if turned[k] < 0.2 <= possible[k]]
    # A joint of the wrist, the last three, is named if it moves by less than 0.8 rad.
    wrist = [
        joint
        for joint in range(max(0, mount.joints - 3), mount.joints)
        if robot.chain.kinds[joint] == "revolute" and ranges[joint] < 0.8 and _matters(mount, joint, gravity)
    ]
    if not steady and not wrist:
        return ""
    names = " and ".join(
        f"joint {j + 1} ({robot.joint_names[j]}, moved {np.degrees(ranges[j]):.2g} deg)" for j in wrist
    )
    move = f"move {names} by 90 deg or more" if wrist else "move the joints before it farther"
    goal = f", so that gravity turns along {', '.join(steady)} of the {mount.name}" if steady else ""
    design = f"; `oed design --robot {robot.stated or robot.name} --payload-only` designs such a motion"
    return f"{move}{goal}{design if mount.link is None else ''}"


def _matters(mount: Mount, joint: int, gravity: Array | None) -> bool:
    """Whether the torques by a payload depend on a joint's position; on that of a vertical first joint they do not."""
    model = TorqueModel(mount.robot.under(gravity), (RigidBody(),))
    q, dq, ddq = np.random.default_rng(0).uniform(-1.0, 1.0, (3, 1, mount.robot.n))
    turned = q + np.eye(mount.robot.n)[joint]
    here, there = (model.regressor(at, dq, ddq, columns=mount.columns(model)) for at in (q, turned))
    return not np.allclose(here, there)


def _gravity_spread(mount: Mount, positions: Array, gravity: Array | None) -> Array:
    """Standard deviation (3,) of gravity's direction in the payload's frame over positions (N, n)."""
    poses, field = mount.poses(positions, gravity)
    field = field / max(float(np.linalg.norm(field)), np.finfo(float).tiny)
    return np.asarray(np.einsum("tij,i->tj", poses[:, :3, :3], field).std(axis=0))
