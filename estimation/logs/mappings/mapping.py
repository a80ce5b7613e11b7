"""A mapping file: which columns of a foreign log hold what, in which unit, with which sign, in which order."""

from __future__ import annotations

from os import PathLike
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, field_validator, model_validator

from estimation.logs.columns import BY_FIELD
from robots.common.config import Config, read_config
from robots.common.errors import InputError


def _listed(value: Any) -> Any:
    return [value] if isinstance(value, str | int | float) and not isinstance(value, bool) else value


def _named(value: Any) -> Any:
    """Names that are numbers, such as 0 and 1, as text."""
    listed = _listed(value)
    if not isinstance(listed, list):
        return listed
    return [str(item) if isinstance(item, int) and not isinstance(item, bool) else item for item in listed]


Texts = Annotated[list[str], BeforeValidator(_named)]
Numbers = Annotated[list[float], BeforeValidator(_listed)]


# The field of a log that each quantity is.
FIELDS = {
    "time": "t",
    "position": "q",
    "velocity": "dq",
    "acceleration": "ddq",
    "torque": "tau",
    "current": "current",
    "temperature": "temperature",
    "link_position": "qlink",
    "command": "command",
    "ambient": "ambient",
    "segment": "segment",
    "cycle": "cycle",
}
# The usual name of the columns of each quantity of all joints; the joint's number comes behind.
USUAL = {key: BY_FIELD[field].prefix for key, field in FIELDS.items() if BY_FIELD[field].per_joint}


class PerJoint(Config):
    """One quantity of all joints.

    Attributes:
        columns: one name a joint in the robot's order, or one name for all: a pattern with ``{joint}`` (the joint's
            name where `LogMapping.joints` states them, else its number from 1) or ``{index}`` (its number from 0). By
            default the usual names of a log.
        unit: as in `docs/files.md`, or ``%`` of ``rated``; one for all or one per joint. One of angles for all joints
            leaves linear axes in m and N.
        sign: 1 or -1, one for all or one per joint.
        scale: factors, after the unit.
        offset: added at the end, in the unit of a log [rad, rad/s, ...].
        side: ``motor`` where the values are the motor's: positions are divided, torques multiplied by ``gear_ratio``.
        rated: rated torques or currents, for ``%`` [N m, N or A].
    """

    columns: Texts
    unit: Texts | None = None
    sign: Numbers = Field(default_factory=lambda: [1.0])
    scale: Numbers = Field(default_factory=lambda: [1.0])
    offset: Numbers = Field(default_factory=lambda: [0.0])
    side: Literal["link", "motor"] = "link"
    rated: Numbers | None = None

    @field_validator("sign")
    @classmethod
    def _check_sign(cls, value: list[float]) -> list[float]:
        if any(abs(sign) != 1.0 for sign in value):
            raise ValueError("a sign is 1 or -1")
        return value

    @field_validator("scale")
    @classmethod
    def _check_scale(cls, value: list[float]) -> list[float]:
        if any(scale == 0.0 or not np.isfinite(scale) for scale in value):
            raise ValueError("a scale is a finite number and not zero")
        return value


class Single(Config):
    """One quantity of the whole robot.

    Attributes:
        column: its name.
        unit: as in `docs/files.md`.
    """

    column: str
    unit: str | None = None


class Clock(Single):
    """The time, in one column or in two.

    Attributes:
        nanoseconds: a second column with what is to be added to whole seconds.
    """

    nanoseconds: str | None = None


class LogMapping(Config):
    """The meaning of a foreign log's columns.

    Attributes:
        time: the column of time, or the columns of seconds and nanoseconds.
        rate: rows per second [Hz], for a log without a column of time.
        position: joint positions; the other quantities are optional.
        velocity: joint velocities.
        acceleration: joint accelerations.
        torque: joint torques.
        current: motor currents; with ``torque_constant`` they become torques.
        temperature: joint temperatures.
        link_position: positions behind the gears.
        command: commanded joint positions.
        ambient: ambient temperature.
        segment: part of an experiment.
        cycle: repetition of an experiment.
        joints: names in the robot's order, for ``{joint}`` and for ROS messages.
        gear_ratio: motor turns per joint turn, signed; for ``side: motor``.
        torque_constant: torque per current [N m/A]: of the motor where the currents' side is ``motor``, else at the
            joint.
        topic: of a ROS bag, where it holds several with joint states.
        torque_is: what the torque columns hold, if not joint torques: ``current``, ``motor`` or ``without-gravity``; of
            some joints only as ``motor:2,5``. It is converted by the robot's description.
        coupling: of an axis whose reading contains other joints, those joints with their factors: ``{3: {2: 1}}`` if
            axis 3 counts q3 + q2, as with a parallelogram.
        coupled_torques: whether the torques are those of the coupled axes, which do the joints' work together.
    """

    time: Clock | None = None
    rate: float | None = Field(default=None, gt=0.0, allow_inf_nan=False)
    position: PerJoint | None = None
    velocity: PerJoint | None = None
    acceleration: PerJoint | None = None
    torque: PerJoint | None = None
    current: PerJoint | None = None
    temperature: PerJoint | None = None
    link_position: PerJoint | None = None
    command: PerJoint | None = None
    ambient: Single | None = None
    segment: Single | None = None
    cycle: Single | None = None
    joints: Texts | None = None
    gear_ratio: list[float] | None = None
    torque_constant: list[float] | None = None
    topic: str | None = None
    torque_is: str | None = None
    coupling: dict[int, dict[int, float]] | None = None
    coupled_torques: bool = False

    @model_validator(mode="after")
    def _check_times(self) -> LogMapping:
        if self.time is not None and self.rate is not None:
            raise ValueError("`time` and `rate` exclude each other: give the one that is right")
        return self

    @model_validator(mode="before")
    @classmethod
    def _usual_columns(cls, data: Any) -> Any:
        if not isinstance(data, dict):
            return data
        usual = {
            key: {"columns": USUAL[key], **value}
            for key, value in data.items()
            if key in USUAL and isinstance(value, dict)
        }
        if isinstance(data.get("time"), dict):
            usual["time"] = {"column": "t", **data["time"]}
        return data | usual


def stated_rate(rate: float, mapping: LogMapping | str | PathLike[str] | None = None) -> LogMapping:
    """Gives a mapping with the rows per second that someone states.

    Args:
        rate: rows per second [Hz].
        mapping: what else is known of the columns: a mapping, or its file.

    Raises:
        InputError: a rate that is not positive, or a mapping that names a column of time.
    """
    if not 0.0 < rate < np.inf:
        raise InputError(f"a rate of {rate:g} rows per second", allowed="more than 0")
    if not isinstance(mapping, LogMapping):
        named = mapping
        mapping = LogMapping() if named is None else read_mapping(named)
    else:
        named = None
    if mapping.time is not None:
        raise InputError(
            f"a rate of {rate:g} rows per second, and the mapping names the column of time {mapping.time.column!r}",
            file=named,
            column="time",
            allowed="one of the two",
            remedy="remove `time` from the mapping, or leave out the rate",
        )
    return mapping.model_copy(update={"rate": rate})


def read_mapping(path: str | PathLike[str]) -> LogMapping:
    """Reads a mapping YAML.

    Raises:
        InputError: a missing file, an unknown key (with the nearest known one), or a value out of range, with its line.
    """
    return read_config(path, LogMapping)
