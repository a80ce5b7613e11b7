"""Robots by catalogue name, from a URDF, from an MJCF, or from a robot YAML file."""

from __future__ import annotations

import shlex
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path

import numpy as np

from robots.assembly import robot_from_urdf, robot_from_yaml
from robots.common.errors import AssumedValueWarning, DescriptionWarning, InputError
from robots.common.files import existing_file
from robots.common.plain import joints_in_words, two_digits
from robots.description_notes import unknown_masses
from robots.geometry.usual_arms import usual_masses, working_reach
from robots.geometry.xacro_ import is_description, split_arguments
from robots.mujoco_models import is_mjcf, robot_from_mjcf
from robots.mujoco_models.files import SUFFIXES as MJCF
from robots.robot import Robot

CATALOG = Path(__file__).parent / "catalog"
_warned: set[str] = set()  # robots whose assumed values were already reported in this process


def catalogue() -> tuple[str, ...]:
    """List the robots that come with this software.

    Returns:
        Their names, sorted.
    """
    return tuple(sorted(path.stem for path in CATALOG.glob("*.yaml")))


def load_robot(
    spec: str | Path | Robot,
    *,
    tip: str | None = None,
    joints: Sequence[str] | None = None,
    locked: Mapping[str, float] | None = None,
    unlimited: bool = False,
    assume_masses: float | None = None,
) -> Robot:
    """Load a robot.

    Args:
        spec: a catalogue name, the path of a ``.urdf``, of a ``.xacro`` (arguments may follow: ``FILE NAME:=VALUE``),
            of an MJCF (``.xml``), or of a robot's ``.yaml``, or a robot, which is returned.
        tip: of a URDF or MJCF, the link, body or site at which the chain ends.
        joints: of a URDF or MJCF, the moving joints in the chain's order.
        locked: of a URDF or MJCF, positions of locked joints [rad or m].
        unlimited: of a URDF, whether revolute and prismatic joints may lack position limits. They are 0 by default in
            a URDF, which no experiment can be designed for.
        assume_masses: rated payload [kg]. Links whose masses are not known get those of a usual arm of this payload and
            the robot's size (`usual_masses`); `Robot.assumed` says so. They are for simulations and designs: identify
            with the robot as it is described.

    Returns:
        The robot.

    Raises:
        InputError: on an unknown name, with the nearest one; on a file that is missing or wrong, naming the key, link
            or joint; when a URDF branches and nothing says which chain is meant.

    Warns:
        DescriptionWarning: once per process and robot, when the description holds values that no source backs; for
            each of the robot's `notes`, if it is not of the catalogue.
        AssumedValueWarning: each time, when masses are assumed, or would be and are all known.
    """
    if isinstance(spec, Robot):
        if tip is not None or joints is not None or locked:
            raise InputError(f"{spec.name} is loaded already", remedy="give tip, joints and locked when loading it")
        return spec if assume_masses is None else _with_usual_masses(spec, assume_masses)
    if str(spec) in catalogue():
        robot = robot_from_yaml(CATALOG / f"{spec}.yaml", str(spec), tip, joints, locked)
    else:
        path = _robot_file(spec)
        if is_description(path):
            robot = robot_from_urdf(path, tip, joints, locked, unlimited)
        elif is_mjcf(path):
            robot = robot_from_mjcf(path, tip, joints, locked, unlimited)
        else:
            robot = robot_from_yaml(path, str(path), tip, joints, locked, unlimited)
    robot = replace(robot, stated=_as_words(robot.origin, tip, joints, locked))
    if assume_masses is not None:
        robot = _with_usual_masses(robot, assume_masses)
    if robot.origin not in _warned:
        _warned.add(robot.origin)
        notes = () if robot.origin in catalogue() else robot.notes
        if robot.assumed:
            notes = (f"these values are assumptions without a source: {', '.join(robot.assumed)}", *notes)
        for note in notes:
            warnings.warn(DescriptionWarning(f"{robot.name}: {note}", robot.stated), stacklevel=2)
    return robot


def _with_usual_masses(robot: Robot, payload: float) -> Robot:
    """Fills in the masses that are not known, and says so in every list of what is assumed."""
    if not (np.isfinite(payload) and payload > 0.0):
        raise InputError(f"masses of an arm rated for {payload} kg", allowed="a positive mass")
    unknown = np.isnan(robot.inertia[:, 0])
    if not unknown.any():
        text = f"{robot.name}: its description states all masses, so none are assumed"
        warnings.warn(AssumedValueWarning(text), stacklevel=3)
        return robot
    usual = usual_masses(robot.chain, robot.limits, payload)
    inertia = np.where(unknown[:, None], usual, robot.inertia)
    reach, mass = working_reach(robot.chain, robot.limits), usual[unknown, 0].sum()
    links = "all links" if unknown.all() else joints_in_words(np.flatnonzero(unknown) + 1).replace("joint", "link")
    what = f"masses of {links} (usual for {payload:g} kg payload and {two_digits(reach)} m reach)"
    text = f"{robot.name}: assumed: {what}, {two_digits(mass)} kg in all; real arms have half to twice as much"
    warnings.warn(AssumedValueWarning(text), stacklevel=3)
    gone = unknown_masses(robot.inertia, robot.joint_names)
    return replace(
        robot,
        inertia=inertia,
        assumed=(*robot.assumed, what),
        notes=tuple(note for note in robot.notes if note not in gone),
        stated=f"{robot.stated} --assume-masses {payload:g}" if robot.stated else "",
    )


def _as_words(origin: str, tip: str | None, joints: Sequence[str] | None, locked: Mapping[str, float] | None) -> str:
    """A robot and the choice of its joints, as a command line takes them."""
    words = [origin]
    words += [] if tip is None else ["--tip", tip]
    words += [] if joints is None else ["--joints", ",".join(joints)]
    for name, value in (locked or {}).items():
        words += ["--lock", f"{name}={value:g}"]
    return shlex.join(words)


def _robot_file(spec: str | Path) -> Path:
    text = str(spec)
    path = Path(text)
    if is_description(text):
        existing_file(split_arguments(text)[0])
        return path
    if path.suffix.lower() in (".yaml", ".yml", *MJCF):
        return existing_file(path)
    if path.is_file() and is_mjcf(path):
        return path
    if text and path.exists():
        raise InputError(
            "the file name does not end like that of a robot file",
            file=text,
            allowed=".urdf, .xacro, .xml (MJCF), .yaml or .yml",
        )
    close = get_close_matches(text.lower(), catalogue(), n=1, cutoff=0.4)
    raise InputError(
        f"unknown robot {text!r}",
        allowed=f"{', '.join(catalogue())}, or the path of a .urdf, .xacro, .xml (MJCF) or .yaml file",
        remedy=f"did you mean {close[0]!r}?" if close else None,
        kind="unknown_robot",
    )
