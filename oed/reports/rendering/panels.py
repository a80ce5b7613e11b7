"""Panels that several pictures have: bars of each joint, and a joint's friction over its velocity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from oed.reports.rendering.joint_units import joint_titles, joint_units
from oed.reports.rendering.palette import sequence_role
from oed.reports.rendering.picture import Line, Panel, Series

ZERO = Line(value=0.0, role="neutral", dash="solid")
"""The line of zero, where its distance is what counts."""


def joint_bars(
    rows: Mapping[str, ArrayLike],
    *,
    y_label: str,
    joint_names: Sequence[str] | None = None,
    roles: Sequence[str] = (),
    texts: Mapping[str, Sequence[str]] | None = None,
    lines: Sequence[Line] = (),
    y_range: tuple[float, float] | None = None,
) -> Panel:
    """Draws a bar for each joint, beside each other for each row.

    Args:
        rows: heights (n,) by what they are of.
        y_label: quantity and unit.
        joint_names: names (n,).
        roles: of the rows; in sequence by default.
        texts: for hovering (n,), by row.
        lines: horizontal ones.
        y_range: limits of the y axis.
    """
    heights = {label: np.asarray(row, dtype=np.float64) for label, row in rows.items()}
    count = max((len(row) for row in heights.values()), default=len(joint_names or ()))
    return Panel(
        y_label=y_label,
        series=tuple(
            Series(
                x=np.arange(count, dtype=np.float64),
                y=row,
                name=label,
                kind="bars",
                role=roles[index] if roles else sequence_role(index),
                texts=tuple((texts or {}).get(label, ())),
            )
            for index, (label, row) in enumerate(heights.items())
        ),
        lines=tuple(lines),
        categories=joint_titles(joint_names, count),
        y_range=y_range,
    )


def velocity_panel(
    joint: int,
    series: Sequence[Series],
    *,
    joint_names: Sequence[str] | None,
    kinds: Sequence[str] | None,
    count: int | None = None,
    y_label: str = "",
    lines: Sequence[Line] = (ZERO,),
    note: str = "",
) -> Panel:
    """Draws curves of a joint over its velocity.

    Args:
        joint: counted from 1.
        series: the curves.
        joint_names: names (n,).
        kinds: "revolute" or "prismatic" of each joint (n,).
        count: number of joints n, where neither states it.
        y_label: quantity and unit; friction by default.
        lines: horizontal ones.
        note: a remark in the upper corner.
    """
    size = count or len(joint_names or kinds or ())
    units = joint_units(kinds, size)[joint - 1]
    return Panel(
        title=joint_titles(joint_names, size)[joint - 1],
        x_label=f"velocity [{units.velocity}]",
        y_label=y_label or f"friction [{units.torque}]",
        series=tuple(series),
        lines=tuple(lines),
        note=note,
    )
