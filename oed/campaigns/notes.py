"""Notes on a campaign that a user must know before playing it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from oed.campaigns.planning import VERTICAL_ANGLE, Planner
from oed.campaigns.stages import Stage
from oed.experiments.safety_checks.freedom import collides, freedom_text
from robots.thermal import KnownThermal


def campaign_notes(stages: Sequence[Stage], planner: Planner, known: KnownThermal | None) -> tuple[str, ...]:
    """Lists changes, missing checks, and collisions or small margins of the stages.

    Args:
        stages: the stages, with their margins.
        planner: that planned them.
        known: the thermal models, if there are any.

    Returns:
        Sentences, collisions first.
    """
    collisions = [remark for stage in stages for remark in _collisions(stage)]
    others = [remark for stage in stages for remark in _notes(stage, planner)]
    return (*collisions, *others, *_unknown(planner, known))


def _collisions(stage: Stage) -> Iterator[str]:
    if collides(stage.freedom):
        remedy = "Check it before playing."
        if stage.kind == "excitation":
            remedy = "Design it again with `oed design`, which avoids collisions."
        yield f"COLLISION in the {stage.name} stage: {freedom_text(stage.freedom)} {remedy}"


def _notes(stage: Stage, planner: Planner) -> Iterator[str]:
    torque = planner.torque
    share = stage.details.get("acceleration_share", 1.0)
    if share < 1.0:
        yield f"The {stage.name} stage uses {100 * share:g} % of the acceleration limits, because of the torque limits."
    for margin in stage.margins:
        if margin.quantity == "torque" and margin.slack_fraction < torque.margin - 1e-9:
            yield (
                f"The {stage.name} stage keeps a torque reserve of {100 * margin.slack_fraction:.1f} % on joint "
                f"{margin.joint}; {100 * torque.margin:g} % are required."
            )
    asked = stage.details.get("range", 0.0)
    # A warm-up range counts as narrowed below 99 % of what was asked.
    narrow = [j for j, part in enumerate(stage.details.get("ranges", []), start=1) if part < 0.99 * asked]
    if narrow:
        parts = ", ".join(f"{100 * stage.details['ranges'][j - 1]:.0f} %" for j in narrow)
        yield (
            f"To avoid collisions, the {stage.name} stage moves joint {_listed(narrow)} over {parts} of the range "
            f"instead of {100 * asked:g} %."
        )
    slow = sorted({p["joint"] for p in stage.plateaus if abs(p["speed"]) < abs(p["asked"]) - 1e-9})
    if slow:
        yield (
            f"The range of joint {_listed(slow)} is too short for the highest speeds of the friction stage; they were "
            f"left out."
        )
    angles = stage.details.get("angle_to_no_gravity_deg", [])
    loaded = [joint for joint, angle in enumerate(angles, start=1) if angle > np.rad2deg(VERTICAL_ANGLE)]
    if loaded:
        yield (
            f"The arm has no pose in which joint {_listed(loaded)} is free of gravity torque. Separate gravity from "
            f"friction with a sine and cosine fit (thesis eq. 84)."
        )


def _unknown(planner: Planner, known: KnownThermal | None) -> Iterator[str]:
    robot = planner.robot
    if not planner.torque.known:
        yield "Torque limits were not checked: the robot's description lacks nominal dynamics or torque limits."
    if not np.any(np.asarray(robot.friction)):
        yield "The robot's description states no friction, so the friction heat is unknown."
    if known is None:
        yield "No thermal model of this robot is known, so temperatures are not forecast."
    elif any("assumed" in source for source in known.sources):
        yield (
            "Expected temperatures are a rough forecast. They use the thesis' parameters of joint 4 for all joints, "
            "and friction heat only, without the heat of the motor windings."
        )


def _listed(joints: Sequence[int]) -> str:
    return ", ".join(map(str, joints))
