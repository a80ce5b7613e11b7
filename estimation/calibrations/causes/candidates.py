"""Causes that may explain errors: columns that each would add to the measured numbers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robots.common.arrays import Array
from robots.geometry_errors.measurements import Markers
from robots.geometry_errors.model import GeometryModel, Prediction

CAUSES = {
    "joint_zero": "zero",
    "link_placement": "link",
    "gear_ratio": "gear_ratio",
    "eccentricity": "eccentricity",
    "joint_compliance": "compliance",
    "link_compliance": "compliance",
    "thermal_growth": "thermal_growth",
    "backlash": "backlash",
    "load_backlash": "load_backlash",
    "time_offset": "time_offset",
}
"""Cause by kind of geometric errors."""

LEAST = 5  # poses on either side of a sudden change
SPLITS = 60  # moments of a sudden change that are tried


@dataclass(frozen=True, kw_only=True, eq=False)
class Candidate:
    """A cause and where it is.

    Attributes:
        cause: "zero", "link", "eccentricity", "compliance", "backlash", "loose_marker", "moved_base", and others.
        joint: from 1; None for none.
        marker: from 1; None for none.
        since: pose, from 1, from which on a sudden change counts; None for none.
        parameters: names of the columns.
        units: of each.
        scale: usual size of each.
        columns: derivative of the prediction (N, r, K).
        tries: number of places of which this is one; the evidence is lowered by that many.
    """

    cause: str
    joint: int | None
    marker: int | None = None
    since: int | None = None
    parameters: tuple[str, ...]
    units: tuple[str, ...]
    scale: Array
    columns: Array
    tries: int = 1

    @property
    def key(self) -> tuple[str, int | None, int | None]:
        """Names the cause without its moment."""
        return self.cause, self.joint, self.marker


def candidates(model: GeometryModel, found: Prediction) -> Iterator[Candidate]:
    """Gives all causes that some poses may show.

    Args:
        model: with all kinds of errors.
        found: residuals and derivatives at the point about which the model is linear.
    """
    errors = model.errors
    groups: dict[tuple[str, int | None], list[int]] = {}
    for k, item in enumerate(errors):
        if item.kind in CAUSES:
            groups.setdefault((item.kind, item.joint), []).append(k)
    for (kind, joint), numbers in groups.items():
        yield Candidate(
            cause=CAUSES[kind],
            joint=joint,
            parameters=tuple(errors[k].name for k in numbers),
            units=tuple(errors[k].unit for k in numbers),
            scale=np.array([errors[k].scale for k in numbers]),
            columns=found.jacobian[:, :, numbers],
        )
    yield from _moved_base(model, found)
    yield from _loose_markers(model, found)


def _splits(rows: int) -> NDArray[np.int64]:
    """Poses from which on something may have changed (from 0)."""
    first, last = LEAST, rows - LEAST
    count = min(SPLITS, max(last - first + 1, 0))
    return np.unique(np.linspace(first, last, count).astype(np.int64))


def _moved_base(model: GeometryModel, found: Prediction) -> Iterator[Candidate]:
    """The base moved between sessions, or at some moment: six columns, those of the base's placement from then on."""
    names = [item.name for item in model.errors]
    axes = ("x", "y", "z", "rx", "ry", "rz")
    # A motion of the base is one of the first joint's frame on it.
    numbers = [names.index(f"link_1_{axis}") for axis in axes]
    base = found.jacobian[:, :, numbers]
    session = model.states[0].session
    starts = _splits(len(base))
    if session is not None and len(np.unique(session)) > 1:
        starts = np.flatnonzero(np.diff(session) != 0) + 1
    for start in starts:
        later = (np.arange(len(base)) >= start)[:, None, None]
        yield Candidate(
            cause="moved_base",
            joint=None,
            since=int(start) + 1,
            parameters=tuple(f"base_{axis}" for axis in axes),
            units=("m",) * 3 + ("rad",) * 3,
            scale=np.full(6, 1e-3),
            columns=base * later,
            tries=len(starts),
        )


def _loose_markers(model: GeometryModel, found: Prediction) -> Iterator[Candidate]:
    """A marker that moved at some moment: three columns, those of its place from then on."""
    measurement = model.poses.measurement
    if not isinstance(measurement, Markers):
        return
    # Columns of the markers are the last of the setup, three each.
    known = {name for name in model.poses.known if name.startswith("marker_")}
    free = [k for k in range(measurement.count) if f"marker_{k + 1}" not in known]
    starts = _splits(len(found.residual))
    for place, k in enumerate(free):
        first = found.jacobian.shape[2] - 3 * (len(free) - place)
        own = found.jacobian[:, :, first : first + 3]
        for start in starts:
            later = (np.arange(len(own)) >= start)[:, None, None]
            yield Candidate(
                cause="loose_marker",
                joint=None,
                marker=k + 1,
                since=int(start) + 1,
                parameters=tuple(f"marker_{k + 1}_{axis}" for axis in "xyz"),
                units=("m",) * 3,
                scale=np.full(3, 1e-3),
                columns=own * later,
                tries=len(starts),
            )
