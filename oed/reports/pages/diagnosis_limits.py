"""Detection limits of a log or a planned experiment: a table of effects by joints, and the page of a plan."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimation.diagnosis.experiment_plans.detection_limits import Limit
from oed.campaigns.discriminations.detection_limits import DetectionLimits
from oed.experiments.quality import ASSUMED_NOISE
from oed.reports.rendering.page import Cell, Fact, Page, Section, Table
from oed.reports.rendering.provenance import footer
from robots.common.records import findings_of
from robots.terms.effects import EFFECTS

CLEAR = ASSUMED_NOISE
"""Share of the torque below which a limit counts as small."""
ALL = 1.0
"""Fraction of the torque from which an effect size counts as impossible."""
MUCH = 2.0
"""If the worst-case limit exceeds the usual one by this factor, it is shown as well."""


def plan_page(result: DetectionLimits, *, robot: str = "") -> Page:
    """Builds the page of a planned experiment.

    Args:
        result: the limits.
        robot: its title; the name by default.
    """
    return limits_page(result.limits, robot or result.robot)


def limits_page(limits: Sequence[Limit], robot: str) -> Page:
    """Builds the page of a planned experiment."""
    testable = [limit for limit in limits if np.isfinite(limit.detectable)]
    clear = [limit for limit in testable if limit.attributable <= CLEAR]
    hidden = sorted({EFFECTS[limit.effect].title for limit in limits if not np.isfinite(limit.detectable)})
    return Page(
        title="Detectable effects of this experiment",
        robot=robot,
        verdict=(
            f"This experiment finds and names {len(clear)} of {len(limits)} pairs of effect and joint at "
            f"{100 * CLEAR:g} % of the joint's torque RMS, and finds {len(testable)} at some size."
        ),
        findings=findings_of(
            "detection.limited",
            (f"Not detectable on at least one joint, at any size: {'; '.join(hidden)}.",) if hidden else (),
        ),
        facts=(
            Fact(label="Found and named at 2 % of torque RMS", value=f"{len(clear)} of {len(limits)}"),
            Fact(label="Not detectable with this motion", value=len(limits) - len(testable)),
        ),
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
            caption=(
                "Found / named: smallest effect size, in per cent of the joint's torque RMS, that is found with 95 % "
                "probability / also distinguished from other effects. Values hold for the median over the shape "
                "parameters (speeds, time constants, travels). In brackets: the worst case, where it is much larger. "
                "A dash: cannot act on this joint. Hidden: not detectable with this motion."
            ),
            align=("left", *("right" for _ in joints)),
        )
    ]
    if whole:
        tables.append(
            Table(
                headings=("effect on the whole robot", "found / named [%]", "closest rival"),
                rows=tuple(
                    (EFFECTS[w.effect].title, _cell(w), EFFECTS[w.toughest].title if w.toughest else None)
                    for w in whole
                ),
                caption="Sizes refer to the joint with the clearest signal.",
            )
        )
    text = "Detection limits of these data: smaller effects may exist and stay undetected."
    return Section(
        title="Limits",
        paragraphs=(text, *_notes(limits)),
        tables=tuple(tables),
        folded=folded,
    )


def _notes(limits: Sequence[Limit]) -> list[str]:
    """Writes each note once, with the joints it applies to."""
    places: dict[str, list[Limit]] = {}
    for limit in limits:
        if limit.note:
            places.setdefault(limit.note, []).append(limit)
    result = []
    for note, those in places.items():
        # Effects on the same joints share one entry; a list of effects with a list of joints would mean their product.
        joints: dict[str, list[int]] = {}
        for limit in those:
            joints.setdefault(EFFECTS[limit.effect].title, []).extend([limit.joint] if limit.joint else [])
        names: dict[tuple[int, ...], list[str]] = {}
        for title, on in joints.items():
            names.setdefault(tuple(sorted(on)), []).append(title)
        parts = [
            "; ".join(titles) + (f" on joint{'s' if len(on) > 1 else ''} {', '.join(map(str, on))}" if on else "")
            for on, titles in names.items()
        ]
        result.append(f"{' / '.join(parts)}: {note}.")
    return result


def _cell(limit: Limit | None) -> Cell:
    if limit is None:
        return None
    if not np.isfinite(limit.detectable):
        return "hidden"
    named = f"{100 * limit.attributable:.2g}" if limit.attributable < ALL else "never"
    return f"{100 * limit.detectable:.2g}{_worst(limit)} / {named}"


def _worst(limit: Limit) -> str:
    """Writes the worst-case limit where it is much larger."""
    if limit.at_worst <= MUCH * limit.detectable:
        return ""
    return f" ({100 * limit.at_worst:.2g})" if limit.at_worst < ALL else " (never)"
