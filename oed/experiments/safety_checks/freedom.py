"""What is known of a motion's collisions, as plain data and in words: one text for terminal, report and files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from robots.collision import CollisionModel, CollisionReport, Plane
from robots.collision.boxes import FLOOR

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


def _height(obstacle: object) -> float | None:
    upright = isinstance(obstacle, Plane) and abs(obstacle.normal[2]) > 1.0 - 1e-9
    return float(obstacle.offset * obstacle.normal[2]) if upright else None  # type: ignore[attr-defined]


def is_free(freedom: Mapping[str, Any] | None) -> bool:
    """Whether a motion was checked, and is proved free of collisions."""
    return freedom is not None and bool(freedom["certified"])


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
        return "No two bodies of the robot can meet."
    near = f"{freedom['pair']}, {1e3 * freedom['clearance']:.0f} mm at {freedom['time']:.2f} s"
    if freedom["clearance"] < 0.0:
        return f"COLLIDES: {near}."
    proof = "proved at all times" if freedom["certified"] else "NOT proved between the samples"
    shapes = " The shapes of the links are assumed." if freedom.get("assumed") else ""
    return f"No collision with itself{_around(freedom.get('obstacles', {}))}; closest: {near}, {proof}.{shapes}"


def _around(obstacles: Mapping[str, float | None]) -> str:
    names = [name if height is None else f"{name} at z = {height:.3g} m" for name, height in obstacles.items()]
    return "".join(f", {name}" for name in names) + ("" if FLOOR in obstacles else "; there is no floor")
