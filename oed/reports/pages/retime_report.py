"""The page of a retimed experiment."""

from __future__ import annotations

import numpy as np

from oed.criteria import CRITERIA
from oed.experiments import RetimedExperiment
from oed.experiments.safety_checks.margins import nominal_torque
from oed.reports.animations.building import animate
from oed.reports.pages.design_report import margins_section, parameters_section, quality_section
from oed.reports.pages.motions.motion_report import animation_section
from oed.reports.pictures.trajectory_pictures import motion_picture
from oed.reports.rendering.page import Cell, Fact, Page, Section, Table, page_of
from robots.common.plain import finite
from robots.signals import Motion


def retime_page(result: RetimedExperiment, given: Motion) -> Page:
    """Builds the page: gain and cost of the new timing."""
    robot, retimed = result.robot, result.retimed
    before, after = result.before.cond, result.after.cond
    pictures = tuple(
        motion_picture(robot, motion, name=stem) for stem, motion in (("after", result.motion), ("before", given))
    )
    return page_of(
        result,
        title="Retimed path",
        robot=robot.title or robot.name,
        facts=(
            Fact(label=f"{CRITERIA['cond']().label} before", value=before if before is not None else "not all excited"),
            Fact(label="cond(Y) after", value=after if after is not None else "not all excited"),
            Fact(label="Duration before", value=f"{retimed.duration_before:.3f} s"),
            Fact(
                label="Duration after",
                value=f"{retimed.duration_after:.3f} s",
                status="note" if retimed.slower and retimed.given_keeps_limits else "neutral",
            ),
            Fact(label="Intermediate stops", value=retimed.stops),
            Fact(
                label="Path deviation",
                value=f"{retimed.deviation:.2g}",
                note=f"{retimed.unit}, largest of all joints",
            ),
        ),
        sections=(
            Section(title="New motion", pictures=pictures[:1]),
            animation_section(
                animate(
                    robot,
                    result.motion,
                    torque=nominal_torque(result.base, result.motion),
                    margins=result.margins,
                    source="retimed motion",
                )
            ),
            *_torque_sections(result),
            quality_section((result.before, result.after)),
            margins_section(tuple(m for m in result.margins if np.isfinite(m.limit)), robot.joint_names),
            Section(title="Given motion", pictures=pictures[1:], folded=True),
            parameters_section(result.base.names, result.base.formulas()),
        ),
    )


def _torque_sections(result: RetimedExperiment) -> tuple[Section, ...]:
    before, after = result.torque_before, result.torque_after
    if before is None or after is None:
        return ()
    limits = result.robot.limits.torque
    rows: tuple[tuple[Cell, ...], ...] = tuple(
        (
            name,
            float(before.peak[joint]),
            float(after.peak[joint]),
            finite(limits[joint]),
            float(before.rms[joint]),
            float(after.rms[joint]),
        )
        for joint, name in enumerate(result.robot.joint_names)
    )
    table = Table(
        headings=("joint", "peak before", "peak after", "peak allowed", "RMS before", "RMS after"),
        rows=rows,
        caption="In N m (prismatic joints: N), by the nominal model with friction.",
    )
    return (Section(title="Torque", tables=(table,)),)
