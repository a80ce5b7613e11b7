"""The shapes that a URDF draws about its links."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.geometry.urdf_reader import UrdfReader
from robots.geometry.xacro_ import find_package, split_arguments, urdf_bytes

_SIZES = {"box": (("size", 3),), "cylinder": (("radius", 1), ("length", 1)), "sphere": (("radius", 1),)}
_SIZES["capsule"] = _SIZES["cylinder"]


@dataclass(frozen=True, kw_only=True, eq=False)
class UrdfShape:
    """One shape of a link.

    Attributes:
        link: the link's name.
        kind: what it is.
        size: of a box its edges, else radius and length (of a capsule that of its cylinder), or the radius [m].
        pose: (4, 4) in the link's frame; cylinders and capsules are along z.
        file: of a mesh, as the URDF names it.
        scale: (3,) of a mesh.
        surface: of a mesh without a file: vertices (k, 3) [m] and triangles (m, 3) of them.
    """

    link: str
    kind: Literal["box", "cylinder", "sphere", "capsule", "mesh"]
    size: tuple[float, ...] = ()
    pose: Array
    file: str = ""
    scale: Array | None = None
    surface: tuple[Array, NDArray[np.int64]] | None = None


def collision_shapes(source: str | Path) -> dict[str, tuple[UrdfShape, ...]]:
    """Reads the ``<collision>`` shapes of a URDF or xacro file: see `drawn_shapes`."""
    return drawn_shapes(source, "collision")


def drawn_shapes(source: str | Path, use: Literal["collision", "visual"]) -> dict[str, tuple[UrdfShape, ...]]:
    """Reads the shapes of a URDF or xacro file.

    Args:
        source: the file, as for `urdf_bytes`.
        use: which of a link's shapes: those for distances or those for pictures.

    Returns:
        Link to its shapes; links without any are left out.

    Raises:
        InputError: naming the link, on a shape without a size, or one that is not positive.
    """
    root = ElementTree.fromstring(urdf_bytes(source))
    space = root.tag.rpartition("}")[0] + "}" if root.tag.startswith("{") else ""
    for element in root.iter():
        if isinstance(element.tag, str):
            element.tag = element.tag.removeprefix(space)
    shapes: dict[str, tuple[UrdfShape, ...]] = {}
    for link in root.findall("link"):
        name = link.get("name", "")
        read = UrdfReader(str(source), f"link {name!r}")
        found = tuple(_shape(element, name, read) for element in link.findall(use))
        if found:
            shapes[name] = found
    return shapes


def _shape(element: ElementTree.Element, link: str, read: UrdfReader) -> UrdfShape:
    pose = read.placement(element)
    geometry = element.find("geometry")
    drawn = [] if geometry is None else [child for child in geometry if child.tag in (*_SIZES, "mesh")]
    if len(drawn) != 1:
        raise read.error(
            f"<{element.tag}> has no shape", allowed="one box, cylinder, sphere, capsule or mesh in <geometry>"
        )
    (shape,) = drawn
    if shape.tag == "mesh":
        file = shape.get("filename", "")
        if not file:
            raise read.error("<mesh> filename is missing")
        scale = read.numbers(shape, "scale", 3, "1 1 1")
        return UrdfShape(link=link, kind="mesh", pose=pose, file=file, scale=scale)
    size = np.concatenate([read.numbers(shape, key, count) for key, count in _SIZES[shape.tag]])
    if not (size > 0.0).all():
        raise read.error(f"<{shape.tag}> has the size {' '.join(f'{s:g}' for s in size)}", allowed="positive lengths")
    return UrdfShape(link=link, kind=shape.tag, size=tuple(map(float, size)), pose=pose)  # type: ignore[arg-type]


def mesh_file(shape: UrdfShape, source: str | Path) -> Path:
    """Finds the file of a mesh.

    Args:
        shape: a mesh; ``package://PACKAGE/...``, ``model://MODEL/...``, ``file://...``, or a path relative to the URDF.
        source: the URDF or xacro file.

    Raises:
        InputError: the package or the file is not found.
    """
    urdf = split_arguments(source)[0]
    scheme, found, place = shape.file.partition("://")
    if found and scheme in ("package", "model"):
        package, _, inner = place.lstrip("/").partition("/")
        path = find_package(package, urdf, inner) / inner
    else:
        path = urdf.parent / shape.file.removeprefix("file://")
    if not path.is_file():
        raise InputError(f"the mesh {shape.file} of link {shape.link!r} was not found", file=urdf)
    return path
