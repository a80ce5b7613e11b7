"""How urgent a report is: one function, one table."""

from __future__ import annotations

import pytest

from estimation.diagnosis.results.actions import ACTIONS, sentence_for
from oed.reports import Finding, Page, severity
from robots.common.errors import InputError
from robots.common.records import effect_code
from robots.common.records.findings import FAULTS, LEVELS
from robots.terms.effects import EFFECTS


@pytest.mark.parametrize(
    ("codes", "level"),
    [
        ((), "good"),
        (("done",), "good"),
        (("done", "value.assumed"), "note"),
        (("value.assumed", "limit.exceeded", "done"), "act"),
        (("effect.design",), "note"),
        (("effect.fault",), "act"),
        (("change.act",), "act"),
        (("log.refuse",), "act"),
    ],
)
def test_the_most_urgent_finding_decides(codes: tuple[str, ...], level: str) -> None:
    """A report is as urgent as its most urgent finding, whatever else was found."""
    assert severity(codes) == level
    assert Page(title="t", verdict="v", findings=tuple(Finding(code=code, text="t") for code in codes)).level == level


def test_findings_that_ask_for_action_are_never_green() -> None:
    """Each effect of the catalogue has a level above good; faults ask for action and say which."""
    assert all(LEVELS[effect_code(name)] == ("act" if name in FAULTS else "note") for name in EFFECTS)
    assert set(ACTIONS) == set(FAULTS) <= set(EFFECTS)


def test_unknown_codes_are_refused() -> None:
    """A misspelt code is an error, not a green report."""
    with pytest.raises(InputError, match=r"limit\.exeeded"):
        severity(["limit.exeeded"])


def test_equal_actions_name_their_joints_together() -> None:
    """One sentence per action, with all its joints; model effects add nothing where a fault asks for more."""
    found = sentence_for([("friction_step", 5), ("friction_step", 4), ("stribeck", 1), ("backlash", 2)])
    assert (
        found == "Inspect the drive of joints 4 and 5 (gear, lubricant, brake). Inspect the gear of joint 2 for play."
    )
    assert sentence_for([("stribeck", 1)]).startswith("Use the extended model")
