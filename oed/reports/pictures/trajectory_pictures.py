"""Figures of a designed motion: motion of the joints, information content, and margins to the limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from oed.reports.rendering.joint_units import JointUnits, joint_titles, joint_units
from oed.reports.rendering.palette import joint_role, sequence_role
from oed.reports.rendering.panels import joint_bars
from oed.reports.rendering.picture import Line, Panel, Picture, Series, Span
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.plain import significant
from robots.limits import Limits, Margin
from robots.robot import Robot
from robots.signals import Motion

SEGMENT_ROLES = {
    "approach": "neutral",
    "move": "neutral",
    "fourier": "main",
    "excitation": "main",
    "sinusoid": "third",
    "friction": "second",
    "warm_up": "residual",
}
"""Colours of the kinds of segment."""

VISIBLE_LIMIT = 2.5
"""Limits beyond this multiple of the largest magnitude are named, not drawn: the motion would shrink to a line."""


MAXIMUM_USE = 300.0
"""A use beyond this is drawn as this [%]: a motion under a limit of zero uses infinitely much of it."""


def trajectory_picture(
    t: ArrayLike,
    q: ArrayLike,
    dq: ArrayLike,
    ddq: ArrayLike,
    *,
    limits: Limits | None = None,
    joint_names: Sequence[str] | None = None,
    kinds: Sequence[str] | None = None,
    segments: Sequence[Mapping[str, Any]] = (),
    degrees: bool = False,
    name: str = "trajectory",
) -> Picture:
    """Shows position, velocity and acceleration of each joint within its limits.

    Args:
        t: time [s], (N,).
        q: joint positions [rad or m], (N, n).
        dq: joint velocities, (N, n).
        ddq: joint accelerations, (N, n).
        limits: the limits of the n joints.
        joint_names: names, (n,).
        kinds: "revolute" or "prismatic" of each joint, (n,); None where all are revolute.
        segments: entries with kind, start [s] and end [s], as in the design file.
        degrees: whether angles are shown in degrees.
        name: the stem of the file name.

    Raises:
        InputError: arrays of shapes that do not fit.
    """
    times = np.asarray(t, dtype=np.float64)
    signals = [_matrix(label, value, len(times)) for label, value in (("q", q), ("dq", dq), ("ddq", ddq))]
    count = signals[0].shape[1]
    titles, units = joint_titles(joint_names, count), joint_units(kinds, count, degrees=degrees)
    spans = segment_spans(segments)
    panels = []
    for joint in range(count):
        for column, quantity in enumerate(("position", "velocity", "acceleration")):
            values = signals[column][:, joint] * units[joint].factor
            lines = _limit_lines(limits, joint, quantity, units[joint])
            visible, y_range, note = _view(values, lines)
            panels.append(
                Panel(
                    title=f"{titles[joint]} {quantity}",
                    x_label="time [s]",
                    y_label=f"{quantity} [{getattr(units[joint], quantity)}]",
                    series=(Series(x=times, y=values, role=joint_role(joint + 1)),),
                    lines=visible,
                    spans=spans,
                    y_range=y_range,
                    note=note,
                )
            )
    return Picture(
        title="Motion of each joint within its limits",
        name=name,
        panels=tuple(panels),
        columns=3,
        shared_x=True,
        panel_height=130,
        caption="Dashed lines are limits. Limits far outside the range are written in the corner."
        + (" Shaded areas are the segments of the experiment." if spans else ""),
    )


def motion_picture(
    robot: Robot, motion: Motion, *, segments: Sequence[Mapping[str, Any]] = (), name: str = "trajectory"
) -> Picture:
    """Shows a motion of a robot within the limits of its joints.

    Args:
        robot: the robot.
        motion: what it does.
        segments: see `trajectory_picture`.
        name: the stem of the file name.
    """
    return trajectory_picture(
        motion.t,
        motion.q,
        motion.dq,
        motion.ddq,
        limits=robot.limits,
        joint_names=robot.joint_names,
        kinds=robot.chain.kinds,
        segments=segments,
        name=name,
    )


def segment_spans(segments: Sequence[Mapping[str, Any]]) -> tuple[Span, ...]:
    """Turns the segments of a design file into stripes; neighbours of one kind become one.

    Args:
        segments: entries with kind, start [s] and end [s].
    """
    spans: list[Span] = []
    for segment in segments:
        label = str(segment["kind"]).replace("_", " ")
        role = SEGMENT_ROLES.get(str(segment["kind"]), "neutral")
        start, end = float(segment["start"]), float(segment["end"])
        if spans and spans[-1].label == label and abs(spans[-1].end - start) < 1e-9:
            spans[-1] = Span(start=spans[-1].start, end=end, label=label, role=role)
        else:
            spans.append(Span(start=start, end=end, label=label, role=role))
    return tuple(spans)


def spectrum_picture(parts: Mapping[str, ArrayLike], *, name: str = "spectrum") -> Picture:
    """Shows the singular values of the regressor: the excitation of each direction of the parameters.

    Args:
        parts: singular values of each part of an experiment, and of the whole, each (m,), in any order.
        name: the stem of the file name.
    """
    series = []
    for index, (part, values) in enumerate(parts.items()):
        sizes = np.sort(np.asarray(values, dtype=np.float64))[::-1]
        known = sizes[sizes > 0.0]
        cond = significant(float(known[0] / known[-1]), digits=3) if len(known) == len(sizes) else "∞"
        series.append(
            Series(
                x=np.arange(1.0, len(sizes) + 1.0),
                y=np.where(sizes > 0.0, sizes, np.nan),
                name=f"{part} (cond {cond})",
                role=sequence_role(index),
            )
        )
    dots = [Series(x=item.x, y=item.y, name=item.name, kind="markers", role=item.role) for item in series]
    panel = Panel(
        x_label="direction, strongest first",
        y_label="singular value of the regressor [SI]",
        series=(*series, *dots),
        y_log=True,
    )
    return Picture(
        title="Excitation of the parameter directions",
        name=name,
        panels=(panel,),
        panel_height=300,
        caption=(
            "A flatter curve means a better conditioned experiment. The last point is the worst-determined direction."
        ),
    )


def margins_picture(
    margins: Sequence[Margin], *, joint_names: Sequence[str] | None = None, name: str = "margins"
) -> Picture:
    """Shows how much of each limit the motion uses; quantities without a limit are left out.

    Args:
        margins: the closest approach per quantity and joint; of "lower" and "upper" the nearer counts as "position".
        joint_names: names, (n,).
        name: the stem of the file name.

    Raises:
        InputError: no margins.
    """
    if not margins:
        raise InputError("no margins to show", allowed="one or more")
    count = max(margin.joint for margin in margins)
    used: dict[str, Array] = {}
    texts: dict[str, list[str]] = {}
    ranges = {
        joint: sum(margin.joint == joint and np.isfinite(margin.limit) for margin in margins if _is_position(margin))
        for joint in range(1, count + 1)
    }
    for margin in margins:
        quantity = "position" if _is_position(margin) else margin.quantity
        # In a range with two ends, the middle is the farthest from both limits.
        scale = 2.0 if quantity == "position" and ranges[margin.joint] == 2 else 1.0
        use = 100.0 * (1.0 - scale * margin.slack_fraction) if np.isfinite(margin.limit) else np.nan
        row = used.setdefault(quantity, np.full(count, np.nan))
        words = texts.setdefault(quantity, [""] * count)
        if not np.isnan(use) and not row[margin.joint - 1] >= use:
            row[margin.joint - 1] = min(use, MAXIMUM_USE)
            words[margin.joint - 1] = f"{margin.value:.4g} of {margin.limit:.4g} at {margin.time:.3f} s"
    shown = {quantity: row for quantity, row in used.items() if not np.isnan(row).all()} or used
    largest = max(100.0, *(float(np.nanmax(row, initial=0.0)) for row in shown.values()))
    panel = joint_bars(
        shown,
        y_label="use of the limit [%]",
        joint_names=joint_names,
        texts=texts,
        lines=(Line(value=100.0, label="limit"),),
        y_range=(0.0, 1.12 * largest),
    )
    return Picture(
        title="Use of the limits",
        name=name,
        panels=(panel,),
        panel_height=280,
        caption="100 % is on the limit. For positions, 0 % is the middle of the range.",
    )


def _is_position(margin: Margin) -> bool:
    return margin.quantity in ("lower", "upper")


def _limit_lines(limits: Limits | None, joint: int, quantity: str, units: JointUnits) -> tuple[Line, ...]:
    if limits is None:
        return ()
    if quantity == "position":
        bounds = (float(limits.lower[joint]), float(limits.upper[joint]))
    else:
        bound = float(getattr(limits, quantity)[joint])
        bounds = (-bound, bound)
    shown = (bound * units.factor for bound in bounds if np.isfinite(bound))
    return tuple(Line(value=bound, label=significant(bound, digits=3)) for bound in shown)


def _view(values: Array, lines: tuple[Line, ...]) -> tuple[tuple[Line, ...], tuple[float, float] | None, str]:
    """Gives the lines near the data, the y range that holds both, and a note about the lines that are far."""
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 0.0)
    reach = VISIBLE_LIMIT * max(abs(low), abs(high))
    near = tuple(line for line in lines if abs(line.value) <= reach)
    far = [line.label for line in lines if abs(line.value) > reach]
    low, high = min([low, *(line.value for line in near)]), max([high, *(line.value for line in near)])
    if low == high:
        low, high = low - 1.0, high + 1.0
    pad = (0.25 if far else 0.08) * (high - low)
    if len(far) == 2 and far[0].lstrip("-") == far[1]:
        far = [f"±{far[1]}"]
    return near, (low - pad, high + pad), f"limit {', '.join(far)}" if far else ""


def _matrix(name: str, value: ArrayLike, count: int) -> Array:
    array = np.asarray(value, dtype=np.float64)
    if array.ndim != 2 or len(array) != count:
        raise InputError(f"shape {array.shape}", column=name, allowed=f"shape ({count}, n)")
    return array
