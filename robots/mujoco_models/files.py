"""MJCF files: which ones are, their XML with all that they include, and their compilation by MuJoCo."""

from __future__ import annotations

import hashlib
import warnings
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

from robots.common.errors import AssumedValueWarning, InputError
from robots.common.files import existing_file

Element = ElementTree.Element

SUFFIXES = (".xml", ".mjcf")
INSTALL = "pip install 'robot-oed[mujoco]'"


class MjcfXml(NamedTuple):
    """The XML of an MJCF file: its root with included files in place, and the SHA-256 of all files read."""

    root: Element
    digest: str


def is_mjcf(path: Path) -> bool:
    """Returns whether a file is an MJCF: its name ends in ``.xml`` or ``.mjcf``, or its root element is ``<mujoco>``.

    Args:
        path: any path.
    """
    if path.suffix.lower() in SUFFIXES:
        return True
    try:
        for _, element in ElementTree.iterparse(path, events=("start",)):
            return bool(element.tag == "mujoco")
    except (OSError, ElementTree.ParseError):
        pass
    return False


def read_xml(path: Path) -> MjcfXml:
    """Reads an MJCF file and puts the files that it includes in the place of their ``<include>``.

    Args:
        path: the file. Its comments are kept.

    Returns:
        Its root element and the digest.

    Raises:
        InputError: naming the file, when it is missing, not well-formed, not an MJCF, or includes itself.
    """
    sha = hashlib.sha256()
    root = _parsed(existing_file(path), sha)
    _include(root, path.parent, sha, (path.resolve(),))
    return MjcfXml(root, sha.hexdigest())


def _parsed(path: Path, sha: Any) -> Element:
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}", file=path) from error
    sha.update(content)
    try:
        builder = ElementTree.TreeBuilder(insert_comments=True)
        root = ElementTree.fromstring(content, parser=ElementTree.XMLParser(target=builder))
    except ElementTree.ParseError as error:
        raise InputError(
            f"not well-formed XML: {error}", file=path, row=error.position[0], kind="broken_xml"
        ) from error
    if root.tag not in ("mujoco", "mujocoinclude"):
        remedy = "a URDF's name must end in .urdf" if root.tag == "robot" else None
        raise InputError(f"the root element is <{root.tag}>", file=path, allowed="<mujoco>", remedy=remedy)
    return root


def _include(parent: Element, folder: Path, sha: Any, opened: tuple[Path, ...]) -> None:
    for place, child in reversed(list(enumerate(parent))):
        if child.tag != "include":
            _include(child, folder, sha, opened)
            continue
        # Paths in included files are relative to the main file, too.
        path = folder / child.get("file", "")
        if path.resolve() in opened:
            raise InputError("the file includes itself, directly or through other files", file=path)
        if not path.is_file():
            problem = f"it includes {child.get('file', '')!r}, which does not exist"
            raise InputError(problem, file=opened[0], remedy=f"put it at {path}")
        part = _parsed(path, sha)
        _include(part, folder, sha, (*opened, path.resolve()))
        parent.remove(child)
        for offset, element in enumerate(part):
            parent.insert(place + offset, element)


def mujoco_library(file: str | Path) -> Any:
    """Imports MuJoCo.

    Args:
        file: for the message.

    Raises:
        InputError: it is not installed, or does not run on this system.
    """
    try:
        return import_module("mujoco")
    except (ImportError, OSError) as error:
        raise InputError(
            f"an MJCF file needs the package mujoco ({error})", file=file, remedy=f"install it: {INSTALL}"
        ) from error


def compile_mjcf(path: Path, *, warn: bool = True) -> Any:
    """Compiles an MJCF file.

    Args:
        path: the file.
        warn: whether to pass on what MuJoCo warns of.

    Returns:
        The `mujoco.MjModel`.

    Raises:
        InputError: with MuJoCo's own words, when it refuses the file or is not installed.

    Warns:
        AssumedValueWarning: what MuJoCo warns of.
    """
    mujoco = mujoco_library(path)
    heard: list[str] = []
    before = mujoco.get_mju_user_warning()
    # MuJoCo would write to the terminal and to a file in the working folder.
    mujoco.set_mju_user_warning(heard.append)
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except (ValueError, RuntimeError, mujoco.FatalError) as error:
        text = " ".join(str(error).split())
        missing = "opening" in text or "not found" in text
        raise InputError(
            f"MuJoCo cannot load it: {text}",
            file=path,
            remedy="put the meshes and textures that it names beside it" if missing else None,
        ) from error
    finally:
        mujoco.set_mju_user_warning(before)
    for text in dict.fromkeys(heard if warn else ()):
        warnings.warn(f"{path}: MuJoCo: {' '.join(text.split())}", AssumedValueWarning, stacklevel=2)
    return model
