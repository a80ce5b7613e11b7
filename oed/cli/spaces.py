"""Workspace limits from the command line's options."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from oed.cli.options import numbers
from robots.common.errors import InputError

if TYPE_CHECKING:
    from oed.constraints.geometric import GeometricLimit
    from robots.collision import Surroundings


def spaces_from(tool_box: str | None, singularity: float | None) -> tuple[GeometricLimit, ...]:
    """Builds the workspace limits of the options.

    Args:
        tool_box: six numbers, from and to in x, y and z [m]; None for no box.
        singularity: lower bound of the smallest singular value; None for no such limit.

    Raises:
        InputError: other than six numbers, an empty box, or a value that is not positive.
    """
    from oed.constraints.singularity import SingularityLimit
    from oed.constraints.tool import ToolBox

    limits: list[GeometricLimit] = []
    if tool_box is not None:
        low, high = _corners("--tool-box", tool_box)
        limits.append(ToolBox(lower=(low[0], low[1], low[2]), upper=(high[0], high[1], high[2])))
    if singularity is not None:
        limits.append(SingularityLimit(smallest=singularity))
    return tuple(limits)


def surroundings_from(floor: float | None, no_floor: bool, keep_out: list[str] | None) -> Surroundings:
    """Reads ``--floor``, ``--no-floor`` and ``--keep-out``.

    Raises:
        InputError: a floor and none, other than six finite numbers, or an empty box.
    """
    from robots.collision import Box, Surroundings

    if no_floor and floor is not None:
        raise InputError("--floor with --no-floor", allowed="one of them")
    boxes = []
    for number, text in enumerate(keep_out or (), start=1):
        low, high = map(np.array, _corners("--keep-out", text))
        if not (np.isfinite(low) & np.isfinite(high) & (low < high)).all():
            raise InputError(f"--keep-out {text}", allowed="finite numbers, each minimum below its maximum")
        pose = np.eye(4)
        pose[:3, 3] = (low + high) / 2.0
        boxes.append(Box(name=f"keep-out {number}", size=high - low, pose=pose))
    return Surroundings(floor=False if no_floor else True if floor is None else floor, keep_out=tuple(boxes))


def _corners(option: str, text: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """The lowest and the highest corner of a box."""
    sides = numbers(option, text)
    if sides is None or len(sides) != 6:
        allowed = "six numbers xmin,xmax,ymin,ymax,zmin,zmax, such as 0.1,0.6,-0.5,0.5,0.05,inf"
        raise InputError(f"{option} {text}", allowed=allowed)
    return tuple(sides[::2]), tuple(sides[1::2])
