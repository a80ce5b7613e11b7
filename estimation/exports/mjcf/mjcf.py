"""An identified model as an MJCF: the robot's own file with new numbers, or a new file from its chain."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from estimation.exports.mjcf.contents import Contents, contents_of
from estimation.exports.mjcf.editing import body_inertia, edited
from estimation.exports.mjcf.new_model import new_model
from estimation.models.model import Model
from robots.common.errors import InfeasibleError
from robots.common.files import write_atomic
from robots.mujoco_models.elements import MujocoNames
from robots.mujoco_models.files import compile_mjcf, is_mjcf, mujoco_library
from robots.robot import Robot
from robots.version import VERSION


@dataclass(frozen=True, kw_only=True)
class Mjcf:
    """An MJCF of an identified model.

    Attributes:
        text: the file.
        stated: what it states of the model.
        remarks: what it cannot state, or states nearly.
    """

    text: str
    stated: tuple[str, ...]
    remarks: tuple[str, ...]

    def lines(self) -> list[str]:
        """Writes what is stated and the remarks, one a line."""
        return [f"the MJCF states {', '.join(self.stated)}", *(f"  {remark}" for remark in self.remarks)]


def export_mjcf(model: Model, path: str | Path, *, robot: Robot | None = None, force: bool = False) -> Mjcf:
    """Writes an MJCF with identified inertials, armature, damping, frictionloss, springs, couplings and payload.

    Args:
        model: an identified or diagnosed model.
        path: the file to write.
        robot: the robot as it was loaded, for its description and limits; the model's own by default, which knows its
            geometry only.
        force: whether an existing file may be replaced.

    Returns:
        What was written.

    Raises:
        InputError: an existing file without `force`, or no description to complete the base parameters with.
        InfeasibleError: no body that can exist has the identified base parameters.
    """
    path = Path(path)
    result = build_mjcf(model, robot, folder=path.parent)
    write_atomic(path, result.text, force=force)
    return result


def build_mjcf(model: Model, robot: Robot | None = None, *, folder: Path | None = None) -> Mjcf:
    """Gives the MJCF of `export_mjcf` as text.

    If the robot came from an MJCF, its file is kept, with its defaults, shapes, actuators and comments; included files
    are put in their place. Only the moving joints and the bodies on them change. Any other robot gets a plain chain.
    Straight lines approximate friction and springs over the speeds and positions of the model's logs.

    Args:
        model: an identified or diagnosed model.
        robot: the robot as it was loaded.
        folder: in which the text will be a file, for paths of meshes; by default that of the robot's file.

    Raises:
        InputError: no description to complete the base parameters with.
        InfeasibleError: no body that can exist has the identified base parameters.
    """
    known = robot or model.robot
    contents = contents_of(model, known)
    source = Path(known.mjcf)
    from_file = bool(known.links) and source.is_file() and is_mjcf(source)
    place = folder or (source.parent if from_file else Path())
    root = edited(contents, known, place) if from_file else new_model(contents, known)
    comment = ElementTree.Comment(f" {_comment(contents)} ")
    comment.tail = root.text
    root.insert(0, comment)
    text = ElementTree.tostring(root, encoding="unicode") + "\n"
    if from_file:
        _confirm(text, contents, known, place)
    return Mjcf(text=text, stated=tuple(contents.stated), remarks=tuple(contents.remarks))


def _comment(contents: Contents) -> str:
    parts = [f"identified by robot-oed {VERSION}: {', '.join(contents.stated)}", *contents.remarks]
    # Two hyphens end a comment.
    return "; ".join(parts).replace("--", "-")


def _confirm(text: str, contents: Contents, robot: Robot, folder: Path) -> None:
    """Compiles the text in its place and compares what MuJoCo made of it with what was meant.

    Raises:
        InputError: MuJoCo refuses it.
        InfeasibleError: it has other bodies, as limits on masses in the file may cause.
    """
    with tempfile.NamedTemporaryFile("w", dir=folder, prefix=".oed-", suffix=".xml", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        compiled = compile_mjcf(Path(file.name), warn=False)
        names = MujocoNames(mujoco_library(file.name), compiled)
    found = np.zeros_like(contents.inertia)
    index = {name: b for b, name in enumerate(names.bodies)}
    for place in robot.links:
        if place.body > 0 and place.name in index:
            found[place.body - 1] += body_inertia(compiled, index[place.name], place.pose)
    scale = np.abs(contents.inertia).max(axis=1, keepdims=True)
    # MuJoCo keeps what it reads in double precision.
    if (np.abs(found - contents.inertia) > 1e-9 * scale).any():
        raise InfeasibleError(
            "MuJoCo gives the bodies of the written file other masses or inertias",
            remedy="remove boundmass and boundinertia from <compiler>",
        )
