"""A robot in 3-D with a motion, as data for the page."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from oed.reports.animations.bodies import Body
from robots.common.arrays import Array
from robots.geometry.chain import Chain
from robots.limits import Limits, Margin

NEAR = 0.1
"""Reserve at which a limit lights up: the share that designs keep of torque limits by default."""

QUANTITIES = ("position", "velocity", "acceleration", "torque")


@dataclass(frozen=True, kw_only=True, eq=False)
class Animation:
    """A robot that plays a motion.

    Args:
        robot: its name in reports.
        chain: its joints.
        limits: their limits.
        bodies: what is drawn.
        t: times of the frames [s], (F,).
        q: positions (F, n) [rad or m].
        shares: per quantity of `QUANTITIES` the share of its limit in use (F, n), the largest since the last frame:
            one minus `Margin.slack_fraction`; NaN without a limit, and a quantity without any is left out.
        path: of the flange in the base frame (F, 3) [m].
        approaches: the closest approaches to limits, the closest first.
        marks: what is wrong with a joint, by its number from 1.
        source: what is played, in words.
        meetings: by frame, the links that meet (0 the base, -1 floor or obstacle); without frames in which none do.
    """

    robot: str
    chain: Chain
    limits: Limits
    bodies: tuple[Body, ...]
    t: Array
    q: Array
    shares: Mapping[str, Array]
    path: Array
    approaches: tuple[Margin, ...] = ()
    marks: Mapping[int, str] = field(default_factory=dict)
    source: str = "motion"
    meetings: Mapping[int, tuple[int, ...]] = field(default_factory=dict)

    @property
    def duration(self) -> float:
        """From the first to the last frame [s]."""
        return float(self.t[-1] - self.t[0])

    @property
    def quantities(self) -> tuple[str, ...]:
        """Quantities whose limits are known."""
        return tuple(name for name in QUANTITIES if name in self.shares)

    def summary(self) -> str:
        """Says in words what is drawn."""
        kinds = Counter[str](body.kind for body in self.bodies)
        words = {"mesh": "meshes", "shape": "shapes of the URDF", "capsule": "capsules"}
        parts = [f"{kinds[kind]} {word}" for kind, word in words.items() if kinds[kind]]
        length = float(np.linalg.norm(np.diff(self.path, axis=0), axis=1).sum())
        obstacles = ", ".join(body.name for body in self.bodies if body.kind in ("obstacle", "plane"))
        marked = "".join(f" Joint {joint} is marked: {text}." for joint, text in sorted(self.marks.items()))
        return (
            f"{self.robot}, drawn with {' and '.join(parts) or 'its frames'}, plays the {self.source} of "
            f"{self.duration:.1f} s. The flange's path has {length:.2f} m. Obstacles: {obstacles or 'none'}.{marked}"
            f"{f' Collision: {self.meeting}.' if self.meeting else ''}"
        )

    @property
    def meeting(self) -> str:
        """Says in words which bodies meet first and when; empty if none do."""
        if not self.meetings:
            return ""
        frame = min(self.meetings)
        names = ["the surroundings" if k < 0 else f"link {k}" if k else "the base" for k in self.meetings[frame]]
        return f"{' and '.join(names)} meet at {self.t[frame]:.2f} s"

    def to_json(self) -> str:
        """Writes the data for the page's script: lengths in 0.1 mm, positions in 1e-4, shares in 1e-3."""
        data = {
            "joints": [self._joint(index) for index in range(self.chain.n)],
            "tip": _twelve(self.chain.tip),
            "bodies": [_body(body) for body in self.bodies],
            "t": [round(float(value), 3) for value in self.t - self.t[0]],
            "start": round(float(self.t[0]), 3),
            "q": _whole(1e4 * self.q),
            "shares": {name: _whole(1e3 * self.shares[name]) for name in self.quantities},
            "path": _whole(1e4 * self.path),
            "marks": {str(joint): text for joint, text in self.marks.items()},
            "near": round(1e3 * (1.0 - NEAR)),
            "meetings": {str(frame): list(links) for frame, links in self.meetings.items()},
        }
        # "<" cannot end the script element once it is written as an escape of JSON.
        return json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")

    def _joint(self, index: int) -> dict[str, Any]:
        joint, limits = self.chain.joints[index], self.limits
        return {
            "name": joint.name,
            "prismatic": joint.kind == "prismatic",
            "placement": _twelve(joint.placement),
            "axis": [float(value) for value in joint.axis],
            "unit": limits.unit(index),
            "lower": _known(limits.lower[index]),
            "upper": _known(limits.upper[index]),
        }


def _body(body: Body) -> dict[str, Any]:
    return {
        "link": body.link,
        "kind": body.kind,
        "closed": body.surface.closed,
        "vertices": _whole(1e4 * body.surface.vertices),
        "triangles": body.surface.triangles.ravel().tolist(),
    }


def _twelve(pose: Array) -> list[float]:
    """Rotation row by row, then translation [m]."""
    return [float(f"{value:.9g}") for value in (*pose[:3, :3].ravel(), *pose[:3, 3])]


def _whole(values: Array) -> Sequence[int | None]:
    """Whole numbers in one row; None where there is none."""
    flat = np.round(np.asarray(values, dtype=float)).ravel()
    if np.isfinite(flat).all():
        return flat.astype(int).tolist()
    return [int(value) if np.isfinite(value) else None for value in flat]


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
