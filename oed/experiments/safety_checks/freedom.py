"""What is known of a motion's collisions, as plain data and in words: one text for terminal, report and files."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from os import PathLike
from typing import Any

from oed.exports.trajectory_checks import FREE
from robots.collision import CollisionModel, CollisionReport, Plane, check_motion
from robots.collision.boxes import FLOOR
from robots.common.errors import AssumedValueWarning, InfeasibleError
from robots.common.records import Finding, findings_of
from robots.signals import Motion

UNCHECKED = "NOT CHECKED for collisions"
"""How every text about a motion that was not checked begins."""


def collision_data(model: CollisionModel, report: CollisionReport) -> dict[str, Any] | None:
    """Writes what was checked against what, and what comes closest when, as plain data.

    Args:
        model: the bodies and obstacles.
        report: of a motion.

    Returns:
        ``clearance`` [m], ``pair`` and ``time`` [s] of the closest pair, or None without any pair; ``certified``:
        whether freedom is proved for all times; ``obstacles`` by name and, of a floor, its height [m]; ``assumed``:
        bodies without a source; ``by_shape``: pairs judged by drawn shapes at the samples; ``meetings`` of these. None
        where the links have no shape at all, so that nothing was checked.
    """
    if not model.capsules:
        return None
    worst = report.worst
    return {
        "clearance": float(report.clearance[worst]) if worst is not None else None,
        "pair": report.names[worst] if worst is not None else None,
        "time": float(report.time[worst]) if worst is not None else None,
        "certified": report.certified,
        "obstacles": {item.name: _height(item) for item in model.obstacles},
        "assumed": list(model.assumed),
        "by_shape": list(report.by_shape),
        "meetings": [list(meeting) for meeting in report.meetings],
    }


def freedom_of(model: CollisionModel, motion: Motion) -> dict[str, Any] | None:
    """Checks a motion for collisions at all times, as `collision_data` writes it.

    Args:
        model: the bodies and obstacles.
        motion: of the same robot.

    Raises:
        InputError: a motion of another number of joints.
    """
    return collision_data(model, check_motion(model, motion, confirm=False))


def _height(obstacle: object) -> float | None:
    upright = isinstance(obstacle, Plane) and abs(obstacle.normal[2]) > 1.0 - 1e-9
    return float(obstacle.offset * obstacle.normal[2]) if upright else None  # type: ignore[attr-defined]


def is_free(freedom: Mapping[str, Any] | None) -> bool:
    """Whether a motion was checked, and is proved free of collisions."""
    return freedom is not None and bool(freedom["certified"])


def require_free(model: CollisionModel, motion: Motion, file: str | PathLike[str] | None = None) -> None:
    """Refuses a motion that collides, before it is played.

    Args:
        model: the bodies and obstacles.
        motion: what is to be played.
        file: that it is in, for the message.

    Raises:
        InfeasibleError: naming the bodies and the time.

    Warns:
        AssumedValueWarning: a motion that could not be proved free.
    """
    freedom = freedom_of(model, motion)
    if collides(freedom):
        raise InfeasibleError(
            freedom_text(freedom).removesuffix("."),
            file=file,
            remedy=(
                "design it anew; state other surroundings (--floor, --no-floor), or play it without this check "
                "(--no-collision)"
            ),
        )
    if not is_free(freedom):
        warnings.warn(freedom_text(freedom), AssumedValueWarning, stacklevel=2)


def collides(freedom: Mapping[str, Any] | None) -> bool:
    """Whether a motion was found to collide."""
    return freedom is not None and bool(freedom.get("meetings") or (freedom["clearance"] or 0.0) < 0.0)


def freedom_text(freedom: Mapping[str, Any] | None) -> str:
    """Says whether a motion collides, what it was checked against, and how near it comes.

    Args:
        freedom: as `collision_data` writes it; None for a motion that was not checked.
    """
    if freedom is None:
        return f"{UNCHECKED}: neither with the robot itself nor with the floor."
    if freedom.get("meetings"):
        pair, time = freedom["meetings"][0]
        return f"COLLIDES: {pair} at {time:.2f} s, by the shapes of the robot's file."
    if freedom["pair"] is None:
        return f"{FREE}: no two bodies of the robot can meet."
    near = f"{freedom['pair']}, {1e3 * freedom['clearance']:.0f} mm at {freedom['time']:.2f} s"
    if freedom["clearance"] < 0.0:
        return f"COLLIDES: {near}."
    free, proof = (FREE, "proved at all times")
    if not freedom["certified"]:
        free, proof = ("NOT PROVED free of collisions", "at the samples")
    shapes = " The shapes of the links are assumed." if freedom.get("assumed") else ""
    return f"{free} with itself{_around(freedom.get('obstacles', {}))}; closest: {near}, {proof}.{shapes}"


def _around(obstacles: Mapping[str, float | None]) -> str:
    names = [name if height is None else f"{name} at z = {height:.3g} m" for name, height in obstacles.items()]
    return "".join(f", {name}" for name in names) + ("" if FLOOR in obstacles else "; there is no floor")


def freedom_findings(freedom: Mapping[str, Any] | None) -> tuple[Finding, ...]:
    """Says what is not known of a motion's collisions, or what it collides with.

    Args:
        freedom: as `collision_data` writes it; None for a motion that was not checked.
    """
    text = freedom_text(freedom)
    if freedom is None:
        return (Finding(code="collision.unchecked", text=text, action="Leave out --no-collision."),)
    if collides(freedom):
        return (Finding(code="collision.found", text=text, action="Do not play it."),)
    return () if is_free(freedom) else findings_of("collision.sampled", [text])
