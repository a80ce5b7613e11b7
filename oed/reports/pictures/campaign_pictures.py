"""Pictures of a campaign: the velocities of a cycle, and the temperatures of the whole."""

from __future__ import annotations

import numpy as np

from oed.campaigns import Campaign, Slot
from oed.reports.rendering.joint_units import joint_titles, joint_units
from oed.reports.rendering.palette import joint_role
from oed.reports.rendering.picture import Line, Panel, Picture, Series, Span
from robots.common.plain import significant

STAGE_ROLES = {"excitation": "main", "friction": "second", "warm_up": "residual", "power_on": "neutral"}
"""Colours of the kinds of stage."""

PHASE_ROLES = {"heating": "residual", "cooling": "third", "power_on": "neutral"}
"""Colours of the phases."""


def velocity_picture(campaign: Campaign, *, name: str = "velocities") -> Picture:
    """Shows the velocity of each joint over one cycle: the first heating cycle, or the first of all.

    Args:
        campaign: the campaign.
        name: the stem of the file name.
    """
    robot, stages = campaign.robot, campaign.stages_by_name
    cycle = next((slot.cycle for slot in campaign.slots if slot.phase == "heating"), 1)
    slots = [slot for slot in campaign.slots if slot.cycle == cycle]
    start = slots[0].start
    t, dq, spans = [], [], []
    for slot in slots:
        begin, end = slot.start - start, slot.end - start
        if slot.stage is None:
            t.append(np.array([begin, end]))
            dq.append(np.zeros((2, robot.n)))
            spans.append(Span(start=begin, end=end, label="rest"))
        else:
            stage = stages[slot.stage]
            t.append(begin + stage.motion.t)
            dq.append(stage.motion.dq)
            label = stage.kind.replace("_", " ")
            spans.append(Span(start=begin, end=end, label=label, role=STAGE_ROLES[stage.kind]))
    times, speeds = np.concatenate(t), np.concatenate(dq)
    titles = joint_titles(robot.joint_names, robot.n)
    units = joint_units(robot.chain.kinds, robot.n)
    panels = []
    for joint in range(robot.n):
        bound = float(robot.limits.velocity[joint])
        panels.append(
            Panel(
                title=titles[joint],
                x_label="time in the cycle [s]",
                y_label=f"velocity [{units[joint].velocity}]",
                series=(Series(x=times, y=speeds[:, joint], role=joint_role(joint + 1)),),
                lines=tuple(Line(value=v, label=significant(v, digits=3)) for v in (-bound, bound) if np.isfinite(v)),
                spans=tuple(spans),
            )
        )
    return Picture(
        title=f"Joint velocities over cycle {cycle}",
        name=name,
        panels=tuple(panels),
        shared_x=True,
        panel_height=140,
        caption="Shaded areas are the stages, dashed lines the velocity limits.",
    )


def temperature_picture(campaign: Campaign, *, name: str = "temperatures") -> Picture:
    """Shows the expected temperatures of each joint over the whole campaign.

    Args:
        campaign: a campaign with a thermal model.
        name: the stem of the file name.
    """
    expected = campaign.temperatures
    assert expected is not None, "a campaign without a thermal model has no temperatures"
    titles = joint_titles(campaign.robot.joint_names, campaign.robot.n)
    minutes = expected.t / 60.0
    panels = tuple(
        Panel(
            title=title,
            x_label="time [min]",
            y_label="temperature [°C]",
            series=tuple(
                Series(x=minutes, y=values[:, joint], name=titles[joint], role=joint_role(joint + 1))
                for joint in range(campaign.robot.n)
            ),
            spans=phase_spans(campaign.slots),
        )
        for title, values in (("heat source (T1)", expected.T1), ("surrounding structure (T2)", expected.T2))
    )
    return Picture(
        title="Expected temperature of each joint over the campaign",
        name=name,
        panels=panels,
        shared_x=True,
        panel_height=280,
        caption=(
            "Forecast by the second-order thermal model with the friction of the robot's description; not measured."
        ),
    )


def phase_spans(slots: tuple[Slot, ...]) -> tuple[Span, ...]:
    """Turns the phases of a timetable into stripes [min], if there are several."""
    spans: list[Span] = []
    for slot in slots:
        label, role = slot.phase.replace("_", " "), PHASE_ROLES[slot.phase]
        if slot.duty is not None:
            label += f" at {100 * slot.duty:g} %"
        begin = slot.start / 60.0
        if spans and spans[-1].label == label:
            begin = spans.pop().start
        spans.append(Span(start=begin, end=slot.end / 60.0, label=label, role=role))
    return tuple(spans) if len(spans) > 1 else ()
