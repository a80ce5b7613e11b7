"""Codes of findings: each kind of finding has one, and logs that are spoilt as the table says give it."""

from __future__ import annotations

import ast
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from estimation.gate import check_log
from estimation.gate.explanations import CODES, EXPLANATIONS, explain
from robots.common.errors import InputError
from robots.robot import Robot
from robots.signals import Log

ROOT = Path(__file__).parents[3]


def literal_names() -> set[str]:
    """Names of findings that the gate makes, and of notes that readers leave, as far as they are written out."""
    found: set[str] = set()
    for path in [*(ROOT / "estimation/gate").rglob("*.py"), *(ROOT / "estimation/logs").glob("*.py")]:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "Finding":
                values = [keyword.value for keyword in node.keywords if keyword.arg == "name"]
                values += [
                    v for choice in values if isinstance(choice, ast.IfExp) for v in (choice.body, choice.orelse)
                ]
                found |= {value.value for value in values if isinstance(value, ast.Constant)}
            if isinstance(node, ast.Dict):
                pairs = {k.value: v for k, v in zip(node.keys, node.values, strict=True) if isinstance(k, ast.Constant)}
                if {"name", "text", "action"} <= pairs.keys() and isinstance(pairs["name"], ast.Constant):
                    found.add(pairs["name"].value)
    return {name for name in found if isinstance(name, str)}


def test_each_kind_of_finding_has_a_code():
    """No finding with a name of its own is without an explanation."""
    assert len(literal_names()) > 45
    assert literal_names() - CODES.keys() == set()


def test_codes_are_used_once_and_in_order():
    """A number is never given twice, and the text says all."""
    assert [item.number for item in EXPLANATIONS] == list(range(1, len(EXPLANATIONS) + 1))
    assert len(CODES) == len(EXPLANATIONS)
    for item in EXPLANATIONS:
        assert all(text.endswith((".", '".')) for text in (item.meaning, item.example, item.remedy)), item.name


def test_codes_are_found_in_any_spelling():
    """The code, its end, in small letters, or the name; another one is refused with what is allowed."""
    assert explain("OED-L010") is explain("l010") is explain("delay") is explain(" oed-l010 ")
    with pytest.raises(InputError, match="OED-L001 to"):
        explain("OED-L999")


def held(values: np.ndarray, every: int) -> np.ndarray:
    return values[(np.arange(len(values)) // every) * every]


def rounded(values: np.ndarray, joint: int, step: float) -> np.ndarray:
    changed = values.copy()
    changed[:, joint] = np.round(changed[:, joint] / step) * step
    return changed


SPOILT: dict[str, Callable[[Log], Log]] = {
    "unit_of_position": lambda log: replace(log, q=np.rad2deg(log.q)),
    "unit_of_time": lambda log: replace(log, t=1000.0 * log.t),
    "torque_sign": lambda log: replace(log, tau=log.tau * np.array([-1, 1, 1, 1, 1, 1])),
    "gap": lambda log: log.rows(np.r_[0:1000, 1200 : len(log.t)]),
    "held_torque": lambda log: replace(log, tau=held(log.tau, 10)),
    "same_column": lambda log: replace(log, tau=log.tau[:, [0, 1, 1, 3, 4, 5]]),
    "constant_torque": lambda log: replace(log, tau=np.where(np.arange(6) == 0, 3.2, log.tau)),
    "quantised_position": lambda log: replace(log, q=rounded(log.q, 0, 0.01)),
    "row_counter": lambda log: replace(log, t=np.arange(float(len(log.t)))),
    "short": lambda log: log.rows(slice(0, 20)),
    "no_motion": lambda log: replace(log, q=np.zeros_like(log.q)),
    "delay": lambda log: replace(log, tau=np.roll(log.tau, 3, axis=0)),
    "jump": lambda log: replace(log, q=log.q + 0.5 * (np.arange(len(log.t)) >= 2000)[:, None] * (np.arange(6) == 0)),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SPOILT)
def test_a_log_that_is_spoilt_as_the_table_says_has_the_code(name: str, er3a: Robot, good: Callable[..., Log]):
    """What the table calls a log that causes a finding does cause it, and the summary states the code."""
    assert CODES[name] not in check_log(er3a, good()).summary()
    report = check_log(er3a, SPOILT[name](good()))
    assert name in {finding.name for finding in report.findings}
    assert f" {CODES[name]}: " in report.summary()
