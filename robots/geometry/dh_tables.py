"""Denavit-Hartenberg tables of a robot's file: their units and convention, as stated and as likely meant."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robots.common.errors import InputError
from robots.description import Geometry
from robots.geometry.dh import DhRow

# Sums of all lengths [m]: arms have 0.01 to 10 m, large cranes up to 50 m.
SHORTEST_ARM, LONGEST_CRANE = 0.01, 50.0


def table_rows(geometry: Geometry, file: str) -> list[DhRow]:
    """Gives the rows of a table in rad and m.

    Args:
        geometry: as the file states it.
        file: for messages.

    Raises:
        InputError: angles or lengths that are only possible in another unit, naming joint and key.
    """
    _check_angles(geometry, file)
    turn = np.pi / 180.0 if geometry.angles == "deg" else 1.0
    scale = 1e-3 if geometry.lengths == "mm" else 1.0
    rows = [
        DhRow(
            kind=row.kind,
            alpha=turn * row.alpha,
            a=scale * row.a,
            d=scale * row.d,
            offset=turn * row.offset,
            name=row.name,
        )
        for row in geometry.joints
    ]
    total = _total(rows)
    other = "mm" if total > LONGEST_CRANE else "m" if geometry.lengths == "mm" and 0.0 < total < SHORTEST_ARM else None
    if other is not None:
        number, key = _longest(rows)
        raise InputError(
            f"{getattr(geometry.joints[number], key):g} {geometry.lengths}; all a and d add up to {total:.3g} m",
            file=file,
            column=f"geometry.joints[{number + 1}].{key}",
            joint=number + 1,
            allowed=f"{SHORTEST_ARM:g} to {LONGEST_CRANE:g} m in all",
            remedy=f"if the table is in {'millimetres' if other == 'mm' else 'metres'}, state lengths: {other}",
        )
    return rows


def _check_angles(geometry: Geometry, file: str) -> None:
    if geometry.angles == "rad":
        for number, row in enumerate(geometry.joints, start=1):
            for key in ("alpha", "offset"):
                # No table needs a constant angle of more than a turn [rad].
                if abs(getattr(row, key)) > 2.0 * np.pi + 1e-6:
                    raise InputError(
                        f"{getattr(row, key):g} rad",
                        file=file,
                        column=f"geometry.joints[{number}].{key}",
                        joint=number,
                        allowed="one turn at most, -6.28 to 6.28 rad",
                        remedy="if the table is in degrees, state angles: deg",
                    )
        return
    twists = np.array([row.alpha for row in geometry.joints])
    turned = np.flatnonzero(twists)
    quarters = twists[turned] / (np.pi / 2)
    # People write right angles as 1.57 rad.
    if turned.size and (np.abs(quarters - np.round(quarters)) < 0.01).all() and (np.abs(quarters) < 4.5).all():
        number = int(turned[0]) + 1
        raise InputError(
            f"{twists[turned[0]]:g} deg, and every other twist, is a right angle in rad",
            file=file,
            column=f"geometry.joints[{number}].alpha",
            joint=number,
            remedy="if the table is in radians, state angles: rad",
        )


def table_notes(rows: Sequence[DhRow], convention: str) -> tuple[str, ...]:
    """Lists what a reader of the table may not expect.

    Args:
        rows: in rad and m.
        convention: "modified" or "standard".

    Returns:
        One sentence each: lengths that may be in millimetres, and a table that looks like one of the other convention.
        There the first axis of an arm on the floor is upright, and the last two axes are not parallel.
    """
    notes = []
    total = _total(rows)
    # Arms are 0.01 to 10 m long in all, large cranes up to 50 m.
    if total > 10.0:
        number, key = _longest(rows)
        notes.append(
            f"a and d of the table add up to {total:.3g} m, most of it {key} of joint {number + 1}: they may be in mm "
            "(lengths: mm)"
        )
    twisted = [abs(np.sin(row.alpha)) > 0.5 for row in rows]
    if len(rows) < 4 or any(row.kind == "prismatic" for row in (rows[0], *rows[-2:])):
        return tuple(notes)
    if convention == "modified" and twisted[0] and not twisted[-1] and rows[-1].a == 0.0:
        what = "the first axis lies and the last two axes are parallel"
        notes.append(f"the table looks like one of the standard convention: as a modified one, {what}")
    if convention == "standard" and not twisted[0] and rows[0].a == 0.0 and twisted[-1]:
        what = "the first two axes coincide"
        notes.append(f"the table looks like one of the modified convention: as a standard one, {what}")
    return tuple(notes)


def _total(rows: Sequence[DhRow]) -> float:
    return sum(abs(row.a) + abs(row.d) for row in rows)


def _longest(rows: Sequence[DhRow]) -> tuple[int, str]:
    """The joint, from 0, and the key of the largest length."""
    keys = [(i, key) for i in range(len(rows)) for key in ("a", "d")]
    return max(keys, key=lambda place: abs(getattr(rows[place[0]], place[1])))
