"""Specification of the family of checks: their order, their stages, and own checks of users."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

from estimation.gate import CHECKS, Check, Context, Finding, Stage, check_log
from estimation.gate.checks import checks_in_order
from robots.common.errors import InputError
from robots.signals import Log
from tests.estimation.gate.findings_of import found

ORDER = {
    Stage.RECORDED: [
        "too_few_rows",
        "static_poses",
        "sampling",
        "late_rows",
        "repeated_rows",
        "held_torques",
        "stuck_columns",
        "resolution",
        "wrapped_angles",
        "spikes",
        "reader_notes",
        "clipping",
        "constant_torques",
        "same_columns",
        "travel",
        "jumps",
    ],
    Stage.CLEANED: ["position_units", "impossible_values"],
    Stage.SMOOTHED: ["speeds", "velocity_columns", "too_few_smoothed_rows"],
    Stage.FITTED: [
        "little_motion",
        "few_rows_per_parameter",
        "meanings",
        "unloaded_rest",
        "excitation",
        "undetermined",
        "delays",
    ],
}


def test_findings_of_equal_severity_have_a_fixed_order():
    """Checks run by stage and order, and no two of a stage have the same order."""
    checks = checks_in_order()
    assert [check.name for check in checks] == [name for stage in Stage for name in ORDER[stage]]
    assert len({(check.stage, check.order) for check in checks}) == len(checks)


def test_the_page_on_refused_logs_explains_each_finding():
    """Each name of a finding of checks and readers is in the tables of the documentation."""
    root = Path(__file__).parents[3]
    named = re.compile(r'[ (](?:name=|"name": )"([a-z_]+)"(?: if .+ else "([a-z_]+)")?,')
    sources = [
        path.read_text(encoding="utf-8")
        for pattern in ("gate/checks/*.py", "gate/meanings/*.py", "gate/log_sets.py", "logs/*.py")
        for path in (root / "estimation").glob(pattern)
    ]
    names = {name for source in sources for pair in named.findall(source) for name in pair if name}
    page = (root / "docs/refused.md").read_text(encoding="utf-8")
    assert len(names) > 45
    assert {name for name in names if f"`{name}`" not in page} == set()


@pytest.mark.parametrize("kind", checks_in_order(), ids=lambda kind: kind.name)
def test_a_good_log_passes_each_check_alone(er3a, good, kind):
    """No check needs another to have run before it."""
    context = Context(er3a, good())
    assert context.reaches(kind.stage)
    assert list(kind().run(context)) == []


@pytest.mark.parametrize(
    ("fields", "stage"),
    [
        ({}, Stage.FITTED),
        ({"tau": None}, Stage.SMOOTHED),
        ({"tau": np.full((5000, 6), 1e300)}, Stage.CLEANED),
    ],
    ids=["good", "without torque", "impossible torque"],
)
def test_a_log_reaches_the_stages_that_its_values_allow(er3a, good, fields, stage):
    """Without torque nothing is fitted; impossible values are not even smoothed."""
    context = Context(er3a, replace(good(), **fields))
    with np.errstate(over="ignore"):  # as in check_log: the square of 1e300
        context.reaches(Stage.SMOOTHED)
    assert [context.reaches(each) for each in Stage] == [each <= stage for each in Stage]
    if stage < Stage.FITTED:
        with pytest.raises(RuntimeError, match="does not reach the stage FITTED"):
            _ = context.fitted


def test_a_short_log_is_not_smoothed(er3a, good):
    """Nineteen rows give no derivatives."""
    assert not Context(er3a, good().rows(slice(0, 19))).reaches(Stage.SMOOTHED)


class Coverage(Check):
    """Warns of joints that use less than half of their range."""

    name: ClassVar[str] = "coverage"
    stage: ClassVar[Stage] = Stage.CLEANED

    def run(self, context: Context) -> list[Finding]:
        """Compares the travel of each joint with its range."""
        limits = context.robot.limits
        share = context.cleaned.columns.travel / (limits.upper - limits.lower)
        return [
            Finding(name="coverage", severity="warning", text="", action="", value=float(share[j]), joint=int(j) + 1)
            for j in np.flatnonzero(share < 0.5)
        ]


@pytest.fixture
def coverage():
    """An own check, registered for one test."""
    yield CHECKS.register(Coverage)
    CHECKS.unregister(Coverage.name)


@pytest.mark.slow
def test_an_own_check_takes_part(er3a, good, coverage):
    """A registered check finds its faults beside the built-in ones, with their severities sorted together."""
    log = good()
    report = check_log(er3a, Log(log.t, log.q * np.array([1, 0.2, 1, 1, 1, 1]), tau=log.tau))
    (finding,) = (each for each in found(report, "coverage") if each.joint == 2)
    assert finding.severity == "warning"
    assert report.findings[0].severity == "refuse"


def test_a_name_is_taken_once(coverage):
    """A second check of the same name is refused, and so is an object that is no check."""
    with pytest.raises(InputError, match="'coverage' exists already"):
        CHECKS.register(type("Other", (Coverage,), {}))
    with pytest.raises(InputError, match="is no Check"):
        CHECKS.register(Finding)
