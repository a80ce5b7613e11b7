"""Schema of a robot's YAML file: keys, types, units and the sources of values."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Literal

from pydantic import Field, ValidatorFunctionWrapHandler, WrapValidator, model_validator

from robots.common.config import Config

Source = Literal["thesis", "public", "derived", "assumed", "datasheet", "measured", "identified"]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Number = Annotated[float, Field(allow_inf_nan=True)]
Three = Annotated[list[Finite], Field(min_length=3, max_length=3)]
Six = Annotated[list[Finite], Field(min_length=6, max_length=6)]


class Same(list[float]):
    """One value, written without brackets, that holds for every joint."""


def _one_or_all(value: Any, validate: ValidatorFunctionWrapHandler) -> Any:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return Same(validate([value]))
    return validate(value)


Finites = Annotated[list[Finite], WrapValidator(_one_or_all)]
Numbers = Annotated[list[Number], WrapValidator(_one_or_all)]

# unit -> (factor to SI, the joint kinds it suits, the quantity it measures)
UNITS: dict[str, tuple[float, str, str]] = {
    f"{unit}{suffix}": (factor, kind, quantity)
    for unit, factor, kind in (
        ("rad", 1.0, "revolute"),
        ("deg", 0.017453292519943295, "revolute"),
        ("m", 1.0, "prismatic"),
        ("mm", 1e-3, "prismatic"),
    )
    for suffix, quantity in (("", "position"), ("/s", "velocity"), ("/s2", "acceleration"), ("/s3", "jerk"))
} | {"N m": (1.0, "revolute", "torque"), "N": (1.0, "prismatic", "torque")}


MOTOR_UNITS = {"rad/s": 1.0, "deg/s": 0.017453292519943295, "rpm": 0.10471975511965977}


class Sourced(Config):
    """Anything that may say where it comes from; ``assumed`` means that no source exists."""

    source: Source | None = None
    note: str | None = None


class Values(Sourced):
    """One number a joint, or one for all, without a unit."""

    values: Finites


class Bounds(Sourced):
    """One bound a joint or one for all, in a unit for all joints or one for each; .inf where there is none."""

    values: Numbers
    unit: str | list[str]


class MotorSpeed(Sourced):
    """One highest speed a motor or one for all, before the gear; .inf where there is none."""

    values: Numbers
    unit: Literal["rad/s", "deg/s", "rpm"] = "rad/s"


class Range(Sourced):
    """A lowest and a highest position a joint."""

    lower: Numbers
    upper: Numbers
    unit: str | list[str]


class Ramp(Sourced):
    """Velocity limits that fall towards the ends of the joints: sqrt(2 deceleration distance) - offset - reserve.

    The distance is that from ``lower`` or ``upper``; all in rad and s, or m and s.
    """

    lower: Finites
    upper: Finites
    offset: Finites
    deceleration: Finites
    reserve: Finites = Field(default=Same([0.0]))


class LimitsDescription(Config):
    """Limits of the joints; a quantity left out is unlimited, or as the URDF states it.

    ``torque`` bounds the peak, ``torque_rms`` the root mean square over an experiment (a drive's continuous torque).
    """

    position: Range | None = None
    velocity: Bounds | None = None
    velocity_ramp: Ramp | None = None
    acceleration: Bounds | None = None
    jerk: Bounds | None = None
    torque: Bounds | None = None
    torque_rms: Bounds | None = None


class Pose(Config):
    """A pose: shift [m], then fixed-axis roll, pitch and yaw [rad], as in a URDF."""

    xyz: Three = Field(default=[0.0, 0.0, 0.0])
    rpy: Three = Field(default=[0.0, 0.0, 0.0])


class DhJoint(Sourced):
    """One row of a Denavit-Hartenberg table: lengths and angles in the units of the geometry."""

    name: str | None = None
    kind: Literal["revolute", "prismatic"] = "revolute"
    alpha: Finite = 0.0
    a: Finite = 0.0
    d: Finite = 0.0
    offset: Finite = 0.0


class Geometry(Config):
    """A Denavit-Hartenberg table, its convention and the units of its angles and lengths."""

    convention: Literal["modified", "standard"]
    angles: Literal["deg", "rad"] = "rad"
    lengths: Literal["m", "mm"] = "m"
    joints: Annotated[list[DhJoint], Field(min_length=1)]


class LinkDescription(Sourced):
    """One link: mass [kg], centre of mass [m] and inertia about it [kg m2] (Ixx Ixy Ixz Iyy Iyz Izz).

    They are in DH frame i, and with a URDF or MJCF in the frame of the joint that moves the link.
    """

    mass: Finite
    com: Three
    inertia_at_com: Six


class FrictionDescription(Config):
    """Friction on the joint's side: f1 sign(dq) + f2 dq + f3 dq|dq| + f4 dq^3, in N m and rad/s (N and m/s)."""

    coulomb: Values | None = None
    viscous: Values | None = None
    quadratic: Values | None = None
    cubic: Values | None = None


class Drives(Config):
    """Drives: motor turns per joint turn; rotor inertia [kg m2], torque constant [N m/A] and speed at the motor."""

    gear_ratio: Values | None = None
    rotor_inertia: Values | None = None
    torque_constant: Values | None = None
    motor_speed: MotorSpeed | None = None


class Dynamics(Config):
    """Nominal dynamics; a link of null is unknown, or as the URDF or MJCF states it."""

    links: list[LinkDescription | None] | None = None
    drives: Drives = Drives()
    friction: FrictionDescription = FrictionDescription()


class Rating(Sourced):
    """One rated value in SI units."""

    value: Positive


class Ambient(Sourced):
    """Ambient temperatures of operation [degC]."""

    lowest: Finite
    highest: Finite


class CapsuleDescription(Sourced):
    """A capsule that encloses a link or a part of it; several may share a link.

    ``link`` is 0 for the base and i for the link that joint i moves; ``start`` and ``end`` [m] are in that link's
    frame, the joint's own frame (z or the URDF's axis along the joint) moved by q; ``radius`` [m].
    """

    link: Annotated[int, Field(ge=0)]
    name: str | None = None
    start: Three
    end: Three
    radius: Positive


class ObstacleBox(Sourced):
    """A box around the robot: edge lengths [m] along the axes of a frame, which is at its centre."""

    name: str
    size: Annotated[list[Positive], Field(min_length=3, max_length=3)]
    xyz: Three
    rpy: Three = Field(default=[0.0, 0.0, 0.0])


class ObstacleCapsule(Sourced):
    """A capsule around the robot, in the base frame [m]."""

    name: str
    start: Three
    end: Three
    radius: Positive


class CollisionDescription(Config):
    """Shapes of the links, obstacles in the base frame, and the pairs that may touch.

    ``ignore`` lists pairs of link numbers, or of a link number and the name of an obstacle (the floor's is "floor").
    """

    links: list[CapsuleDescription] = Field(default=[])
    floor: Finite | None = None
    boxes: list[ObstacleBox] = Field(default=[])
    capsules: list[ObstacleCapsule] = Field(default=[])
    ignore: list[Annotated[list[int | str], Field(min_length=2, max_length=2)]] = Field(default=[])


class CouplingDescription(Config):
    """What of a joint's position an axis of the controller contains besides its own; both are counted from 1."""

    axis: Annotated[int, Field(ge=1)]
    joint: Annotated[int, Field(ge=1)]
    factor: Finite


class ControllerAxesDescription(Sourced):
    """How the controller counts the joints: axis = sign (joint + factor other joint) + zero."""

    sign: Finites = Field(default=Same([1.0]))
    zero: Finites = Field(default=Same([0.0]))
    unit: str | list[str] = "deg"
    couplings: list[CouplingDescription] = Field(default=[])


class RobotDescription(Config):
    """A robot's YAML file: a Denavit-Hartenberg table, a URDF or an MJCF, then limits and nominal dynamics."""

    name: str
    title: str = ""
    credit: str | None = None
    licence: str | None = None
    geometry: Geometry | None = None
    urdf: str | None = None
    mjcf: str | None = None
    tip: str | None = None
    joints: list[str] | None = None
    locked: dict[str, Finite] | None = None
    base: Pose | None = None
    flange: Pose | None = None
    gravity: Three | None = None
    limits: LimitsDescription = LimitsDescription()
    dynamics: Dynamics = Dynamics()
    payload: Rating | None = None
    mass: Rating | None = None
    ambient: Ambient | None = None
    collision: CollisionDescription | None = None
    controller_axes: ControllerAxesDescription | None = None
    period: Positive = 0.004

    @model_validator(mode="after")
    def _one_geometry(self) -> RobotDescription:
        if sum(source is not None for source in (self.geometry, self.urdf, self.mjcf)) != 1:
            raise ValueError("a robot has one of 'geometry', 'urdf' and 'mjcf'")
        if self.geometry is not None and (self.tip or self.joints or self.locked):
            raise ValueError("'tip', 'joints' and 'locked' select joints of a file; they do not apply to 'geometry'")
        if self.geometry is None and (self.base or self.flange):
            raise ValueError("'base' and 'flange' belong to 'geometry'; a URDF or MJCF contains them")
        return self

    def assumed(self) -> Iterator[str]:
        """Names of the quantities whose source is "assumed", such as ``limits.jerk``.

        Assumed collision shapes are not among them: their model warns of them where they are used.
        """
        if self.geometry is not None and any(row.source == "assumed" for row in self.geometry.joints):
            yield "geometry"
        yield from _assumed(self.limits, "limits")
        if any(link is not None and link.source == "assumed" for link in self.dynamics.links or ()):
            yield "dynamics.links"
        yield from _assumed(self.dynamics.drives, "dynamics.drives")
        yield from _assumed(self.dynamics.friction, "dynamics.friction")


def _assumed(section: Config, name: str) -> Iterator[str]:
    for key in type(section).model_fields:
        entry = getattr(section, key)
        if entry is not None and entry.source == "assumed":
            yield f"{name}.{key}"
