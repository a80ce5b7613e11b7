"""Pictures of a diagnosis: a residual against its cause's own coordinate, before and after, and the gain per joint."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from estimation.uncertainty.quantiles import NORMAL_95
from oed.reports.rendering.panels import ZERO, joint_bars
from oed.reports.rendering.picture import Panel, Picture, Series
from robots.common.arrays import Array
from robots.common.errors import InputError

BINS = 60
"""Stretches of the coordinate, each of as many samples, whose mean is drawn."""
CLOUD = 900
"""Samples drawn behind the means."""
PANEL_HEIGHT = 300
"""Height of a panel on a screen [px]."""
MARGIN = 1.25
"""Height of a panel over what all means need."""


def cause_picture(
    label: str,
    coordinate: ArrayLike,
    before: ArrayLike,
    after: ArrayLike,
    *,
    title: str,
    unit: str = "N m",
    name: str = "cause",
) -> Picture:
    """Shows the residual without and with an effect over the coordinate that shows it best.

    Args:
        label: the coordinate with its unit.
        coordinate: its values (N,).
        before: residual of the base model (N,); NaN where there is none.
        after: residual of the extended model (N,).
        title: what the picture says.
        unit: of the residuals.
        name: the stem of the file name.

    Raises:
        InputError: arrays that differ in length.
    """
    x, old, new = (np.asarray(values, dtype=np.float64) for values in (coordinate, before, after))
    if not x.shape == old.shape == new.shape or x.ndim != 1:
        raise InputError(f"shapes {x.shape}, {old.shape} and {new.shape}", allowed="(N,), all three")
    kept = np.isfinite(x) & np.isfinite(old) & np.isfinite(new)
    x, old, new = x[kept], old[kept], new[kept]
    curves = [binned(x, values) for values in (old, new)]
    height = max(
        (float(np.abs(mean).max(initial=0.0) + error.max(initial=0.0)) for _, mean, error in curves), default=1
    )
    spread = float(np.quantile(np.abs(old), 0.98)) if len(old) else 1.0
    top = MARGIN * max(height, spread, 1e-12)
    some = np.linspace(0, len(x) - 1, min(CLOUD, len(x))).astype(int) if len(x) else np.zeros(0, dtype=int)
    # A difference of less than a pixel cannot be seen.
    pixel = 2.0 * top / PANEL_HEIGHT
    shift = float(np.quantile(np.abs(old - new), 0.98)) if len(old) else 0.0
    same = len(old) > 0 and max(shift, *(np.abs(curves[0][1] - curves[1][1]))) < pixel
    panels = []
    for heading, values, (middle, mean, error), role in zip(
        ("without this effect", "with this effect"), (old, new), curves, ("residual", "good"), strict=True
    ):
        rms = float(np.sqrt(np.mean(values**2))) if len(values) else 0.0
        panels.append(
            Panel(
                title=f"{heading}: {rms:.3g} {unit} RMS",
                x_label=label,
                y_label=f"measured minus simulated [{unit}]",
                series=(
                    Series(x=x[some], y=values[some], kind="markers", role="neutral", opacity=0.25, name="samples"),
                    Series(x=middle, y=mean, error=error, role=role, name="mean with 95 % interval"),
                ),
                lines=(ZERO,),
                y_range=(-top, top),
            )
        )
    return Picture(
        title=title,
        name=name,
        panels=tuple(panels[:1] if same else panels),
        columns=1 if same else 2,
        panel_height=PANEL_HEIGHT,
        caption="Each dot is a sample of the logs. "
        + (
            f"The residual with this effect differs by less than {pixel:.1g} {unit} and is not drawn again: other "
            "evidence supports this finding."
            if same
            else "For a correct cause, the mean is curved without it and flat with it."
        ),
    )


def binned(x: Array, values: Array) -> tuple[Array, Array, Array]:
    """Averages values over stretches of a coordinate that hold as many samples each.

    Args:
        x: the coordinate (N,).
        values: (N,).

    Returns:
        The stretches' middles, means, and half widths of 95 % intervals that count neighbours as one (M,).
    """
    if not len(x):
        empty = np.zeros(0)
        return empty, empty, empty
    order = np.argsort(x, kind="stable")
    parts = [part for part in np.array_split(order, min(BINS, len(x))) if len(part)]
    middle = np.array([np.median(x[part]) for part in parts])
    mean = np.array([values[part].mean() for part in parts])
    # Samples in succession are no independent ones: only breaks in their order count.
    passes = np.array([1 + np.count_nonzero(np.diff(np.sort(part)) > 1) for part in parts])
    error = np.array([NORMAL_95 * values[part].std() for part in parts]) / np.sqrt(passes)
    merged = np.concatenate([[True], np.diff(middle) > 0])
    return middle[merged], mean[merged], error[merged]


def gain_picture(
    before: ArrayLike, after: ArrayLike, *, joint_names: Sequence[str] | None = None, name: str = "gain"
) -> Picture:
    """Shows the error on held-out data per joint, base and extended model.

    Args:
        before: error divided by torque RMS of the base model (n,).
        after: of the extended model (n,).
        joint_names: names (n,).
        name: the stem of the file name.

    Raises:
        InputError: arrays that differ in length.
    """
    old, new = np.asarray(before, dtype=np.float64), np.asarray(after, dtype=np.float64)
    if old.shape != new.shape or old.ndim != 1:
        raise InputError(f"shapes {old.shape} and {new.shape}", allowed="(n,), both")
    return Picture(
        title="Error of the simulated torque on held-out data",
        name=name,
        panels=(
            joint_bars(
                {"base model": 100 * old, "extended model": 100 * new},
                y_label="error / torque RMS [%]",
                joint_names=joint_names,
                roles=("residual", "good"),
            ),
        ),
    )
