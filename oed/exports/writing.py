"""The verb `export_trajectory`: one entry for all forms but the trajectory file itself."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

from oed.exports.forms import FORMS as CONTROLLER_FORMS
from oed.exports.forms.sampling import at_period
from oed.exports.options import ExportOptions
from oed.exports.trajectory_checks import check_trajectory, stated_collisions
from oed.exports.trajectory_csv import write_trajectory
from robots.common.errors import AssumedValueWarning, InputError
from robots.common.files import write_atomic
from robots.robot import Robot
from robots.signals import Motion

FORMS = ("csv", *CONTROLLER_FORMS)
"""The forms in which a trajectory goes to a controller."""


def export_trajectory(
    path: str | PathLike[str],
    motion: Motion,
    robot: Robot,
    form: str,
    *,
    period: float | None = None,
    options: ExportOptions | None = None,
    metadata: Mapping[str, Any] | None = None,
    file: str | PathLike[str] | None = None,
    force: bool = False,
) -> Motion:
    """Writes a motion in a form of a controller or simulator.

    Args:
        path: the file.
        motion: the trajectory.
        robot: whose joints move.
        form: a name of `CONTROLLER_FORMS`.
        period: sample period [s]; that of the form or of the trajectory by default.
        options: choices that several forms share.
        metadata: what the trajectory's file says of itself.
        file: the trajectory's file, for messages.
        force: whether an existing file may be replaced.

    Returns:
        The motion as it was written: sampled at the period, from time zero.

    Raises:
        InputError: another form or suffix, a trajectory that this robot must not play (see `check_trajectory`), a robot
            that the controller cannot have, an uneven trajectory without a period, or a file that cannot be written.
    """
    if form not in CONTROLLER_FORMS:
        raise InputError(f"form {form!r}", allowed=", ".join(CONTROLLER_FORMS))
    chosen, path = CONTROLLER_FORMS[form], Path(path)
    suffix = path.suffix.lower()
    if suffix not in chosen.suffixes:
        raise InputError(
            f"a file of type {path.suffix or '(none)'!r}",
            file=path,
            allowed=" or ".join(chosen.suffixes),
            remedy="rename it",
        )
    check_trajectory(motion, robot, metadata, file)
    choices = options or ExportOptions()
    choices = replace(choices, name=choices.name or (path.stem if chosen.named else "trajectory"))
    if chosen.named and path.stem.lower() != choices.name.lower():
        raise InputError(
            f"the name {choices.name!r} of the program",
            file=path,
            allowed="the name of its file",
            remedy=f"name the file {choices.name}{suffix}, or state --name {path.stem}",
        )
    step = period if period is not None else chosen.period_of(robot)
    step = motion.period if step is None else step
    if step is None:
        raise InputError("the motion is not uniform in time", remedy="give a period (--period)")
    sampled = at_period(motion, step)
    remark, _ = stated_collisions(metadata or {})
    write_atomic(path, chosen.content(sampled, robot, replace(choices, remark=remark), suffix), force=force)
    return sampled


def write_form(
    path: str | PathLike[str],
    motion: Motion,
    robot: Robot | None,
    form: str,
    *,
    period: float | None = None,
    options: ExportOptions | None = None,
    table: Mapping[str, bool] | None = None,
    metadata: Mapping[str, Any] | None = None,
    file: str | PathLike[str] | None = None,
    force: bool = False,
) -> Motion:
    """Writes a motion in any form, the trajectory file included.

    Args:
        path: the file.
        motion: the trajectory.
        robot: whose joints move; only the trajectory file itself can be written without it.
        form: a name of `FORMS`.
        period: sample period [s]; that of the form or of the trajectory by default.
        options: choices that several forms share.
        table: choices of the trajectory file: ``degrees``, ``positions_only``, ``bare``.
        metadata: what the trajectory's file says of itself.
        file: the trajectory's file, for messages.
        force: whether an existing file may be replaced.

    Returns:
        The motion as it was written.

    Raises:
        InputError: see `export_trajectory` and `write_trajectory`.
    """
    if form != "csv" and robot is not None:
        settings: dict[str, Any] = {"metadata": metadata, "file": file, "force": force}
        return export_trajectory(path, motion, robot, form, period=period, options=options, **settings)
    stated, kinds = dict(metadata or {}), (metadata or {}).get("kinds")
    if robot is None:
        text = f"{file} names no robot: the limits were not checked; state the robot with --robot"
        warnings.warn(text, AssumedValueWarning, stacklevel=1)
    else:
        check_trajectory(motion, robot, stated, file)
        kinds = robot.chain.kinds
    how = dict(table or {})
    if how.get("degrees") and kinds is None:
        text = f"{file} states no units: all joints are taken as revolute; --robot states which axes are linear"
        warnings.warn(text, AssumedValueWarning, stacklevel=1)
    if period is not None:
        motion = at_period(motion, period)
        stated.pop("period", None)
    write_trajectory(path, motion, stated, kinds=kinds, force=force, **how)
    return motion
