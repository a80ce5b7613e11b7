"""The page of a motion: the robot in 3-D."""

from __future__ import annotations

from collections.abc import Sequence

from oed.reports.animations.animation import NEAR, Animation
from oed.reports.rendering.page import Fact, Page, Section, Status
from oed.reports.rendering.provenance import Recording, footer
from robots.common.records import Finding
from robots.limits import Margin

TITLE = "Robot in 3-D"


def motion_page(animation: Animation, *, logs: Sequence[Recording] = (), findings: Sequence[Finding] = ()) -> Page:
    """Builds the page: whether the motion keeps the limits, and the robot that plays it.

    Args:
        animation: the robot with the motion.
        logs: recordings that are played.
        findings: of a diagnosis of the robot.
    """
    beyond = [margin for margin in animation.approaches if margin.violated]
    # A recorded motion has been played: a limit that it exceeds is not the robot's, or a derivative is noisy.
    recorded = animation.source.startswith("log")
    tightest = min(animation.approaches, key=lambda margin: margin.slack_fraction, default=None)
    found = [
        Finding(
            code="limit.exceeded_in_log" if recorded else "limit.exceeded",
            subject=f"Joint {margin.joint}:",
            text=f"the {animation.source} exceeds the limit of {margin.text}.",
            action="Check the limits in the robot's description." if recorded else "Do not play it.",
        )
        for margin in beyond
    ]
    # The capsules of a description are larger than its bodies: what was recorded did not collide.
    meet = "" if recorded else animation.meeting
    if meet:
        found.insert(
            0, Finding(code="collision.found", text=f"in the {animation.source}, {meet}.", action="Do not play it.")
        )
    facts = [
        Fact(label="Duration", value=f"{animation.duration:.1f} s"),
        Fact(label="Joints", value=animation.chain.n),
    ]
    if tightest is not None:
        facts.append(tightest_fact(tightest, exceeded="note" if recorded else "act"))
    return Page(
        title=TITLE,
        robot=animation.robot,
        verdict=_verdict(animation, meet, beyond, tightest, len(findings)),
        logs=tuple(logs),
        findings=(*found, *findings),
        facts=tuple(facts),
        sections=(animation_section(animation),),
        footer=footer(),
    )


def animation_section(animation: Animation) -> Section:
    """Shows the robot in 3-D.

    Args:
        animation: the robot with its motion.
    """
    text = (
        f"The robot plays the {animation.source}. A link takes the colour of its joint's limit as soon as less than "
        f"{100 * NEAR:.0f} % of that limit is left."
    )
    if animation.marks:
        text += " Circles mark joints with a finding."
    return Section(title=TITLE, paragraphs=(text,), animation=animation)


def tightest_fact(margin: Margin, *, exceeded: Status = "act") -> Fact:
    """States the tightest limit among the key figures.

    Args:
        margin: of that limit.
        exceeded: how urgent it is if the limit is exceeded.
    """
    return Fact(
        label="Tightest limit",
        value=f"{100 * margin.slack_fraction:.2f} % left",
        note=margin.text,
        status=exceeded if margin.violated else "good",
    )


def _verdict(animation: Animation, meet: str, beyond: Sequence[Margin], tightest: Margin | None, effects: int) -> str:
    if meet:
        return f"Do not play the {animation.source}: {meet}."
    if beyond:
        return f"The {animation.source} exceeds {len(beyond)} of the robot's limits, first {beyond[0].text}."
    if tightest is None:
        return f"The robot's description states no limits; the {animation.source} was not checked."
    kept = f"The {animation.source} of {animation.duration:.1f} s keeps the robot's limits"
    return (
        f"{kept}; the diagnosis has {effects} {'finding' if effects == 1 else 'findings'}." if effects else f"{kept}."
    )
