"""Tests of the search for several effects: it terminates, whatever the refinement changes."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from types import SimpleNamespace

import pytest

from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.searches import selection
from robots.terms.effects import EFFECTS

A, B, C = (Hypothesis(EFFECTS[name], 1) for name in ("stribeck", "spring", "time_delay"))
Members = list[SimpleNamespace]
MOST_SCANS = 40


def _all_but(problem: object, members: Members, i: int) -> tuple[object, ...]:
    return tuple(m.group for k, m in enumerate(members) if k != i)


def _searching(
    monkeypatch: pytest.MonkeyPatch, polished: Callable[[Members], Members], *, showing: Sequence[Hypothesis]
) -> list[set[Hypothesis]]:
    """Replaces all measurements: hypotheses outside the model are significant, the first one most.

    Returns the arguments of each scan. More than `MOST_SCANS` scans count as an endless loop.
    """
    scans: list[set[Hypothesis]] = []

    def scan(problem, entries, accepted):
        scans.append(set(accepted))
        assert len(scans) < MOST_SCANS, "goes round in a circle"
        outcomes = [SimpleNamespace(hypothesis=h, evidence=1.0) for h in showing if h not in accepted]
        return SimpleNamespace(outcomes=outcomes, p_value=lambda outcome: 1e-9)

    def replace(name: str, value: Callable) -> None:
        monkeypatch.setattr(selection, name, value)

    replace("_visible_in_torque", lambda *args: ([], []))
    replace("accept", lambda problem, groups: groups)
    replace("accept_all_but", _all_but)
    replace("scan", scan)
    replace("screen_candidates", lambda problem, result, members: result.outcomes)
    replace(
        "refine_candidates",
        lambda problem, outcomes, accepted, known=None: [
            SimpleNamespace(hypothesis=o.hypothesis, group=o.hypothesis, shape=(), gain=1.0) for o in outcomes
        ],
    )
    for name in ("is_accepted", "is_certain", "exceeds_leakage"):
        replace(name, lambda *args: True)
    replace(
        "refine_with_swaps",
        lambda problem, entries, members, p_values, *rest: (kept := polished(members), p_values[: len(kept)]),
    )
    replace("remeasure", lambda problem, member, beside: member)
    replace("relinearise", lambda problem, members: (problem, list(members)))
    return scans


def _selected() -> set[Hypothesis]:
    _, result = selection.select(None, [], false_alarm=0.01)  # type: ignore[arg-type]
    return {found.effect.hypothesis for found in result.found}


def test_effects_are_added_while_they_show(monkeypatch: pytest.MonkeyPatch) -> None:
    """If the refinement drops nothing, all significant effects are found."""
    _searching(monkeypatch, lambda members: members, showing=(A, B, C))
    assert _selected() == {A, B, C}


def test_what_the_others_make_unnecessary_is_not_tried_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """A dropped effect that becomes significant again is not tried again, and does not prevent another one."""

    def without_b(members: Members) -> Members:
        return [m for m in members if m.hypothesis != B]

    scans = _searching(monkeypatch, without_b, showing=(A, B, C))
    assert _selected() == {A, C}
    assert len(scans) == 4


def test_two_that_drop_each_other_end_the_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """If two effects replace each other, the search ends with one of them."""
    scans = _searching(monkeypatch, lambda members: members[-1:], showing=(A, B))
    assert len(_selected()) == 1
    assert len(scans) <= 4


@pytest.mark.parametrize("shown", [False, True])
def test_what_the_torque_shows_by_itself_has_no_rivals(monkeypatch: pytest.MonkeyPatch, shown: bool) -> None:
    """Clipping shown by flat tops has no rivals."""
    rivals = _rivals(monkeypatch, bic=-7.0, worth=-7.0, seen={A} if shown else set())
    assert [rival.hypothesis for rival, _ in rivals] == ([] if shown else [B])


def test_rivals_of_a_moment_s_cause_are_as_much_worse_as_it_is_worth_more(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rivals of a transient effect are compared by the better of its BIC gain and its local BIC gain."""
    ((rival, worse),) = _rivals(monkeypatch, bic=-33.0, worth=16.0)
    assert rival.hypothesis == B
    assert worse == pytest.approx(16.0 + 7.0)
    ((_, doubted),) = _rivals(monkeypatch, bic=20.0, worth=16.0)
    assert doubted == pytest.approx(20.0 + 7.0)


def _rivals(
    monkeypatch: pytest.MonkeyPatch, *, bic: float, worth: float, seen: Collection[Hypothesis] = ()
) -> tuple[tuple[SimpleNamespace, float], ...]:
    """Computes the rivals of A with given BIC and local BIC gain; B is a candidate with a BIC gain of -7."""

    def member(hypothesis: Hypothesis, bic: float, worth: float) -> SimpleNamespace:
        values = {"group": hypothesis, "shape": (), "gain": 5.0}
        return SimpleNamespace(hypothesis=hypothesis, bic_gain=bic, best_bic_gain=max(bic, worth), **values)

    monkeypatch.setattr(selection, "accept", lambda problem, groups: groups)
    monkeypatch.setattr(selection, "accept_all_but", _all_but)
    monkeypatch.setattr(selection, "scan", lambda *args, **options: SimpleNamespace(outcomes=[]))
    monkeypatch.setattr(selection, "screen_candidates", lambda *args: [SimpleNamespace(hypothesis=B)])
    monkeypatch.setattr(
        selection, "refine_candidates", lambda problem, rest, beside: [member(o.hypothesis, -7.0, -7.0) for o in rest]
    )
    chosen = selection.Selection(
        found=(selection.SelectedEffect(member(A, bic, worth), 1e-30),),  # type: ignore[arg-type]
        visible_in_torque=frozenset(seen),
    )
    reported = selection.with_rivals(SimpleNamespace(rows=1000), [], chosen)  # type: ignore[arg-type]
    return reported.found[0].rivals  # type: ignore[return-value]
