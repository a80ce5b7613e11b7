"""Members of a given gain, and a stand-in for the fit of several together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from estimation.diagnosis.hypothesis_tests.groups import Group
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.refinement import FittedEffect
from estimation.diagnosis.validations import comparison, verdict
from robots.terms.effects import EFFECTS

ROWS = 5000
PRICE = float(np.log(ROWS))


def accepting(monkeypatch: pytest.MonkeyPatch, accept: Callable[..., Any]) -> None:
    """Has members fitted together by a function of the test."""
    for module in (comparison, verdict):
        monkeypatch.setattr(module, "accept", accept)


def member_of(name: str, joint: int | None, gain: float, degrees: int) -> FittedEffect:
    """A member of a gain and a number of parameters."""
    group = Group((0,), (np.ones((ROWS, 1), np.float32),), np.zeros((1, 1)), np.eye(1), np.ones(1), np.ones(1))
    return replace(FittedEffect(Hypothesis(EFFECTS[name], joint), (), group, gain, np.ones(1), degrees, 1.0))
