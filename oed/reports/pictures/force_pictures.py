"""Figures of external forces: the statistic with its threshold, force and moment at the tool, and joint torques."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from estimation.uncertainty.quantiles import NORMAL_95
from oed.reports.rendering.gaps import break_at_pauses
from oed.reports.rendering.joint_units import joint_titles, joint_units
from oed.reports.rendering.palette import sequence_role
from oed.reports.rendering.panels import ZERO
from oed.reports.rendering.picture import Line, Panel, Picture, Series, Span
from robots.common.arrays import Array

Windows = Sequence[tuple[float, float]]


def statistic_picture(t: ArrayLike, statistic: ArrayLike, windows: Windows, *, name: str = "statistic") -> Picture:
    """Shows the contact statistic over time, with the threshold at 1.

    Args:
        t: time [s], (N,).
        statistic: over the threshold, (N,).
        windows: first and last time of each contact [s].
        name: the stem of the file name.
    """
    times, values = break_at_pauses(t, statistic)
    panel = Panel(
        x_label="time [s]",
        y_label="over the threshold [1]",
        series=(Series(x=times, y=values, role="measured"),),
        lines=(Line(value=1.0, label="threshold"),),
        spans=_spans(windows),
    )
    return Picture(
        title="Contact statistic",
        name=name,
        panels=(panel,),
        columns=1,
        panel_height=220,
        caption="Squared distance of the external torque from zero, in standard deviations of a healthy robot.",
    )


def load_picture(
    t: ArrayLike, force: ArrayLike, deviation: ArrayLike, windows: Windows, *, name: str = "tool_force"
) -> Picture:
    """Shows the force at the tool along the base's axes, with its 95 % band.

    Args:
        t: time [s], (N,).
        force: (N, 3) [N].
        deviation: standard deviation, (N, 3) [N]; infinite where the joints do not feel the component.
        windows: first and last time of each contact [s].
        name: the stem of the file name.
    """
    times, values, spread = break_at_pauses(t, force, deviation)
    panels = tuple(
        Panel(
            title=f"Force along {axis}",
            x_label="time [s]",
            y_label="force [N]",
            series=(_banded(times, values[:, k], spread[:, k], sequence_role(k)),),
            lines=(ZERO,),
            spans=_spans(windows),
        )
        for k, axis in enumerate("xyz")
    )
    return Picture(
        title="Force at the tool",
        name=name,
        panels=panels,
        columns=1,
        shared_x=True,
        panel_height=170,
        caption="Along the axes of the base, for a contact at the tool without moment. Ribbon: 95 % band.",
    )


def external_torque_picture(
    t: ArrayLike,
    torque: ArrayLike,
    direct: ArrayLike,
    deviation: ArrayLike,
    windows: Windows,
    *,
    joint_names: Sequence[str],
    kinds: Sequence[str],
    name: str = "external_torque",
) -> Picture:
    """Shows the external torque of each joint by momentum observer and inverse dynamics.

    Args:
        t: time [s], (N,).
        torque: by the observer, (N, n) [N m or N].
        direct: by inverse dynamics, (N, n) [N m or N].
        deviation: standard deviation on a healthy robot, (N, n) [N m or N].
        windows: first and last time of each contact [s].
        joint_names: names, (n,).
        kinds: "revolute" or "prismatic" of each joint, (n,).
        name: the stem of the file name.
    """
    times, residual, other, spread = break_at_pauses(t, torque, direct, deviation)
    titles, units = joint_titles(joint_names, residual.shape[1]), joint_units(kinds, residual.shape[1])
    panels = tuple(
        Panel(
            title=titles[j],
            x_label="time [s]",
            y_label=f"{units[j].effort} [{units[j].torque}]",
            series=(
                Series(x=times, y=other[:, j], name="inverse dynamics", role="neutral", opacity=0.7),
                Series(x=times, y=residual[:, j], name="momentum observer", role="measured"),
                Series(
                    x=times, y=NORMAL_95 * spread[:, j], name="95 % band of a healthy robot", role="limit", dash="dot"
                ),
                Series(x=times, y=-NORMAL_95 * spread[:, j], role="limit", dash="dot"),
            ),
            spans=_spans(windows),
        )
        for j in range(residual.shape[1])
    )
    return Picture(
        title="External joint torque",
        name=name,
        panels=panels,
        columns=2,
        shared_x=True,
        panel_height=160,
        caption="The band is wider near reversals, where friction has no sure sign, and where the model extrapolates.",
    )


def _banded(t: Array, values: Array, deviation: Array, role: str) -> Series:
    width = NORMAL_95 * np.where(np.isfinite(deviation), deviation, np.nan)
    return Series(x=t, y=values, error=width if np.isfinite(width).any() else None, role=role)


def _spans(windows: Windows) -> tuple[Span, ...]:
    return tuple(
        Span(start=start, end=end, label="contact" if k == 0 else "", role="warning")
        for k, (start, end) in enumerate(windows)
    )
