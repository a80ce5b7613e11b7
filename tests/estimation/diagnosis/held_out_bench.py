"""Replacement for held-out measurements in tests: effects, and the result that is measured for each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np

from estimation.diagnosis.findings import Gain
from estimation.diagnosis.hypothesis_tests.fitted_effects import Evidence, FittedEffect
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.searches.selection import SelectedEffect
from estimation.diagnosis.validations.name_comparison import ComparedNames
from estimation.diagnosis.validations.validated_findings import ValidatedFindings
from estimation.diagnosis.validations.validation import validate_on_held_out
from robots.terms.discrepancies.patterns import build_pattern
from robots.terms.effect_bases.capabilities import Persistence
from robots.terms.effects import EFFECTS


@dataclass(frozen=True)
class Shown:
    """Held-out result of an effect: its gain's interval, RMSE ratio, retained gain, support, unreliable joint."""

    low: float = 0.001
    high: float = 0.003
    rise: float = 0.95
    kept: float = 1.0
    speaks: float = 0.0
    astray: bool = False


HELPS, IDLE, HARMS = Shown(), Shown(-0.001, 0.002, 1.0), Shown(-0.004, -0.001, 1.02, speaks=-0.5)


@dataclass
class Bench:
    """Replacement for the measurement: the result of each label, and a record of the calls.

    The result may differ beside certain other effects, or after removal.
    """

    shows: dict[str, Shown]
    beside: dict[tuple[str, str], Shown] = field(default_factory=dict)
    asked: list[tuple[str, ...]] = field(default_factory=list)
    without: dict[str, Shown] = field(default_factory=dict)

    def __call__(self, members: Sequence[FittedEffect], gone: frozenset[int] = frozenset()) -> SimpleNamespace:
        labels = tuple(label_of(member) for member in members)
        self.asked.append(labels)
        shown = [
            self.without.get(label, self.shows[label])
            if k in gone
            else next(
                (self.beside[label, other] for other in labels if (label, other) in self.beside), self.shows[label]
            )
            for k, label in enumerate(labels)
        ]
        lost = {m.hypothesis.joint - 1 for m, s in zip(members, shown, strict=True) if m.hypothesis.joint and s.astray}
        return SimpleNamespace(
            errors=SimpleNamespace(is_unreliable=lost.__contains__),
            gains=tuple(
                Gain(nrmse_before=0.03, nrmse_after=0.03 - (s.low + s.high) / 2, ci95=(s.low, s.high)) for s in shown
            ),
            rmse_ratio=tuple(s.rise for s in shown),
            contradicts=tuple(s.high < 0 for s in shown),
            cv_retained_gain=tuple(s.kept for s in shown),
            support=tuple(s.speaks for s in shown),
        )


def label_of(member: FittedEffect) -> str:
    """Returns the label by which a bench identifies an effect: its hypothesis, and its shape if it has one."""
    return member.hypothesis.label + (f" {member.shape}" if member.shape else "")


def member_of(name: str, joint: int | None) -> FittedEffect:
    """Builds an unfitted effect by the name of a catalogue effect or pattern."""
    effect = EFFECTS.get(name) or build_pattern(name)
    assert effect is not None
    return FittedEffect(Hypothesis(effect, joint), (), None, 100.0, np.zeros(1), 1, 1.0)  # type: ignore[arg-type]


SPRING, STRIBECK = member_of("spring", 2), member_of("stribeck", 2)
PRESLIDING, TILT, PUSH = (
    member_of("presliding_hysteresis", 2),
    member_of("base_tilt", None),
    member_of("external_contact", None),
)
FREE, SWING = member_of("pattern:load:0:even", 3), member_of("pattern:swinging:0:even", None)
LABELS = {m.hypothesis.name: m.hypothesis.label for m in (SPRING, STRIBECK, PRESLIDING, TILT, PUSH, FREE, SWING)}


def bench_with(**shows: Shown) -> Bench:
    """Builds a bench with results by the effects' names; all others help."""
    return Bench(
        {label: shows.get(name.split(":")[1] if ":" in name else name, HELPS) for name, label in LABELS.items()}
    )


def validated(
    bench: Bench,
    *founds: SelectedEffect,
    free: Sequence[FittedEffect] = (),
    p_values: Sequence[float] = (),
    held_out: bool = True,
    forms: Sequence[FittedEffect] = (),
    unnamed: tuple[FittedEffect, float] | None = None,
    alone: Mapping[FittedEffect, float] | None = None,
) -> ValidatedFindings:
    """Validates named effects and free functions on the held-out results of a bench.

    `alone`: BIC gains of effects after an effect of the same joint was rejected.
    """
    compared = ComparedNames(founds, tuple(free), tuple(p_values), 1.0)
    for found in founds:
        for member in (found.effect, *(rival for rival, _ in found.rivals)):
            # Nothing was fitted, so the cached evidence is set directly.
            vars(member)["local_evidence"] = Evidence(100.0, 0, 1.0)

    def again(members: Sequence[FittedEffect], i: int) -> FittedEffect:
        if members[i] not in (alone or {}):
            return members[i]
        refined = replace(members[i])
        vars(refined)["local_evidence"] = Evidence((alone or {})[members[i]], 0, 1.0)
        return refined

    def beyond(member: FittedEffect) -> bool:
        return held_out and member.hypothesis.effect.persistence is Persistence.TRANSIENT

    return validate_on_held_out(
        compared,
        bench,  # type: ignore[arg-type]
        beyond,
        lambda members, i: forms if members[i] is SPRING else (),
        again,
        lambda member, beside: None if member in beside else unnamed,
    )
