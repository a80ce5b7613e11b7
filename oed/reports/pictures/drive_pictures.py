"""Pictures of identified drives: motion, errors by joint, parameters with intervals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimation.actuators import DriveValue, MotionError
from estimation.actuators.result import Trace
from oed.reports.rendering.picture import Panel, Picture, Series

SHOWN = 1500
"""Samples of a curve at most."""


def drive_motion_picture(trace: Trace, joints: Sequence[str], *, name: str = "drive_motion") -> Picture:
    """Shows the error of the simulated motion of each joint over time, as described and identified.

    Args:
        trace: a held-out run.
        joints: names of the joints (n).
        name: the stem of the file name.
    """
    share = slice(None, None, -(-len(trace.t) // SHOWN))
    t = trace.t[share]
    panels = []
    for j, joint in enumerate(joints):
        panels.append(
            Panel(
                title=f"{joint}: motion",
                x_label="time [s]",
                y_label="position [rad]",
                series=(
                    Series(x=t, y=trace.command[share, j], name="command", role="neutral", dash="dot"),
                    Series(x=t, y=trace.measured[share, j], name="measured", role="measured"),
                    Series(x=t, y=trace.identified[share, j], name="simulated", role="predicted", dash="dash"),
                ),
            )
        )
        panels.append(
            Panel(
                title=f"{joint}: error",
                x_label="time [s]",
                y_label="error [mrad]",
                series=tuple(
                    Series(
                        x=t,
                        y=1e3 * (trace.measured - getattr(trace, key))[share, j],
                        name=label,
                        role=role,
                        opacity=opacity,
                    )
                    for key, label, role, opacity in (
                        ("described", "as described", "neutral", 0.8),
                        ("identified", "identified", "residual", 1.0),
                    )
                ),
            )
        )
    return Picture(
        title="Motion on held-out data",
        name=name,
        panels=tuple(panels),
        columns=2,
        shared_x=True,
        panel_height=150,
        caption="Left: positions. Right: measured less simulated.",
    )


def drive_error_picture(errors: Sequence[MotionError], *, name: str = "drive_errors") -> Picture:
    """Shows each joint's error as described and identified.

    Args:
        errors: of the joints.
        name: the stem of the file name.
    """
    place = np.arange(len(errors), dtype=float)
    bars = (("held_out_described", "as described", "neutral"), ("held_out", "identified", "main"))
    panel = Panel(
        y_label="held-out error [mrad]",
        categories=tuple(error.name for error in errors),
        series=tuple(
            Series(x=place, y=np.array([1e3 * getattr(e, key) for e in errors]), name=label, kind="bars", role=role)
            for key, label, role in bars
        ),
    )
    return Picture(title="Error of the simulated position", name=name, panels=(panel,), panel_height=240)


def drive_parameter_picture(parameter: str, values: Sequence[DriveValue]) -> Picture:
    """Shows one parameter of all joints with its intervals, beside what was described.

    Args:
        parameter: its name.
        values: of the joints or classes.
    """
    place = np.arange(len(values), dtype=float)
    middle = np.array([(value.upper + value.lower) / 2 for value in values])
    half = np.array([(value.upper - value.lower) / 2 for value in values])
    panel = Panel(
        y_label=f"{parameter} [{values[0].unit}]",
        categories=tuple(value.group for value in values),
        series=(
            Series(x=place, y=middle, error=half, name="95 % interval", kind="markers", role="main", opacity=0.5),
            Series(
                x=place,
                y=np.array([value.value for value in values]),
                name="identified",
                kind="markers",
                role="measured",
            ),
            Series(
                x=place,
                y=np.array([value.described for value in values]),
                name="described",
                kind="markers",
                role="neutral",
            ),
        ),
    )
    return Picture(title=parameter.replace("_", " "), name=f"drive_{parameter}", panels=(panel,), panel_height=200)
