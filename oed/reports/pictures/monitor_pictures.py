"""Pictures of a monitor: friction of each joint over time, with the part that temperature explains apart."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimation.uncertainty.quantiles import NORMAL_95
from oed.reports.rendering.gaps import break_at_pauses
from oed.reports.rendering.joint_units import joint_titles
from oed.reports.rendering.picture import Line, Panel, Picture, Series, Span

# Points that a panel shows.
SHOWN = 800


def trend_picture(
    hours: ArrayLike,
    friction: ArrayLike,
    heat: ArrayLike,
    rest: ArrayLike,
    error: ArrayLike,
    *,
    joint_names: Sequence[str],
    logs: Sequence[str],
    marks: Sequence[tuple[int | None, float, float, str, str]] = (),
    name: str = "trends",
) -> Picture:
    """Shows each joint's friction, the part by temperature, and the rest.

    Args:
        hours: of the windows (N,) [h].
        friction: log of the friction over the model's (N, n).
        heat: the part that temperature explains (N, n).
        rest: friction minus heat (N, n).
        error: standard errors (N, n).
        joint_names: (n,).
        logs: name of the log behind each window (N,).
        marks: joint (from 1, None for all), start and end [h], label and role of each finding.
        name: the stem of the file name.
    """
    t = np.asarray(hours, dtype=float)
    chosen = np.unique(np.linspace(0, len(t) - 1, min(SHOWN, len(t))).round().astype(int))
    columns = [np.asarray(value, dtype=float)[chosen] for value in (friction, heat, rest, error)]
    total, by_heat, own, spread = columns
    texts = tuple(logs[i] for i in chosen.tolist())
    t = t[chosen]
    width = max(float(np.ptp(t)), 1e-6) / 300
    panels = []
    for j, title in enumerate(joint_titles(joint_names, len(joint_names))):
        spans = tuple(
            Span(start=start, end=max(end, start + width), label=label, role=role)
            for joint, start, end, label, role in marks
            if joint in (None, j + 1)
        )
        panels.append(
            Panel(
                title=title,
                x_label="time [h]",
                y_label="change of friction [%]",
                lines=(Line(value=0.0, role="neutral", dash="dot"),),
                spans=spans,
                series=(
                    Series(x=t, y=_percent(total[:, j]), name="measured", kind="markers", role="neutral", texts=texts),
                    _by_heat(t, by_heat[:, j]),
                    Series(
                        x=t,
                        y=_percent(own[:, j]),
                        error=100 * NORMAL_95 * spread[:, j],
                        name="not explained",
                        kind="markers",
                        role="main",
                        texts=texts,
                    ),
                ),
            )
        )
    return Picture(
        title="Friction over time",
        name=name,
        panels=tuple(panels),
        columns=2,
        shared_x=True,
        panel_height=210,
        caption="Changes against the model. Each point is a window of a log; hovering shows the log. Stripes are the "
        "95 % intervals of the dates of changes.",
    )


def _by_heat(t: NDArray[np.float64], log_ratio: NDArray[np.float64]) -> Series:
    times, values = break_at_pauses(t, log_ratio)
    return Series(x=times, y=_percent(values), name="explained by temperature", role="second")


def _percent(log_ratio: NDArray[np.float64]) -> NDArray[np.float64]:
    return 100 * np.expm1(log_ratio)
