"""Pictures of identified parameters: values with their uncertainty, friction curves, and the error per joint."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from estimation.uncertainty.quantiles import NORMAL_95
from oed.reports.rendering.palette import joint_role
from oed.reports.rendering.panels import ZERO, joint_bars, velocity_panel
from oed.reports.rendering.picture import Line, Panel, Picture, Series
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.plain import significant, with_error

FLAT = 5.0
"""Bars higher than others by this factor flatten them."""

LABEL_LENGTH = 14
"""Longer names of base parameters are cut on the axis; the whole stands in the hover text."""


def parameter_picture(
    names: Sequence[str],
    values: ArrayLike,
    standard_errors: ArrayLike,
    units: Sequence[str],
    *,
    references: ArrayLike | None = None,
    name: str = "parameters",
) -> Picture:
    """Shows each parameter with its 95 % interval, one panel per unit.

    Args:
        names: the parameters, (p,).
        values: their values in SI units, (p,).
        standard_errors: their standard errors, (p,); NaN where they are not known.
        units: their units, (p,).
        references: values to compare with, (p,), NaN where there is none.
        name: the stem of the file name.

    Raises:
        InputError: no parameters, or lengths that differ.
    """
    estimates, errors = np.asarray(values, dtype=np.float64), np.asarray(standard_errors, dtype=np.float64)
    known = None if references is None else np.asarray(references, dtype=np.float64)
    lengths = {len(names), len(estimates), len(errors), len(units), len(names if known is None else known)}
    if lengths == {0} or len(lengths) > 1:
        raise InputError(f"parameters in lists of {sorted(lengths)} entries", allowed="the same number, one or more")
    panels = []
    for unit in dict.fromkeys(units):
        chosen = [index for index, other in enumerate(units) if other == unit]
        place = np.arange(len(chosen), dtype=np.float64)
        texts = tuple(f"{names[index]}: {with_error(estimates[index], errors[index], unit)}" for index in chosen)
        bars = Series(
            x=place,
            y=estimates[chosen],
            error=np.nan_to_num(NORMAL_95 * errors[chosen]),
            name="estimate with 95 % interval",
            kind="bars",
            texts=texts,
        )
        series = [bars]
        if known is not None and np.isfinite(known[chosen]).any():
            series.append(Series(x=place, y=known[chosen], name="reference", kind="markers", role="second"))
        panels.append(
            Panel(
                y_label=f"value [{unit}]" if unit else "value [1]",
                series=tuple(series),
                lines=(ZERO,),
                categories=tuple(_short(names[index]) for index in chosen),
            )
        )
    return Picture(
        title="Parameters with their 95 % intervals",
        name=name,
        panels=tuple(panels),
        panel_height=190,
        caption="One panel per unit. If an interval contains zero, the parameter is not significant.",
    )


def friction_picture(
    coefficients: ArrayLike,
    velocity: ArrayLike,
    *,
    shapes: Callable[[int, Array], Array] | None = None,
    covariances: ArrayLike | None = None,
    references: ArrayLike | None = None,
    joint_names: Sequence[str] | None = None,
    kinds: Sequence[str] | None = None,
    name: str = "friction",
) -> Picture:
    """Shows the friction torque of each joint over its velocity.

    Args:
        coefficients: coefficients of each joint in SI units, (n, k).
        velocity: the highest speed shown of each joint [rad/s or m/s], (n,).
        shapes: (joint counted from 0, velocities (m,)) -> torque per unit of each coefficient (m, k); by default those
            of f1 sign(dq) + f2 dq + f3 dq|dq| + f4 dq^3 (thesis eq. 35).
        covariances: covariance matrices of the coefficients, (n, k, k), for a 95 % ribbon.
        references: coefficients to compare with, such as nominal ones, (n, k).
        joint_names: names, (n,).
        kinds: "revolute" or "prismatic" of each joint, (n,); None where all are revolute.
        name: the stem of the file name.

    Raises:
        InputError: arrays of shapes that do not fit.
    """
    table, speeds = np.asarray(coefficients, dtype=np.float64), np.asarray(velocity, dtype=np.float64)
    if table.ndim != 2 or (shapes is None and table.shape[1] != 4) or speeds.shape != table.shape[:1]:
        raise InputError(f"shapes {table.shape} and {speeds.shape}", allowed="(n, 4) and (n,)")
    known = None if references is None else np.asarray(references, dtype=np.float64)
    spread = None if covariances is None else np.asarray(covariances, dtype=np.float64)
    count = len(table)
    panels = []
    for joint in range(count):
        dq = speeds[joint] * np.concatenate([np.linspace(-1.0, -1e-6, 100), [0.0], np.linspace(1e-6, 1.0, 100)])
        columns = _polynomial(dq) if shapes is None else shapes(joint, dq)
        # Friction is not a function at rest: a gap, not a slope, joins both branches.
        columns[dq == 0.0] = np.nan
        error = None
        if spread is not None:
            error = NORMAL_95 * np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", columns, spread[joint], columns), 0.0))
        # Joints have colours of their own: one entry in the legend would not show all of them.
        label = "identified" if count == 1 else ""
        series = [Series(x=dq, y=columns @ table[joint], error=error, name=label, role=joint_role(joint + 1))]
        if known is not None and np.isfinite(known[joint]).all():
            series.append(Series(x=dq, y=columns @ known[joint], name="reference", role="neutral", dash="dash"))
        panels.append(velocity_panel(joint + 1, series, joint_names=joint_names, kinds=kinds, count=count))
    return Picture(
        title="Friction torque over velocity",
        name=name,
        panels=tuple(panels),
        columns=min(3, count),
        panel_height=210,
        caption="The shaded band is the 95 % interval of the curve." if spread is not None else "",
    )


def error_bars_picture(
    errors: Mapping[str, ArrayLike],
    *,
    rivals: Mapping[str, ArrayLike] | None = None,
    references: Mapping[str, float] | None = None,
    joint_names: Sequence[str] | None = None,
    name: str = "errors",
) -> Picture:
    """Shows the error of each joint, residual RMS over torque RMS, of one model or more.

    Args:
        errors: NRMSE per joint as a fraction, (n,), by what it is of, such as "before" and "after".
        rivals: errors of what the model is compared with, alike; the caption states those that would flatten the rest.
        references: levels to compare with, as fractions, drawn as lines.
        joint_names: names, (n,).
        name: the stem of the file name.

    Raises:
        InputError: no errors, or lengths that differ.
    """
    rows: dict[str, Array] = {label: np.asarray(row, dtype=np.float64) for label, row in errors.items()}
    others = {label: np.asarray(row, dtype=np.float64) for label, row in (rivals or {}).items()}
    top = max((float(np.nanmax(row, initial=0.0)) for row in rows.values()), default=0.0)
    far = {label: row for label, row in others.items() if np.nanmax(row, initial=0.0) > FLAT * top}
    rows |= {label: row for label, row in others.items() if label not in far}
    lengths = {len(row) for row in rows.values()}
    if len(lengths) != 1:
        raise InputError(f"errors of {sorted(lengths)} joints", allowed="one number of joints")
    panel = joint_bars(
        {label: 100.0 * row for label, row in rows.items()},
        y_label="error of the torque [%]",
        joint_names=joint_names,
        lines=[Line(value=100.0 * level, label=label) for label, level in (references or {}).items()],
    )
    return Picture(
        title="Error of the predicted torque",
        name=name,
        panels=(panel,),
        panel_height=280,
        caption="RMS error divided by torque RMS, for each joint." + _stated(far),
    )


def _stated(far: Mapping[str, Array]) -> str:
    if not far:
        return ""
    texts = []
    for label, row in far.items():
        low, high = (significant(100.0 * float(value), digits=2) for value in (np.nanmin(row), np.nanmax(row)))
        texts.append(f"{label} ({low} to {high} %)")
    return f" Not drawn, because the bars would flatten all others: {' and '.join(texts)}."


def _short(name: str) -> str:
    return name if len(name) <= LABEL_LENGTH else name[: LABEL_LENGTH - 1].rstrip(" +-") + "…"


def _polynomial(dq: Array) -> Array:
    return np.column_stack([np.sign(dq), dq, dq * np.abs(dq), dq**3])
