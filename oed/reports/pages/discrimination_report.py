"""The report of an experiment that distinguishes two possible causes."""

from __future__ import annotations

from oed.campaigns.discriminations.discrimination import Discrimination
from oed.reports.pages.design_report import margins_section
from oed.reports.pictures.trajectory_pictures import motion_picture
from oed.reports.rendering.page import Fact, Page, Section, Table, page_of
from robots.terms.effects import EFFECTS, EXPERIMENTS


def discrimination_page(result: Discrimination) -> Page:
    """Builds the page: which experiment, how sure, what the others would do, and the motion."""
    robot, run = result.robot, result.runs[0]
    plays = tuple(
        (
            number,
            file,
            run.motion.duration,
            run.payload or None,
            None if run.gravity is None else ", ".join(f"{g:.3f}" for g in run.gravity),
        )
        for number, (file, run) in enumerate(zip(result.files, result.runs, strict=True), start=1)
    )
    kinds = tuple(
        (
            judged.kind.replace("_", " "),
            EXPERIMENTS[judged.kind],
            None if judged.note else 100 * judged.resolves,
            None if judged.note or (least := judged.smallest(result.size)) is None else 100 * least,
            None if judged.note else judged.duration,
            judged.note,
        )
        for judged in result.ranking
    )
    return page_of(
        result,
        title="Experiment to distinguish two causes",
        robot=robot.title or robot.name,
        facts=(
            Fact(label="Probability of the right decision", value=f"{100 * result.resolves:.0f} %"),
            Fact(label="With the reference motion alone", value=f"{100 * result.alone:.0f} %"),
            Fact(label="Kind", value=result.kind.replace("_", " "), note=result.what),
            Fact(label="Duration", value=f"{sum(run.motion.duration for run in result.runs):.0f} s"),
        ),
        sections=(
            Section(
                title="Motions to play",
                paragraphs=tuple(
                    f"{label.capitalize()}: {EFFECTS[name].title}."
                    for label, (name, _) in zip(result.labels, result.rivals, strict=True)
                ),
                tables=(
                    Table(
                        headings=("run", "file", "duration [s]", "payload [kg]", "gravity in the base frame [m/s2]"),
                        rows=plays,
                        caption="Play in this order, with at least one minute between runs. A dash: unchanged.",
                    ),
                ),
            ),
            Section(
                title="All kinds of experiment",
                tables=(
                    Table(
                        headings=(
                            "kind",
                            "what the robot does",
                            "probability [%]",
                            "size for 95 % [%]",
                            "duration [s]",
                            "note",
                        ),
                        rows=kinds,
                        caption=(
                            "Each kind follows the same reference motion. Size for 95 %: smallest effect size, in per "
                            "cent of the torque, with 95 % probability of the right decision. Sorted: sufficient "
                            "without manual change first."
                        ),
                    ),
                ),
            ),
            Section(
                title="Motion",
                pictures=(
                    motion_picture(
                        robot, run.motion, segments=[{**entry, "kind": entry["part"]} for entry in run.table()]
                    ),
                ),
            ),
            margins_section(run.margins, robot.joint_names),
        ),
    )
