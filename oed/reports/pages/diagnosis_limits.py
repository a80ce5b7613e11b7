"""What a log or a planned experiment could show: a table of effects by joints, and the page of a plan."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimation.diagnosis.experiment_plans.detection_limits import Limit
from oed.reports.rendering.page import Cell, Fact, Page, Section, Table
from oed.reports.rendering.saving import footer, save_page
from robots.common.files import ResultFolder
from robots.terms.effects import EFFECTS

CLEAR = 0.02
"""Share of the torque below which a limit counts as small: what robot models commonly leave."""
ALL = 1.0
"""Share of the torque from which a size is none."""
MUCH = 2.0
"""Times a limit from which the one of the kind that shows least is told beside it."""


def save_limits_report(limits: Sequence[Limit], robot: str, folder: ResultFolder) -> None:
    """Writes the page of what a planned experiment could show."""
    save_page(limits_page(limits, robot), folder)


def limits_page(limits: Sequence[Limit], robot: str) -> Page:
    """Builds the page of a planned experiment."""
    testable = [limit for limit in limits if np.isfinite(limit.detectable)]
    clear = [limit for limit in testable if limit.attributable <= CLEAR]
    hidden = sorted({EFFECTS[limit.effect].title for limit in limits if not np.isfinite(limit.detectable)})
    return Page(
        title="What this experiment could show",
        subtitle=robot,
        verdict=(
            f"Of {len(limits)} effects and places, {len(clear)} would be seen and named at {100 * CLEAR:g} % of the "
            f"joint's torque, and {len(testable)} at some size."
        ),
        status="good" if len(clear) > len(limits) / 2 else "warning",
        facts=(
            Fact(label="Seen and named at 2 %", value=f"{len(clear)} of {len(limits)}"),
            Fact(label="Hidden in this motion", value=len(limits) - len(testable)),
        ),
        warnings=(f"No size of these shows on some joint: {'; '.join(hidden)}.",) if hidden else (),
        sections=(limits_section(limits),),
        footer=footer(),
    )


def limits_section(limits: Sequence[Limit], *, folded: bool = False) -> Section:
    """Builds the tables of limits: of single joints, and of the whole robot."""
    joints = sorted({limit.joint for limit in limits if limit.joint is not None})
    by_place = {(limit.effect, limit.joint): limit for limit in limits}
    names = list(dict.fromkeys(limit.effect for limit in limits if limit.joint is not None))
    rows: list[tuple[Cell, ...]] = [
        (EFFECTS[name].title, *(_cell(by_place.get((name, joint))) for joint in joints)) for name in names
    ]
    whole = [limit for limit in limits if limit.joint is None]
    tables = [
        Table(
            headings=("effect", *(f"joint {joint}" for joint in joints)),
            rows=tuple(rows),
            caption="Smallest size that would be found with 95 % chance / that would also be told from its rivals, in "
            "per cent of the joint's torque RMS, of an effect of usual shape: half of the speeds, time constants or "
            "travels that are tried show sooner. In brackets, where it is much more: from what size on it would be "
            "found whatever those are. A dash: cannot act there; hidden: no size shows in this motion.",
            align=("left", *("right" for _ in joints)),
        )
    ]
    if whole:
        tables.append(
            Table(
                headings=("effect on the whole robot", "found / named [%]", "toughest rival"),
                rows=tuple(
                    (EFFECTS[w.effect].title, _cell(w), EFFECTS[w.toughest].title if w.toughest else None)
                    for w in whole
                ),
                caption="Sizes on the joint where the effect shows most.",
            )
        )
    text = (
        "What could have been seen, and what not: an effect smaller than this may be there although nothing was found."
    )
    return Section(
        title="Limits",
        paragraphs=(text, *_notes(limits)),
        tables=tuple(tables),
        folded=folded,
    )


def _notes(limits: Sequence[Limit]) -> list[str]:
    """Tells each note once, with the places that it is of."""
    places: dict[str, list[Limit]] = {}
    for limit in limits:
        if limit.note:
            places.setdefault(limit.note, []).append(limit)
    result = []
    for note, those in places.items():
        # Effects of the same joints are told together: a list of effects beside one of joints would be their product.
        joints: dict[str, list[int]] = {}
        for limit in those:
            joints.setdefault(EFFECTS[limit.effect].title, []).extend([limit.joint] if limit.joint else [])
        names: dict[tuple[int, ...], list[str]] = {}
        for title, on in joints.items():
            names.setdefault(tuple(sorted(on)), []).append(title)
        told = [
            "; ".join(titles) + (f" on joint{'s' if len(on) > 1 else ''} {', '.join(map(str, on))}" if on else "")
            for on, titles in names.items()
        ]
        result.append(f"{' / '.join(told)}: {note}.")
    return result


def _cell(limit: Limit | None) -> Cell:
    if limit is None:
        return None
    if not np.isfinite(limit.detectable):
        return "hidden"
    named = f"{100 * limit.attributable:.2g}" if limit.attributable < ALL else "never"
    return f"{100 * limit.detectable:.2g}{_worst(limit)} / {named}"


def _worst(limit: Limit) -> str:
    """Says from what size on the kind of it that shows least would be found, where that is much more."""
    if limit.at_worst <= MUCH * limit.detectable:
        return ""
    return f" ({100 * limit.at_worst:.2g})" if limit.at_worst < ALL else " (never)"
