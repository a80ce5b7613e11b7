"""Workspace limits from the command line's options."""

from __future__ import annotations

from typing import TYPE_CHECKING

from oed.cli.options import numbers
from robots.common.errors import InputError

if TYPE_CHECKING:
    from oed.constraints.geometric import GeometricLimit


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
    sides = numbers("--tool-box", tool_box)
    if sides is not None:
        if len(sides) != 6:
            raise InputError(
                f"--tool-box {tool_box}",
                allowed="six numbers xmin,xmax,ymin,ymax,zmin,zmax, such as 0.1,0.6,-0.5,0.5,0.05,inf",
            )
        low, high = sides[::2], sides[1::2]
        limits.append(ToolBox(lower=(low[0], low[1], low[2]), upper=(high[0], high[1], high[2])))
    if singularity is not None:
        limits.append(SingularityLimit(smallest=singularity))
    return tuple(limits)
