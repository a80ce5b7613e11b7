"""Pictures of friction and heat: friction against time, time constants against power, friction curves cold to warm."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from estimation.thermal import RunFit, ThermalEstimate
from estimation.uncertainty.quantiles import NORMAL_95
from oed.reports.rendering.gaps import break_at_pauses
from oed.reports.rendering.joint_units import joint_titles
from oed.reports.rendering.palette import sequence_role
from oed.reports.rendering.panels import velocity_panel
from oed.reports.rendering.picture import Panel, Picture, Series
from oed.reports.rendering.thinning import thin_indices
from robots.common.arrays import Array
from robots.signals import Log
from robots.thermal import cold_friction

Fits = Sequence[ThermalEstimate | None]

# Curves between cold and warm.
SHADES = 4


@dataclass(frozen=True, kw_only=True)
class DutyRun:
    """A run of a campaign at one duty cycle.

    Attributes:
        label: what the legend says.
        start: on the campaign's clock [s].
        end: of its last log [s].
    """

    label: str
    start: float
    end: float


def duty_runs(logs: Sequence[Log]) -> tuple[DutyRun, ...]:
    """Finds the runs of a campaign by what its logs say of themselves; empty where they say nothing."""
    found: dict[tuple[object, object], DutyRun] = {}
    for log in sorted(logs, key=lambda log: float(log.t[0])):
        run, duty = log.metadata.get("run"), log.metadata.get("duty")
        if not isinstance(duty, int | float) or isinstance(duty, bool):
            continue
        begin = found.get((run, duty))
        start = float(log.t[0]) if begin is None else begin.start
        found[(run, duty)] = DutyRun(label=f"{100 * duty:g} %", start=start, end=float(log.t[-1]))
    return tuple(found.values())


def friction_time_picture(fits: Fits, *, joint_names: Sequence[str] | None = None) -> Picture:
    """Shows each joint's friction over that at T0 against time, measured and predicted."""
    titles = joint_titles(joint_names, len(fits))
    panels = []
    for title, fit in zip(titles, fits, strict=True):
        series: list[Series] = []
        for run in _friction_runs(fit):
            t, dots, line = break_at_pauses(run.t / 60.0, run.measured, run.predicted)
            series += _pair(t, dots, line, "measured", "predicted")
        panels.append(
            Panel(
                title=title,
                x_label="time [min]",
                y_label="friction over cold [1]",
                series=tuple(series),
                note="" if series else "does not move",
            )
        )
    return Picture(
        title="Friction relative to T0 over time",
        name="friction_time",
        panels=tuple(panels),
        shared_x=True,
        panel_height=150,
        caption=(
            "Points are averages over ten seconds. 1 is the friction at the initial temperature T0. Lines end at rests "
            "and pauses."
        ),
    )


def duty_picture(fit: ThermalEstimate, runs: Sequence[DutyRun], *, title: str) -> Picture | None:
    """Shows one joint's friction against the time since each duty cycle began; None for fewer than two of them."""
    series: list[Series] = []
    shown = 0
    for duty in runs:
        for run in _friction_runs(fit):
            inside = (run.t >= duty.start) & (run.t <= duty.end)
            if inside.any():
                t, dots, line = break_at_pauses(
                    (run.t[inside] - duty.start) / 60.0, run.measured[inside], run.predicted[inside]
                )
                role = sequence_role(shown)
                series.append(Series(x=t, y=dots, kind="markers", role=role, opacity=0.5))
                series.append(Series(x=t, y=line, name=duty.label, role=role))
                shown += 1
    if shown < 2:
        return None
    panel = Panel(x_label="time since the run began [min]", y_label="friction over cold [1]", series=tuple(series))
    return Picture(
        title=f"Friction of {title} by duty cycle",
        name="friction_duty",
        panels=(panel,),
        panel_height=320,
        caption="Points are measured, lines are predicted. The percentage is the duty cycle of the warm-up.",
    )


def time_constant_picture(fits: Fits, *, joint_names: Sequence[str] | None = None) -> Picture:
    """Shows time constants against the power at T0, with what the data say at their powers (thesis Fig. 25)."""
    titles, panels = joint_titles(joint_names, len(fits)), []
    for title, fit in zip(titles, fits, strict=True):
        if fit is None:
            continue
        known = _time_constants(fit)
        most = max((power for points in known.values() for power, _, _ in points), default=0.0)
        W = np.linspace(0.0, 2.0 * most if most > 0.0 else 100.0, 60)
        curves = fit.model.time_constants(W) / 60.0
        names = ("slow", "fast") if curves.shape[1] > 1 else ("time constant",)
        series = [Series(x=W, y=curves[:, k], name=name, role=sequence_role(k)) for k, name in enumerate(names)]
        for k, name in enumerate(names):
            points = np.array(known.get(name, []), dtype=np.float64).reshape(-1, 3)
            if len(points):
                x, y, error = points.T
                series.append(
                    Series(x=x, y=y / 60.0, error=NORMAL_95 * error / 60.0, kind="markers", role=sequence_role(k))
                )
        panels.append(
            Panel(title=title, x_label="friction power [W]", y_label="time constant [min]", series=tuple(series))
        )
    return Picture(
        title="Time constants against friction power",
        name="time_constants",
        panels=tuple(panels),
        columns=min(3, len(panels)),
        panel_height=220,
        caption=(
            "Friction power is the mean at the initial temperature T0. Points mark the powers in the data, with 95 % "
            "intervals."
        ),
    )


def friction_curves_picture(
    fits: Fits,
    coefficients: Array,
    velocity: Array,
    *,
    joint_names: Sequence[str] | None = None,
    kinds: Sequence[str] | None = None,
) -> Picture:
    """Shows each joint's friction curve from cold to the warmest that the data saw (thesis Fig. 14).

    Args:
        fits: of the joints (n,).
        coefficients: f1..f4 at T0 (n, 4).
        velocity: up to which the curves go (n,) [rad/s or m/s].
        joint_names: names (n,).
        kinds: "revolute" or "prismatic" of each joint.
    """
    panels = []
    for j, fit in enumerate(fits):
        runs = _friction_runs(fit)
        if not runs:
            continue
        least = min(float(run.predicted.min()) for run in runs)
        most = max(1.0, max(float(run.predicted.max()) for run in runs))
        dq = np.linspace(1e-6, velocity[j], 80)
        cold = cold_friction(dq, coefficients[j])
        series = [
            Series(x=dq, y=factor * cold, name=label, role="main" if k < SHADES - 1 else "residual", opacity=opacity)
            for k, (factor, label, opacity) in enumerate(
                zip(
                    np.linspace(most, least, SHADES),
                    ("coldest", "", "", "warmest"),
                    (1.0, 0.65, 0.35, 1.0),
                    strict=True,
                )
            )
        ]
        note = f"{100 * (most / least - 1.0):.0f} % more when cold" if least > 0.0 else ""
        shown = velocity_panel(j + 1, series, joint_names=joint_names, kinds=kinds, count=len(fits), note=note)
        panels.append(shown)
    return Picture(
        title="Friction against velocity, cold to warm",
        name="friction_curves",
        panels=tuple(panels),
        columns=min(3, len(panels)),
        panel_height=220,
        caption=(
            "From the coldest to the warmest state in the logs, in equal steps. Temperature scales the whole curve "
            "(thesis eq. 100)."
        ),
    )


def _friction_runs(fit: ThermalEstimate | None) -> list[RunFit]:
    return [] if fit is None else [run for run in fit.runs if run.channel == "friction"]


def _pair(t: Array, measured: Array, predicted: Array, first: str, second: str) -> list[Series]:
    keep = thin_indices(measured)
    return [
        Series(x=t[keep], y=measured[keep], name=first, kind="markers", role="measured", opacity=0.5),
        Series(x=t, y=predicted, name=second, role="predicted"),
    ]


def _time_constants(fit: ThermalEstimate) -> Mapping[str, list[tuple[float, float, float]]]:
    """Power, value and standard error [s] by ``slow``, ``fast`` or ``time constant``; only what is determined."""
    found: dict[str, list[tuple[float, float, float]]] = {}
    for item in fit.combinations:
        word, _, power = item.name.partition(" at ")
        if "time constant" in word and item.determined and power.endswith(" W"):
            key = word.removesuffix(" time constant") if word != "time constant" else word
            found.setdefault(key, []).append((float(power.removesuffix(" W")), item.value, item.standard_error))
    return found
