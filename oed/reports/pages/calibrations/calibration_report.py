"""The page of a calibration."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from estimation.calibrations import Calibration
from estimation.calibrations.result import SHOWN, error_words
from oed.reports.animations.animation import Animation
from oed.reports.animations.building import animate
from oed.reports.rendering.joint_units import joint_titles
from oed.reports.rendering.page import Cell, Fact, Page, Section, Table, page_of, table_of
from oed.reports.rendering.picture import Panel, Picture, Series
from robots.common.arrays import Array
from robots.geometry_errors.poses import approaches
from robots.geometry_errors.state import ArmState, gravity_loads
from robots.geometry_errors.terms import error_term
from robots.geometry_errors.terms.joint_compliance import axis_loads
from robots.robot import Robot
from robots.signals import Motion

WORST = 6  # poses in the picture of the robot
HOLD, MOVE, STEP = 1.0, 1.5, 0.04  # s at a pose, between two, and between frames


def calibration_page(calibration: Calibration) -> Page:
    """Builds the page: errors before and after, what was fitted, what is left open, and the worst poses in 3-D."""
    levels, shown = calibration.levels, calibration.shown
    better = levels.held_out < levels.before
    return page_of(
        calibration,
        title="Calibration",
        robot=calibration.robot.name,
        facts=(
            Fact(label="Before", value=shown(levels.before), note=error_words(calibration.measurement)),
            Fact(label="After, held out", value=shown(levels.held_out), status="good" if better else "act"),
            Fact(label="Poses", value=len(calibration.poses.line), note=f"{len(calibration.outliers)} left out"),
        ),
        sections=(
            Section(
                title="Errors",
                paragraphs=(
                    "Each pose was predicted by a fit to others that are not alike. Outside the range of those the "
                    "error is larger.",
                ),
                pictures=(_pose_picture(calibration), _joint_picture(calibration), *_session_picture(calibration)),
                tables=(_level_table(calibration),),
            ),
            Section(
                title="Worst poses",
                paragraphs=(
                    f"The robot visits the {min(WORST, len(calibration.poses.line))} poses with the largest held-out "
                    "errors, the largest first.",
                ),
                animation=_animation(calibration),
                tables=(_worst_table(calibration),),
            ),
            Section(
                title="Causes",
                paragraphs=_cause_paragraphs(calibration),
                pictures=tuple(_load_picture(calibration)),
                tables=(_evidence_table(calibration),),
            ),
            Section(title="What was fitted", tables=(_trial_table(calibration), _parameter_table(calibration))),
            Section(title="What the poses leave open", tables=(_open_table(calibration),), folded=True),
        ),
    )


def _pose_picture(calibration: Calibration) -> Picture:
    unit, factor = SHOWN[calibration.unit]
    poses = calibration.poses
    place = np.arange(1.0, len(poses.line) + 1.0)
    texts = tuple(f"pose {k + 1}, line {line}" for k, line in enumerate(poses.line))
    series = [
        Series(x=place, y=factor * values, name=name, kind="markers", role=role, texts=texts)
        for values, name, role in (
            (poses.before, "description", "second"),
            (poses.held_out, "calibrated, held out", "main"),
        )
    ]
    panel = Panel(title="Error of each pose", x_label="pose", y_label=f"error [{unit}]", series=tuple(series))
    return Picture(name="poses", title="Error of each pose, before and after", panels=(panel,))


def _joint_picture(calibration: Calibration) -> Picture:
    labels = [f"position [{'m' if kind == 'prismatic' else 'rad'}]" for kind in calibration.robot.chain.kinds]
    panels = _error_panels(calibration, labels, calibration.poses.q)
    return Picture(name="joints", title="Error over the position of each joint", panels=panels, columns=2)


def _session_picture(calibration: Calibration) -> Iterator[Picture]:
    """The mean error of each session by axis: a base that moved between two shows as a step."""
    poses, (unit, factor) = calibration.poses, SHOWN[calibration.unit]
    if poses.session is None or poses.shift is None or poses.shift_before is None or np.ptp(poses.session) == 0:
        return
    numbers = np.unique(poses.session)
    shown = (("description", poses.shift_before, "second"), ("calibrated, held out", poses.shift, "main"))
    names = {3: ("x", "y", "z"), 2: ("first", "second"), 1: ("error",)}[poses.shift.shape[1]]
    panels = []
    for axis, title in enumerate(names):
        series = []
        for name, shift, role in shown:
            own = [factor * shift[(poses.session == number) & poses.used, axis] for number in numbers]
            own = [values[np.isfinite(values)] for values in own]
            mean = np.array([values.mean() if len(values) else np.nan for values in own])
            # Two standard errors of the mean.
            error = np.array(
                [2.0 * values.std(ddof=1) / np.sqrt(len(values)) if len(values) > 1 else 0.0 for values in own]
            )
            series.append(Series(x=numbers.astype(float), y=mean, error=error, name=name, kind="markers", role=role))
        label = f"mean error [{unit}]"
        panels.append(Panel(title=title, x_label="session", y_label=label, series=tuple(series)))
    title = "Mean error of each session, by axis of the measurement"
    yield Picture(name="sessions", title=title, panels=tuple(panels), columns=len(panels))


def _error_panels(calibration: Calibration, labels: Sequence[str], values: Array) -> tuple[Panel, ...]:
    """The error of all poses over a quantity of each joint (N, n)."""
    unit, factor = SHOWN[calibration.unit]
    poses, robot = calibration.poses, calibration.robot
    shown = (("description", poses.before, "second"), ("calibrated, held out", poses.held_out, "main"))
    return tuple(
        Panel(
            title=title,
            x_label=labels[j],
            y_label=f"error [{unit}]",
            series=tuple(
                Series(x=values[:, j], y=factor * errors, name=name, kind="markers", role=role)
                for name, errors, role in shown
            ),
        )
        for j, title in enumerate(joint_titles(robot.joint_names, robot.n))
    )


def _cause_paragraphs(calibration: Calibration) -> tuple[str, ...]:
    found = calibration.causes.get("findings", ())
    if not found:
        return ("No single cause is significant.",)
    return (
        "Causes of what the description gets wrong, those with the largest share of the squared error first. The table "
        "has the p-value of each by itself.",
    )


def _load_picture(calibration: Calibration) -> Iterator[Picture]:
    """The error over what bends the arm, and over the direction in which each joint came to the pose."""
    poses, robot = calibration.poses, calibration.robot
    drivers = []
    if robot.has_masses:
        torque = axis_loads(robot, ArmState(q=poses.q, load=gravity_loads(robot, poses.q)))
        drivers.append(("loads", "Error over the torque of gravity", "torque of gravity [N m or N]", torque))
    drivers.append(("approaches", "Error over the direction of approach", "direction", approaches(poses.q)))
    for name, title, label, values in drivers:
        panels = _error_panels(calibration, [label] * robot.n, values)
        yield Picture(name=name, title=title, panels=panels, columns=2)


def _evidence_table(calibration: Calibration) -> Table:
    evidence: Mapping[str, float] = calibration.causes.get("evidence", {})
    return table_of(
        sorted(evidence.items(), key=lambda pair: pair[1]),
        {
            "cause": lambda pair: pair[0],
            "p-value by itself": lambda pair: "below 0.001" if pair[1] < 0.001 else f"{pair[1]:.2g}",
        },
        caption="Each alone beside the setup, corrected for the number of causes.",
    )


def _level_table(calibration: Calibration) -> Table:
    levels, unit = calibration.levels, SHOWN[calibration.unit]
    rows: list[tuple[Cell, ...]] = [
        ("description, setup fitted", unit[1] * levels.before),
        ("calibrated, fitted poses", unit[1] * levels.after),
        ("calibrated, held-out poses", unit[1] * levels.held_out),
        ("  within the range of the others", _cell(unit[1] * levels.inside)),
        (f"  outside it ({levels.outside_count} poses)", _cell(unit[1] * levels.outside)),
    ]
    if calibration.repeatability is not None:
        rows.append(("repeated poses (floor)", unit[1] * calibration.repeatability.error))
    if calibration.check is not None:
        rows += [
            ("other file: description", unit[1] * calibration.check.before),
            ("other file: calibrated", unit[1] * calibration.check.held_out),
        ]
    return Table(headings=("poses", f"RMS error [{unit[0]}]"), rows=tuple(rows))


def _trial_table(calibration: Calibration) -> Table:
    unit, factor = SHOWN[calibration.unit]
    return table_of(
        calibration.trials,
        {
            "kind of errors": lambda t: error_term(t.kind).title,
            f"held-out error without [{unit}]": lambda t: factor * t.without,
            f"with [{unit}]": lambda t: factor * t.with_it,
            "supported": lambda t: t.added,
        },
        caption="Kinds of errors in the order in which they were added; those without support last.",
    )


def _parameter_table(calibration: Calibration) -> Table:
    return table_of(
        calibration.parameters,
        {
            "parameter": lambda item: item.name,
            "value": lambda item: item.shown[1] * item.value,
            "standard error": lambda item: item.shown[1] * item.standard_error,
            "lower": lambda item: item.shown[1] * item.lower,
            "upper": lambda item: item.shown[1] * item.upper,
            "unit": lambda item: item.shown[0],
        },
        caption="Lower and upper end of the 95 % interval.",
    )


def _open_table(calibration: Calibration) -> Table:
    return table_of(
        calibration.undetermined,
        {
            "parameter": lambda item: item.name,
            "what would show it": lambda item: "no pose" if item.reason == "redundant" else "other poses",
            "why": lambda item: item.sentence(),
        },
    )


def _worst(calibration: Calibration) -> list[int]:
    errors = np.nan_to_num(calibration.poses.held_out, nan=-1.0)
    return [int(k) for k in np.argsort(-errors)[:WORST]]


def _worst_table(calibration: Calibration) -> Table:
    unit, factor = SHOWN[calibration.unit]
    poses = calibration.poses
    rows: list[tuple[Cell, ...]] = [
        (k + 1, int(poses.line[k]), _cell(factor * poses.before[k]), _cell(factor * poses.held_out[k]))
        for k in _worst(calibration)
    ]
    return Table(headings=("pose", "line", f"before [{unit}]", f"after, held out [{unit}]"), rows=tuple(rows))


def _animation(calibration: Calibration) -> Animation:
    q = calibration.poses.q[_worst(calibration)]
    return animate(calibration.corrected, visiting(calibration.robot, q), margins=(), source="tour of the worst poses")


def visiting(robot: Robot, q: Array) -> Motion:
    """A motion for pictures that holds at each pose and moves smoothly to the next.

    Args:
        robot: for the number of joints.
        q: poses (K, n) [rad or m].
    """
    rows: list[Array] = []
    share = np.arange(0.0, 1.0, STEP / MOVE)
    smooth = 0.5 - 0.5 * np.cos(np.pi * share)
    for k, pose in enumerate(q):
        rows.append(np.repeat(pose[None], max(int(HOLD / STEP), 2), axis=0))
        if k + 1 < len(q):
            rows.append(pose + smooth[:, None] * (q[k + 1] - pose))
    path = np.vstack(rows)
    t = np.asarray(STEP * np.arange(len(path)), dtype=float)
    speed = np.gradient(path, STEP, axis=0)
    return Motion(t=t, q=path, dq=speed, ddq=np.gradient(speed, STEP, axis=0))


def _cell(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
