"""The page of a campaign."""

from __future__ import annotations

from itertools import groupby

import numpy as np

from oed.campaigns import Campaign, Slot, Stage
from oed.reports.pictures.campaign_pictures import temperature_picture, velocity_picture
from oed.reports.rendering.page import Cell, Fact, Page, Section, Table, page_of, table_of


def campaign_page(campaign: Campaign) -> Page:
    """Builds the page: what runs when, how each stage moves, and how hot the robot is expected to get."""
    robot = campaign.robot
    temperature = _temperature_sections(campaign)
    return page_of(
        campaign,
        title="Campaign",
        robot=robot.title or robot.name,
        facts=_facts(campaign),
        sections=(
            Section(
                title="Schedule",
                paragraphs=(
                    (
                        "Play each file completely, one row per controller period. The next file may follow "
                        "immediately. Rest means: motors on in the home pose, no motion."
                    ),
                ),
                pictures=(velocity_picture(campaign),),
                tables=(_phases(campaign), _cycle_table(campaign)),
            ),
            *temperature,
            Section(title="Heat", tables=(_heat_table(campaign),)),
            Section(title="Limits", tables=(_limit_table(campaign.stages),)),
            *_friction_sections(campaign),
            Section(title="Timetable", tables=(_timetable(campaign.slots),), folded=True),
        ),
    )


def _facts(campaign: Campaign) -> tuple[Fact, ...]:
    facts = [
        Fact(label="Duration", value=f"{campaign.duration / 60:.1f} min"),
        Fact(label="Cycles", value=campaign.cycles),
        Fact(label="Samples", value=campaign.samples),
        Fact(label="Friction heat", value=f"{campaign.cycle_heat.sum() / 1e6:.3g} MJ", note="all joints, as described"),
    ]
    if campaign.temperatures is not None:
        peak = campaign.temperatures.T1.max(axis=0)
        facts.append(
            Fact(
                label="Highest expected temperature",
                value=f"{peak.max():.0f} °C",
                note=f"joint {int(peak.argmax()) + 1}, ambient {campaign.ambient:g} °C",
            )
        )
    return tuple(facts)


def _phases(campaign: Campaign) -> Table:
    """One row per phase of a run."""
    rows: list[tuple[Cell, ...]] = []
    for (run, phase), group in groupby(campaign.slots, key=lambda slot: (slot.run, slot.phase)):
        slots = list(group)
        count = len({slot.cycle for slot in slots})
        duty = slots[0].duty
        rows.append(
            (
                phase.replace("_", " "),
                run or None,
                None if duty is None else 100.0 * duty,
                f"{slots[0].cycle} to {slots[-1].cycle}",
                count,
                slots[0].start / 60.0,
                slots[-1].end / 60.0,
            )
        )
    headings = ("phase", "run", "duty [%]", "cycles", "count", "start [min]", "end [min]")
    return Table(headings=headings, rows=tuple(rows), caption="The phases of the campaign.")


def _cycle_table(campaign: Campaign) -> Table:
    """The lines of one cycle of each kind."""
    rows: list[tuple[Cell, ...]] = []
    seen = set()
    for _, group in groupby(campaign.slots, key=lambda slot: slot.cycle):
        slots = list(group)
        kind = (slots[0].phase, slots[0].duty)
        if kind in seen:
            continue
        seen.add(kind)
        rows += [
            (
                f"{slot.phase.replace('_', ' ')}{'' if slot.duty is None else f' {100 * slot.duty:g} %'}",
                slot.stage or "rest",
                f"{slot.start - slots[0].start:.3f}",
                f"{slot.end - slots[0].start:.3f}",
                slot.duration,
            )
            for slot in slots
        ]
    headings = ("cycle", "stage", "start [s]", "end [s]", "duration [s]")
    return Table(
        headings=headings, rows=tuple(rows), caption="One cycle of each kind. Times count from the start of the cycle."
    )


def _timetable(slots: tuple[Slot, ...]) -> Table:
    return table_of(
        slots,
        {
            "start [s]": lambda slot: f"{slot.start:.3f}",
            "end [s]": lambda slot: f"{slot.end:.3f}",
            "cycle": lambda slot: slot.cycle,
            "phase": lambda slot: slot.phase.replace("_", " "),
            "file": lambda slot: slot.file or "rest",
        },
        caption="All times count from the start of the campaign.",
    )


def _heat_table(campaign: Campaign) -> Table:
    names = campaign.robot.joint_names
    rows: list[tuple[Cell, ...]] = []
    for stage in campaign.stages:
        heat = campaign.heat[stage.name]
        rows.append((f"{stage.name}, kJ", *(float(value) / 1e3 for value in heat), float(heat.sum()) / 1e3))
        mean = heat / stage.duration
        rows.append((f"{stage.name}, mean W", *(float(value) for value in mean), float(mean.sum())))
    kinds: dict[tuple[str, float | None], int] = {}
    for slot in campaign.slots:
        kinds.setdefault((slot.phase, slot.duty), slot.cycle)
    for (phase, duty), cycle in kinds.items():
        heat = campaign.cycle_heat[cycle - 1]
        label = f"cycle of {phase.replace('_', ' ')}{'' if duty is None else f' at {100 * duty:g} %'}, kJ"
        rows.append((label, *(float(value) / 1e3 for value in heat), float(heat.sum()) / 1e3))
    total = campaign.cycle_heat.sum(axis=0)
    rows.append(("whole campaign, kJ", *(float(value) / 1e3 for value in total), float(total.sum()) / 1e3))
    return Table(
        headings=("", *names, "all"),
        rows=tuple(rows),
        caption="Friction torque times velocity. The friction of the robot's description is used at all temperatures.",
    )


def _limit_table(stages: tuple[Stage, ...]) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for stage in stages:
        quantities = dict.fromkeys(margin.quantity for margin in stage.margins if np.isfinite(margin.limit))
        for quantity in quantities:
            worst = min((m for m in stage.margins if m.quantity == quantity), key=lambda m: m.slack_fraction)
            rows.append(
                (stage.name, quantity, worst.joint, worst.value, worst.limit, 100 * worst.slack_fraction, worst.time)
            )
    headings = ("stage", "limit", "joint", "value", "bound", "left [%]", "at [s]")
    return Table(headings=headings, rows=tuple(rows), caption="Smallest distances at the samples of the files.")


def _friction_sections(campaign: Campaign) -> tuple[Section, ...]:
    stage = next((stage for stage in campaign.stages if stage.kind == "friction"), None)
    if stage is None:
        return ()
    details = stage.details
    rows: tuple[tuple[Cell, ...], ...] = tuple(
        (name, details["angle_to_no_gravity_deg"][j], details["time_at_each_speed"][j], _speeds(stage, j + 1))
        for j, name in enumerate(campaign.robot.joint_names)
    )
    table = Table(
        headings=("joint", "angle to no gravity [°]", "time at each speed [s]", "speeds, both ways"), rows=rows
    )
    return (
        Section(
            title="Friction stage",
            paragraphs=("Each joint moves alone. At 0° gravity does no work on it (a revolute axis is vertical).",),
            tables=(table,),
        ),
    )


def _speeds(stage: Stage, joint: int) -> str:
    speeds = sorted({round(abs(p["speed"]), 6) for p in stage.plateaus if p["joint"] == joint})
    return ", ".join(f"{speed:.3g}" for speed in speeds)


def _temperature_sections(campaign: Campaign) -> tuple[Section, ...]:
    if campaign.thermal is None or campaign.temperatures is None:
        return ()
    rows: list[tuple[Cell, ...]] = []
    power = campaign.cycle_heat.max(axis=0) / campaign.programme.cycle_time
    for joint, (model, source) in enumerate(zip(campaign.thermal.models, campaign.thermal.sources, strict=True)):
        slow, fast = model.time_constants(campaign.cold_friction * power[joint]) / 60.0
        rows.append(
            (
                campaign.robot.joint_names[joint],
                campaign.cold_friction * float(power[joint]),
                float(slow),
                float(fast),
                float(campaign.temperatures.T1[:, joint].max()),
                source,
            )
        )
    table = Table(
        headings=(
            "joint",
            "friction power [W]",
            "slow time constant [min]",
            "fast time constant [min]",
            "highest temperature [°C]",
            "parameters",
        ),
        rows=tuple(rows),
        caption="Mean power of the hottest cycle at ambient temperature, and the time constants at that power.",
    )
    ratio = "" if campaign.cold_friction == 1.0 else f", times {campaign.cold_friction:g} for the cold robot"
    text = (
        "Second-order thermal model (thesis eq. 116), starting at ambient temperature. Power: friction of the robot's "
        f"description{ratio}, which falls as the joint warms up."
    )
    return (
        Section(
            title="Expected temperatures",
            paragraphs=(text,),
            pictures=(temperature_picture(campaign),),
            tables=(table,),
        ),
    )
