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
_PREFIX = re.compile(rb"[<\s]([A-Za-z_][\w.-]*):[A-Za-z_]")
_ROOT = re.compile(rb"<robot\b")
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
    return _with_declared_prefixes(existing_file(path).read_bytes())


def _with_declared_prefixes(content: bytes) -> bytes:
    """Declares prefixes that a file uses and does not declare: the parser of ROS knows no name spaces."""
    try:
        ElementTree.fromstring(content)
    except ElementTree.ParseError as error:
        if "unbound prefix" in str(error):
            lacking = {name for name in _PREFIX.findall(content) if b"xmlns:" + name + b"=" not in content}
            declared = b"".join(b" xmlns:" + name + b'="' + name + b'"' for name in sorted(lacking - {b"xacro"}))
            return _ROOT.sub(lambda match: match[0] + declared, content, count=1)
    return content


def _expanded(path: Path, arguments: dict[str, str]) -> bytes:
    try:
        xacro = import_module("xacro")
        substitution = import_module("xacro.substitution_args")
    except ImportError as error:
        remedy = "pip install xacro, or expand the file elsewhere: xacro FILE.xacro > FILE.urdf"
        raise InputError("a xacro file needs the package xacro", file=path, remedy=remedy) from error
    heard = io.StringIO()
    lost: list[InputError] = []
    try:
        with contextlib.redirect_stderr(heard), _packages_from(xacro, path, substitution, lost):
            xacro.init_stacks(str(path))
            document = xacro.parse(None, str(path))
            xacro.process_doc(document, mappings=dict(arguments), verbosity=0)
            content: bytes = document.toxml(encoding="utf-8")
    # Expressions in the file may raise anything.
    except Exception as error:
        if lost:
            # xacro wraps it in words of its own.
            raise lost[0] from error
        at = str(xacro.filestack[-1]) if xacro.filestack else str(path)
        text = " ".join(str(error).split()) or type(error).__name__
        undefined = _UNDEFINED.search(text)
        wanted = f"give it behind the file name: '{path.name} {undefined[1]}:=VALUE'" if undefined else None
        raise InputError(
            f"xacro cannot expand it: {text}", file=at, remedy=wanted, kind="xacro_not_expanded"
        ) from error
    for line in _COLOUR.sub("", heard.getvalue()).splitlines():
        if line.strip():
            warnings.warn(f"{path}: xacro: {line.strip()}", AssumedValueWarning, stacklevel=2)
    return content


@contextlib.contextmanager
def _packages_from(xacro: Any, path: Path, substitution: Any, lost: list[InputError]) -> Iterator[None]:
    """Lets ``$(find PACKAGE)`` find packages around a file, where ROS is not installed; others are ``lost``."""

    def find(name: str) -> str:
        current = Path(xacro.filestack[-1]) if xacro.filestack else path
        wanted = re.search(rf"\$\(find\s+{re.escape(name)}\)/([^\"'$<>]+)", current.read_text("utf-8", "replace"))
        try:
            return str(find_package(name, path, wanted[1] if wanted else None))
        except InputError as error:
            lost.append(error)
            raise

    before = substitution._eval_find, substitution._eval_dict["find"]
    substitution._eval_find = substitution._eval_dict["find"] = find
    try:
        yield
    finally:
        substitution._eval_find, substitution._eval_dict["find"] = before


def find_package(name: str, beside: Path, inner: str | None = None) -> Path:
    """Finds the folder of a ROS package.

    It is a folder above the file, one beside such a folder, or one below ``ROS_PACKAGE_PATH`` or
    ``AMENT_PREFIX_PATH``. Its ``package.xml`` has the name, whatever the folder's is; else the folder has it. Else it
    is the folder above the file that holds what is wanted of the package: copies of packages have other names.

    Args:
        name: of the package.
        beside: a file in the same workspace.
        inner: path of the file that is wanted, in the package.

    Raises:
        InputError: it is not found.
    """
    above = beside.resolve().parents
    roots = [folder for folder in above if folder != folder.parent]
    for variable, share in (("ROS_PACKAGE_PATH", ""), ("AMENT_PREFIX_PATH", "share")):
        roots += [Path(root) / share for root in os.environ.get(variable, "").split(os.pathsep) if root]
    found = next((folder for root in roots for folder in _packages(root) if _package_name(folder) == name), None)
    # Many packages are copied to other machines without their package.xml, or state another spelling in it.
    named = (folder for root in roots for folder in (root, root / name) if folder.name == name and folder.is_dir())
    held = (folder for folder in above if inner and (folder / inner).is_file())
    found = found or next(named, None) or next(held, None)
    if found is None:
        raise InputError(
            f"the package {name!r} was not found: no package.xml and no folder around the file has that name",
            file=beside,
            remedy="put it beside this package, with its package.xml or in a folder of that name, or set "
            "ROS_PACKAGE_PATH to the folder above it",
            kind="package_not_found",
        )
    return found


def _packages(root: Path) -> Iterator[Path]:
    """A folder, and those one and two levels below it, as a repository in a workspace holds several packages."""
    yield root
    for pattern in ("*/package.xml", "*/*/package.xml"):
        with contextlib.suppress(OSError):
            yield from sorted(path.parent for path in root.glob(pattern))


def _package_name(folder: Path) -> str | None:
    try:
        element = ElementTree.parse(folder / "package.xml").find("name")
    except (OSError, ElementTree.ParseError):
        return None
    return None if element is None or not element.text else element.text.strip()
