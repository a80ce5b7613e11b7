"""The page of a designed experiment."""

from __future__ import annotations

import numpy as np

from oed.experiments import Design
from oed.experiments.quality import Quality
from oed.experiments.safety_checks.margins import nominal_torque
from oed.reports.animations.building import animate
from oed.reports.pages.motions.motion_report import animation_section, tightest_fact
from oed.reports.pictures.trajectory_pictures import margins_picture, motion_picture, spectrum_picture
from oed.reports.rendering.page import Cell, Fact, Page, Section, Table, page_of
from robots.collision import Surroundings
from robots.common.arrays import Array
from robots.limits import Margin


def design_page(design: Design) -> Page:
    """Builds the page: what the experiment is worth, how it moves, how far it stays from the limits."""
    robot, motion = design.robot, design.motion
    return page_of(
        design,
        title="Excitation experiment",
        robot=robot.title or robot.name,
        facts=_facts(design),
        sections=(
            _home_section(design),
            Section(
                title="Motion",
                paragraphs=(
                    (
                        "Motion of each joint with its limits. The shaded parts are the segments: the optimised "
                        "Fourier series, one velocity stroke per joint in both directions, and jerk-limited moves in "
                        "between."
                    ),
                ),
                pictures=(motion_picture(robot, motion, segments=design.segments),),
                tables=(_segments(design),),
            ),
            _animation(design),
            quality_section(design.qualities),
            margins_section(design.margins, robot.joint_names),
            Section(title="Search", paragraphs=(_search_text(design),), tables=(_islands(design),)),
            parameters_section(design.base.names, design.base.formulas()),
        ),
        seed=design.settings["seed"],
    )


def _home_section(design: Design) -> Section:
    """Where the robot has to stand, and its moves away from there and back: what a person at the robot checks first."""
    first, last = design.segments[0], design.segments[-1]
    begins, returns = first["kind"] == "approach", last["kind"] == "move"
    text = "The robot has to stand in the home pose before the motion starts, and ends there."
    if begins:
        text += f" Its first move, to the start of the excitation, ends at {first['end']:.1f} s."
    if returns:
        text += f" Its last move, back home, begins at {last['start']:.1f} s."
    if design.home_moved:
        text += " The usual home pose does not keep the limits in space, so another one was taken."
    times = [first["end"] if begins else first["start"], last["start"] if returns else last["end"]]
    poses = [design.home, *(design.motion.q[int(np.abs(design.motion.t - time).argmin())] for time in times)]
    scales = [1.0 if kind == "prismatic" else 180.0 / np.pi for kind in design.robot.chain.kinds]
    rows: list[tuple[Cell, ...]] = [
        (name, "m" if scale == 1.0 else "deg", *(float(scale * pose[joint]) for pose in poses))
        for joint, (name, scale) in enumerate(zip(design.robot.joint_names, scales, strict=True))
    ]
    table = Table(headings=("joint", "unit", "home", "after the first move", "before the last"), rows=tuple(rows))
    return Section(title="Start and end", paragraphs=(text,), tables=(table,))


def _animation(design: Design) -> Section:
    """The robot that plays the motion, with the limits as the design checked them."""
    static = [effect for effect in design.effects if effect.static]
    torque = nominal_torque(design.base, design.motion, static)
    around = Surroundings.from_settings(design.settings)
    return animation_section(
        animate(
            design.robot,
            design.motion,
            torque=torque,
            margins=design.margins,
            source="designed motion",
            surroundings=around,
        )
    )


def quality_section(qualities: tuple[Quality, ...]) -> Section:
    """Shows the information of each part on the parameters."""
    rows = []
    for quality in qualities:
        cond = quality.cond
        squared = None if cond is None else cond**2
        rows.append((quality.label, quality.samples, cond, squared, quality.log_det, quality.smallest))
    table = Table(
        headings=("part", "samples", "cond(Y)", "cond(Y'Y)", "log det(Y'Y)", "smallest singular value of Y"),
        rows=tuple(rows),
        caption=(
            "Values of the unscaled regressor Y in SI units. A dash: this part alone does not determine all parameters."
        ),
    )
    return Section(
        title="Information in the data",
        paragraphs=(
            (
                "Condition numbers depend on the units of the columns; do not compare them across robots or models. "
                "The standard error in the worst-determined direction is the torque noise divided by the smallest "
                "singular value."
            ),
        ),
        pictures=(spectrum_picture({quality.label: _shown(quality) for quality in qualities}),),
        tables=(table,),
    )


def _shown(quality: Quality) -> Array:
    """The singular values (m,), those that are zero but for rounding as zero."""
    values = np.array(quality.singular_values)
    return np.where(values > 1e-10 * values.max(), values, 0.0)


def margins_section(margins: tuple[Margin, ...], joint_names: tuple[str, ...]) -> Section:
    """Shows how close the motion comes to each limit."""
    rows = tuple(
        (m.quantity, m.joint, m.value, m.limit, 100 * m.slack_fraction, m.time)
        for m in sorted(margins, key=lambda m: m.slack_fraction)
        if np.isfinite(m.limit)
    )
    table = Table(
        headings=("limit", "joint", "value", "bound", "left [%]", "at [s]"),
        rows=rows[:12],
        caption="The twelve smallest distances at the samples of the file.",
    )
    return Section(title="Limits", pictures=(margins_picture(margins, joint_names=joint_names),), tables=(table,))


def parameters_section(names: tuple[str, ...], formulas: tuple[str, ...]) -> Section:
    """Lists the base parameters and what they stand for."""
    rows: tuple[tuple[Cell, ...], ...] = tuple(zip(names, formulas, strict=True))
    return Section(
        title="Base parameters",
        paragraphs=("The torques depend only on these combinations of link parameters (base parameters).",),
        tables=(Table(headings=("parameter", "stands for"), rows=rows),),
        folded=True,
    )


def _facts(design: Design) -> tuple[Fact, ...]:
    value = design.optimised.value(design.criterion)
    tightest = min((m for m in design.margins if np.isfinite(m.limit)), key=lambda m: m.slack_fraction, default=None)
    facts = [
        Fact(label=f"Criterion {design.criterion.label}", value=value, note="of the optimised motion"),
        Fact(label="cond(Y), optimised motion", value=design.optimised.cond),
        Fact(label="cond(Y), whole experiment", value=design.whole.cond),
        Fact(label="Parameters", value=design.base.size),
        Fact(label="Duration", value=f"{design.motion.duration:.1f} s"),
    ]
    if tightest is not None:
        facts.append(tightest_fact(tightest))
    return tuple(facts)


def _segments(design: Design) -> Table:
    rows = tuple((s["kind"].replace("_", " "), s["joint"], s["start"], s["end"]) for s in design.segments)
    return Table(headings=("segment", "joint", "start [s]", "end [s]"), rows=rows)


def _search_text(design: Design) -> str:
    settings, count = design.settings, len(design.islands)
    searches = "One search" if count == 1 else f"{count} independent searches"
    return (
        f"{searches} from seed {settings['seed']}, {'' if count == 1 else 'each '}with "
        f"{settings['effort']['starts']} screened starts and {settings['effort']['hops']} hops, solved by "
        f"{'IPOPT' if settings['solver']['name'] == 'ipopt' else 'a feasible interior-point method'} with exact "
        "gradients. The limits also hold between the samples."
    )


def _islands(design: Design) -> Table:
    rows = tuple(
        tuple(value for key, value in island.to_dict().items() if key != "starts") for island in design.islands
    )
    name = design.criterion.name
    headings = ("search", f"first {name}", f"final {name}", "iterations", "evaluations", "end")
    return Table(headings=headings, rows=rows, caption="Criterion of one period, at the controller's sample times.")
