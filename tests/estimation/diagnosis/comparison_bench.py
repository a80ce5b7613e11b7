"""Effects with a given gain, and a replacement for the fit of several effects together, for tests."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.diagnosis.hypothesis_tests import fitted_effects
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Group
from estimation.diagnosis.validations import name_comparison
from robots.terms.effects import EFFECTS

ROWS = 5000
PRICE = float(np.log(ROWS))


def accepting(monkeypatch: pytest.MonkeyPatch, accept: Callable[..., Any]) -> None:
    """Has members fitted together by a function of the test."""
    for module in (name_comparison, fitted_effects):
        monkeypatch.setattr(module, "accept", accept)


def adding(monkeypatch: pytest.MonkeyPatch, gains: Mapping[int, float]) -> None:
    """Makes effects explain together the sum of their gains, which are given by the identity of their groups."""
    accepting(monkeypatch, lambda problem, groups: SimpleNamespace(gain=sum(gains[id(g)] for g in groups)))


def member_of(name: str, joint: int | None, gain: float, degrees: int) -> FittedEffect:
    """Builds a fitted effect with a gain and a number of parameters."""
    group = Group((0,), (np.ones((ROWS, 1), np.float32),), np.zeros((1, 1)), np.eye(1), np.ones(1), np.ones(1))
    return replace(FittedEffect(Hypothesis(EFFECTS[name], joint), (), group, gain, np.ones(1), degrees, 1.0))
