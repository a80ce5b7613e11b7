"""Figures of measured and predicted torque, and of the residual."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from estimation.uncertainty.correlations import autocorrelation
from estimation.uncertainty.quantiles import NORMAL_95
from oed.reports.rendering.gaps import break_at_pauses
from oed.reports.rendering.joint_units import joint_titles, joint_units
from oed.reports.rendering.palette import joint_role
from oed.reports.rendering.panels import ZERO
from oed.reports.rendering.picture import Band, Panel, Picture, Series
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.plain import rounded_percent, significant

BINS = 41
LAGS = 200
"""Longest lag of the autocorrelation, in samples."""

WIDE = 1.5
"""A band that is so much higher than the rest of a residual plot is cut at its edges."""


def torque_picture(
    t: ArrayLike,
    measured: ArrayLike,
    predicted: ArrayLike,
    *,
    band: ArrayLike | None = None,
    joint_names: Sequence[str] | None = None,
    kinds: Sequence[str] | None = None,
    errors: Sequence[tuple[float, float]] | None = None,
    why_gaps: str = "",
    name: str = "torque",
) -> Picture:
    """Shows measured against predicted torque of each joint, and the residual beside it.

    Args:
        t: time [s], (N,).
        measured: torques [N m, or N of a prismatic joint], (N, n); NaN where there is none.
        predicted: torques of the model, (N, n).
        band: half-widths of a band about the prediction that holds 95 % of new errors, (n,) or (N, n); NaN where
            none is known.
        joint_names: names, (n,).
        kinds: "revolute" or "prismatic" of each joint, (n,); None where all are revolute.
        errors: RMS of error and torque of each joint as the result states them (n,), on rows that it judges; None for
            those of the rows that are drawn.
        why_gaps: where and why rows have no prediction, to complete "The predicted line has gaps".
        name: the stem of the file name.

    Raises:
        InputError: arrays of shapes that do not fit.
    """
    times = np.asarray(t, dtype=np.float64)
    truth, model = _matrix("measured", measured), _matrix("predicted", predicted)
    if truth.shape != model.shape or len(times) != len(truth):
        raise InputError(f"shapes {times.shape}, {truth.shape} and {model.shape}", allowed="(N,), (N, n) and (N, n)")
    count = truth.shape[1]
    widths = _widths(band, truth.shape)
    gaps = np.isfinite(truth) & ~np.isfinite(model)
    times, truth, model, *broken = break_at_pauses(times, truth, model, *([] if widths is None else [widths]))
    widths = broken[0] if broken else None
    titles, units = joint_titles(joint_names, count), joint_units(kinds, count)
    panels = []
    for joint in range(count):
        width = None if widths is None or not np.isfinite(widths[:, joint]).any() else widths[:, joint]
        residual = truth[:, joint] - model[:, joint]
        drawn = _rms(residual), _rms(truth[:, joint][np.isfinite(residual)])
        level, size = drawn if errors is None else errors[joint]
        unit = units[joint].torque
        share = f" ({rounded_percent(level / size)} of the torque)" if size > 0.0 else ""
        panels += [
            Panel(
                title=titles[joint],
                x_label="time [s]",
                y_label=f"{units[joint].effort} [{unit}]",
                note=f"{rounded_percent(left, 2)} not predicted" if (left := float(gaps[:, joint].mean())) else "",
                series=(
                    *measured_line(times, truth[:, joint]),
                    Series(
                        x=times,
                        y=model[:, joint],
                        name="predicted" if width is None else "predicted, 95 % band",
                        role="predicted",
                        opacity=0.9,
                        error=width,
                    ),
                ),
            ),
            Panel(
                title=f"{titles[joint]} residual: {significant(level, digits=3)} {unit} RMS{share}",
                x_label="time [s]",
                y_label=f"residual [{unit}]",
                series=(*_band_of(times, width), Series(x=times, y=residual, name="residual", role="residual")),
                lines=(ZERO,),
                y_range=_view(residual, width),
                note="" if np.isfinite(residual).any() else "no measured torque to compare with",
            ),
        ]
    return Picture(
        title="Measured and predicted torque",
        name=name,
        panels=tuple(panels),
        columns=2,
        shared_x=True,
        panel_height=150,
        caption="Measured and predicted torque, and measured minus predicted on its own scale. Lines end at pauses."
        + ("" if widths is None else " The band is to contain 95 % of the errors.")
        + (f" The predicted line has gaps {why_gaps}." if gaps.any() and why_gaps else ""),
    )


def measured_line(t: Array, values: Array) -> tuple[Series, ...]:
    """Draws a measured signal, if there is one.

    Args:
        t: times [s], (N,).
        values: (N,); all NaN where nothing was measured.
    """
    return (Series(x=t, y=values, name="measured", role="measured"),) if np.isfinite(values).any() else ()


def _view(residual: Array, width: Array | None) -> tuple[float, float] | None:
    """The range that shows the residual and the usual band; None where that is all there is.

    Friction at standstill makes the band many times wider, which would flatten the residual in motion.
    """
    known = np.abs(residual[np.isfinite(residual)])
    widths = np.empty(0) if width is None else width[np.isfinite(width)]
    if not len(known) or not len(widths):
        return None
    half = 1.1 * max(float(known.max()), float(np.median(widths)))
    return (-half, half) if widths.max() > WIDE * half else None


def _band_of(t: Array, width: Array | None) -> tuple[Series, ...]:
    if width is None:
        return ()
    # Where it keeps its width, its corners are enough.
    same = np.concatenate([[False], (np.diff(width) == 0.0) | (np.isnan(width[1:]) & np.isnan(width[:-1]))])
    corners = ~(same & np.concatenate([same[1:], [False]]))
    t, width = t[corners], width[corners]
    middle = np.where(np.isfinite(width), 0.0, np.nan)
    return (Series(x=t, y=middle, error=width, name="95 % band", role="predicted", opacity=0.0),)


def residual_picture(
    residual: ArrayLike,
    velocity: ArrayLike,
    *,
    period: float,
    joint_names: Sequence[str] | None = None,
    kinds: Sequence[str] | None = None,
    name: str = "residual",
) -> Picture:
    """Shows distribution, autocorrelation and velocity dependence of each joint's residual.

    Args:
        residual: measured minus predicted torque, (N, n), uniform in time; NaN where there is none.
        velocity: joint velocities [rad/s or m/s], (N, n).
        period: sample period [s].
        joint_names: names, (n,).
        kinds: "revolute" or "prismatic" of each joint, (n,); None where all are revolute.
        name: the stem of the file name.

    Raises:
        InputError: arrays of shapes that do not fit.
    """
    errors, speeds = _matrix("residual", residual), _matrix("velocity", velocity)
    if errors.shape != speeds.shape:
        raise InputError(f"shapes {errors.shape} and {speeds.shape}", allowed="the same shape (N, n)")
    count = errors.shape[1]
    titles, units = joint_titles(joint_names, count), joint_units(kinds, count)
    panels: list[Panel] = []
    for joint in range(count):
        panels += [
            _histogram(errors[:, joint], titles[joint], units[joint].torque, joint_role(joint + 1)),
            _memory(errors[:, joint], titles[joint], period, joint_role(joint + 1)),
            _against_velocity(
                errors[:, joint],
                speeds[:, joint],
                titles[joint],
                (units[joint].velocity, units[joint].torque),
                joint_role(joint + 1),
            ),
        ]
    return Picture(
        title="Residuals",
        name=name,
        panels=tuple(panels),
        columns=3,
        panel_height=150,
        caption=(
            "For white noise the histogram is bell-shaped, the autocorrelation stays within the 95 % band beyond lag "
            "0, and the mean over velocity is flat (bin means with standard deviation)."
        ),
    )


def _histogram(errors: Array, title: str, unit: str, role: str) -> Panel:
    known = errors[np.isfinite(errors)]
    if len(known) == 0:
        return Panel(title=f"{title} spread", note="no data")
    deviation = float(known.std())
    # Outliers beyond six deviations would leave the bell a single bar.
    reach = min(float(np.abs(known - known.mean()).max()), 6.0 * deviation) or 1.0
    edges = np.linspace(known.mean() - reach, known.mean() + reach, BINS + 1)
    density, _ = np.histogram(known, bins=edges)
    width = edges[1] - edges[0]
    middle: Array = 0.5 * (edges[1:] + edges[:-1])
    series = [Series(x=middle, y=density / (len(known) * width), kind="bars", role=role, opacity=0.75)]
    if deviation > 0.0:
        bell = np.exp(-0.5 * ((middle - known.mean()) / deviation) ** 2) / (deviation * np.sqrt(2.0 * np.pi))
        series.append(Series(x=middle, y=bell, name="normal distribution", role="neutral"))
    return Panel(
        title=f"{title} spread", x_label=f"residual [{unit}]", y_label=f"density [1/({unit})]", series=tuple(series)
    )


def _memory(errors: Array, title: str, period: float, role: str) -> Panel:
    lags = min(LAGS, len(errors) - 1)
    times: Array = period * np.arange(lags + 1, dtype=np.float64)
    correlation = autocorrelation(errors, lags, by_pairs=True)
    bound = NORMAL_95 / np.sqrt(max(int(np.isfinite(errors).sum()), 1))
    return Panel(
        title=f"{title} memory",
        x_label="lag [s]",
        y_label="autocorrelation [1]",
        series=(Series(x=times, y=correlation, role=role),),
        bands=(Band(low=-bound, high=bound, label="white noise, 95 %"),),
        y_range=(min(-0.3, 1.1 * float(np.nanmin(correlation))) if np.isfinite(correlation).any() else -0.3, 1.05),
    )


def _against_velocity(errors: Array, speeds: Array, title: str, units: tuple[str, str], role: str) -> Panel:
    known = np.isfinite(errors) & np.isfinite(speeds)
    errors, speeds = errors[known], speeds[known]
    title, x_label, y_label = f"{title} over velocity", f"velocity [{units[0]}]", f"residual [{units[1]}]"
    if len(errors) < 2:
        return Panel(title=title, x_label=x_label, y_label=y_label, note="no data")
    edges = np.linspace(speeds.min(), speeds.max() + 1e-12, 26)
    index = np.clip(np.searchsorted(edges, speeds, side="right") - 1, 0, len(edges) - 2)
    number = np.bincount(index, minlength=len(edges) - 1)
    full = number >= 5
    total = np.maximum(number, 1)
    mean = np.bincount(index, errors, len(edges) - 1) / total
    spread = np.sqrt(np.maximum(np.bincount(index, errors**2, len(edges) - 1) / total - mean**2, 0.0))
    return Panel(
        title=title,
        x_label=x_label,
        y_label=y_label,
        series=(
            Series(x=0.5 * (edges[1:] + edges[:-1])[full], y=mean[full], error=spread[full], kind="markers", role=role),
        ),
        lines=(ZERO,),
    )


def _widths(band: ArrayLike | None, shape: tuple[int, ...]) -> Array | None:
    if band is None:
        return None
    widths = np.asarray(band, dtype=np.float64)
    if widths.shape not in (shape, shape[1:]):
        raise InputError(f"shape {widths.shape}", column="band", allowed=f"{shape[1:]} or {shape}")
    return np.broadcast_to(widths, shape)


def _rms(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else float("nan")


def _matrix(name: str, value: ArrayLike) -> Array:
    array = np.asarray(value, dtype=np.float64)
    if array.ndim != 2:
        raise InputError(f"shape {array.shape}", column=name, allowed="shape (N, n)")
    return array
