"""Pictures of a comparison: parameters over runs, friction curves of all runs, and differences in per cent."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from estimation.uncertainty.quantiles import NORMAL_95
from oed.reports.rendering.joint_units import joint_titles
from oed.reports.rendering.palette import joint_role, sequence_role
from oed.reports.rendering.panels import joint_bars, velocity_panel
from oed.reports.rendering.picture import Line, Panel, Picture, Series
from robots.common.arrays import Array

SMALLEST_P = 1e-12
"""Smallest p-value that is drawn: the tail of the noise distribution is unknown beyond it."""


def course_picture(
    names: Sequence[str],
    units: Sequence[str],
    values: ArrayLike,
    errors: ArrayLike,
    *,
    x: ArrayLike,
    x_label: str,
    labels: Sequence[str],
    title: str,
    name: str,
    caption: str = "",
) -> Picture:
    """Shows quantities over the runs, a panel each, with 95 % intervals (thesis Figs. 38, 40 and 42).

    Args:
        names: of the quantities (p,).
        units: of the quantities (p,).
        values: (p, k).
        errors: standard errors (p, k).
        x: hours or numbers of the runs (k,).
        x_label: what x is.
        labels: of the runs (k,).
        title: of the picture.
        name: the stem of the file name.
        caption: how to read it.
    """
    table, spread = np.asarray(values, dtype=float), np.asarray(errors, dtype=float)
    panels = tuple(
        Panel(
            title=names[i],
            x_label=x_label,
            y_label=f"value [{units[i]}]",
            series=(
                Series(
                    x=np.asarray(x, dtype=float),
                    y=table[i],
                    error=NORMAL_95 * spread[i],
                    kind="markers",
                    texts=tuple(labels),
                ),
            ),
        )
        for i in range(len(names))
    )
    return Picture(title=title, name=name, panels=panels, columns=3, panel_height=180, caption=caption)


def significance_picture(
    p_values: Mapping[str, Mapping[int, float]], alpha: float, *, joint_names: Sequence[str], name: str = "tests"
) -> Picture:
    """Shows how significant the differences of all parts are, in one chart.

    Args:
        p_values: adjusted p-values by part and joint, counted from 1.
        alpha: below which a difference is significant.
        joint_names: names (n,).
        name: the stem of the file name.
    """
    count = len(joint_names)
    titles = joint_titles(joint_names, count)
    found = {part: np.array([row.get(j, np.nan) for j in range(1, count + 1)]) for part, row in p_values.items()}
    heights = {part: -np.log10(np.maximum(p, SMALLEST_P)) for part, p in found.items()}
    top = max((float(np.nanmax(row, initial=0.0)) for row in heights.values()), default=0.0)
    panel = joint_bars(
        heights,
        y_label="-log10 of adjusted p-value [1]",
        joint_names=joint_names,
        texts={
            part: [f"{title}, {part}: p = {value:.2g}" for title, value in zip(titles, p, strict=True)]
            for part, p in found.items()
        },
        lines=(Line(value=float(-np.log10(alpha)), label="significant above"),),
        y_range=(0.0, 1.15 * max(top, float(-np.log10(alpha)))),
    )
    return Picture(
        title="Differences of the parts of each joint",
        name=name,
        panels=(panel,),
        panel_height=260,
        caption=f"The smallest adjusted p-value over the runs. 2 is p = 0.01. Bars end at p = {SMALLEST_P:g}.",
    )


def friction_runs_picture(
    speeds: Sequence[Array],
    torques: Sequence[Array],
    errors: Sequence[Array],
    *,
    joints: Sequence[int],
    labels: Sequence[str],
    kinds: Sequence[str],
    joint_names: Sequence[str],
    name: str = "friction_runs",
) -> Picture:
    """Shows the friction curves of some runs, with 95 % pointwise bands (thesis Fig. 8, cold and warm).

    Args:
        speeds: of each joint (m,) [rad/s or m/s].
        torques: of each joint (k, m) [N m or N].
        errors: standard errors, alike.
        joints: numbers of the joints, from 1.
        labels: of the runs (k,).
        kinds: "revolute" or "prismatic" of all joints (n,).
        joint_names: of all joints (n,).
        name: the stem of the file name.
    """
    panels = []
    for speed, torque, error, joint in zip(speeds, torques, errors, joints, strict=True):
        series = [
            Series(x=speed, y=torque[k], error=NORMAL_95 * error[k], name=label, role=sequence_role(k))
            for k, label in enumerate(labels)
        ]
        panels.append(velocity_panel(joint, series, joint_names=joint_names, kinds=kinds, lines=()))
    return Picture(
        title="Friction of the runs",
        name=name,
        panels=tuple(panels),
        columns=min(3, len(panels)),
        panel_height=210,
        caption="The shaded bands are 95 % intervals at each speed.",
    )


def friction_difference_picture(
    speeds: Sequence[Array],
    percents: Sequence[Array],
    pointwise: Sequence[Array],
    simultaneous: Sequence[Array],
    *,
    joints: Sequence[int],
    kinds: Sequence[str],
    joint_names: Sequence[str],
    name: str = "friction_difference",
) -> Picture:
    """Shows the change of each friction curve in per cent, with pointwise and simultaneous 95 % bands.

    Args:
        speeds: of each joint (m,).
        percents: change (m,) [%].
        pointwise: half widths (m,) [%].
        simultaneous: half widths (m,) [%] of the band that holds the whole curve.
        joints: numbers of the joints, from 1.
        kinds: of all joints (n,).
        joint_names: of all joints (n,).
        name: the stem of the file name.
    """
    panels = []
    for speed, percent, narrow, wide, joint in zip(speeds, percents, pointwise, simultaneous, joints, strict=True):
        role = joint_role(joint)
        edges = [
            Series(
                x=speed,
                y=percent + sign * wide,
                name="simultaneous 95 % band",
                role="neutral",
                dash="dot",
            )
            for sign in (-1, 1)
        ]
        series = [Series(x=speed, y=percent, error=narrow, role=role), *edges]
        panels.append(velocity_panel(joint, series, joint_names=joint_names, kinds=kinds, y_label="change [%]"))
    return Picture(
        title="Change of friction",
        name=name,
        panels=tuple(panels),
        columns=min(3, len(panels)),
        panel_height=210,
        caption=(
            "Shaded: 95 % interval at each speed. Dotted: band that holds the whole curve in 95 %. A curve differs "
            "where zero lies outside the dotted band."
        ),
    )
