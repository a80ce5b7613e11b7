"""Xacro files expanded to URDF by the library of that name, with packages found on disk."""

from __future__ import annotations

import contextlib
import io
import os
import re
import warnings
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from robots.common.errors import AssumedValueWarning, InputError
from robots.common.files import existing_file

SUFFIXES = (".urdf", ".xacro")

_ARGUMENTS = re.compile(r"(?:\s+[A-Za-z_]\w*:=\S*)+\s*$")
_UNDEFINED = re.compile(r"Undefined substitution argument (\w+)")
_COLOUR = re.compile(r"\x1b\[[0-9;]*m")


def split_arguments(source: str | Path) -> tuple[Path, dict[str, str]]:
    """Separates the path of a xacro file from the arguments behind it, ``FILE NAME:=VALUE ...``, as xacro writes them.

    Args:
        source: what the user gave.

    Returns:
        The path and the arguments.
    """
    text = str(source)
    match = _ARGUMENTS.search(text)
    if match is None:
        return Path(text), {}
    pairs = (word.partition(":=") for word in match[0].split())
    return Path(text[: match.start()]), {name: value for name, _, value in pairs}


def is_description(source: str | Path) -> bool:
    """Returns whether a path names a URDF or a xacro file."""
    return split_arguments(source)[0].suffix.lower() in SUFFIXES


def urdf_bytes(source: str | Path) -> bytes:
    """Reads a URDF file, or expands a xacro file.

    Args:
        source: the path of a ``.urdf``, or of a ``.xacro``, which arguments may follow (``FILE NAME:=VALUE``).

    Raises:
        InputError: naming the file, if it is missing, xacro is not installed, or it cannot be expanded.
    """
    path, arguments = split_arguments(source)
    if path.suffix.lower() == ".xacro":
        return _expanded(existing_file(path), arguments)
    if arguments:
        raise InputError(f"arguments {', '.join(arguments)} of a file that is no xacro", file=path, allowed=".xacro")
    return existing_file(path).read_bytes()


def _expanded(path: Path, arguments: dict[str, str]) -> bytes:
    try:
        xacro = import_module("xacro")
        substitution = import_module("xacro.substitution_args")
    except ImportError as error:
        remedy = "pip install xacro, or expand the file elsewhere: xacro FILE.xacro > FILE.urdf"
        raise InputError("a xacro file needs the package xacro", file=path, remedy=remedy) from error
    heard = io.StringIO()
    try:
        with contextlib.redirect_stderr(heard), _packages_from(path, substitution):
            xacro.init_stacks(str(path))
            document = xacro.parse(None, str(path))
            xacro.process_doc(document, mappings=dict(arguments), verbosity=0)
            content: bytes = document.toxml(encoding="utf-8")
    except InputError:
        raise
    # Expressions in the file may raise anything.
    except Exception as error:
        at = str(xacro.filestack[-1]) if xacro.filestack else str(path)
        text = " ".join(str(error).split()) or type(error).__name__
        undefined = _UNDEFINED.search(text)
        wanted = f"give it behind the file name: '{path.name} {undefined[1]}:=VALUE'" if undefined else None
        raise InputError(f"xacro cannot expand it: {text}", file=at, remedy=wanted) from error
    for line in _COLOUR.sub("", heard.getvalue()).splitlines():
        if line.strip():
            warnings.warn(f"{path}: xacro: {line.strip()}", AssumedValueWarning, stacklevel=2)
    return content


@contextlib.contextmanager
def _packages_from(path: Path, substitution: Any) -> Iterator[None]:
    """Lets ``$(find PACKAGE)`` find packages around a file, where ROS is not installed."""

    def find(name: str) -> str:
        return str(find_package(name, path))

    before = substitution._eval_find, substitution._eval_dict["find"]
    substitution._eval_find = substitution._eval_dict["find"] = find
    try:
        yield
    finally:
        substitution._eval_find, substitution._eval_dict["find"] = before


def find_package(name: str, beside: Path) -> Path:
    """Finds the folder of a ROS package.

    It is a folder above the file, one beside such a folder, or one in ``ROS_PACKAGE_PATH`` or ``AMENT_PREFIX_PATH``.
    Its ``package.xml`` has the name; without one, its folder has it.

    Args:
        name: of the package.
        beside: a file in the same workspace.

    Raises:
        InputError: it is not found.
    """
    above = beside.resolve().parents
    folders = [*above, *(folder / name for folder in above)]
    for variable, inner in (("ROS_PACKAGE_PATH", ""), ("AMENT_PREFIX_PATH", "share")):
        roots = [Path(root) / inner for root in os.environ.get(variable, "").split(os.pathsep) if root]
        folders += [folder for root in roots for folder in (root, root / name)]
    found = next((folder for folder in folders if _package_name(folder) == name), None)
    if found is None:
        raise InputError(
            f"the package {name!r} was not found",
            file=beside,
            remedy="put its folder beside this package, or set ROS_PACKAGE_PATH to the folder above it",
        )
    return found


def _package_name(folder: Path) -> str | None:
    try:
        text = (folder / "package.xml").read_bytes()
    except OSError:
        return folder.name if folder.is_dir() else None
    try:
        element = ElementTree.fromstring(text).find("name")
    except ElementTree.ParseError:
        return folder.name
    return folder.name if element is None or not element.text else element.text.strip()
