"""Specification of who builds expressions: one thread at a time, whichever function it is in."""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from robots.batch import builds_expressions
from robots.regressor import TorqueModel
from robots.terms.effect_bases import static
from robots.terms.situations import sensitivities


def test_two_functions_never_build_at_once():
    """Threads wait for each other also where they build different things; one may build within another."""
    inside: list[int] = []
    seen: list[int] = []

    @builds_expressions
    def build(depth: int) -> int:
        if depth:
            return build(depth - 1)
        inside.append(1)
        seen.append(len(inside))
        time.sleep(0.01)
        inside.pop()
        return depth

    @builds_expressions
    def other() -> int:
        return build(1)

    with ThreadPoolExecutor(4) as pool:
        results = [pool.submit(build, 2) for _ in range(4)] + [pool.submit(other) for _ in range(4)]
        assert [result.result() for result in results] == [0] * 8
    assert seen == [1] * 8


@pytest.mark.parametrize(
    "function", [sensitivities._evaluator, static._evaluator, static._row_evaluator, TorqueModel.evaluator]
)
def test_what_a_diagnosis_builds_in_threads_is_built_alone(function):
    """Every builder that its threads reach is wrapped."""
    inner = getattr(function, "__wrapped__", None)
    assert inner is not None
    wrapped = inner if hasattr(inner, "__wrapped__") else function
    assert wrapped.__code__.co_name == "alone"
