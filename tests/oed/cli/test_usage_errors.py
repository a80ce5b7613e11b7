"""A wrong name is answered with the nearest right one."""

from __future__ import annotations

import pytest

from oed.cli.usage_errors import nearest_name, with_nearest


@pytest.mark.parametrize(
    ("problem", "allowed", "meant"),
    [
        ("unknown method 'hubber'", "wls, ols, huber", "huber"),
        ("effort 'quik'", "quick, standard, thorough", "quick"),
        ("--to urscipt", "csv, urscript, kuka", "urscript"),
        ("method 'zzz'", "wls, ols", None),
        ("the model of 'ur10' has six joints", "7", None),
        ("found 'wls'", "wls, ols", None),
    ],
)
def test_a_wrong_choice_is_answered_with_the_nearest(problem: str, allowed: str, meant: str | None) -> None:
    """Behind the message, and only where a choice is near."""
    assert with_nearest(problem, allowed, "text") == ("text" if meant is None else f"text; did you mean {meant}?")


def test_exchanged_letters_count_least() -> None:
    """Of two equally similar names, the one with the same letters was meant."""
    assert nearest_name("robto", ["rotor", "robot"]) == "robot"
    assert nearest_name("torque_is", ["torque-is", "torque"]) == "torque-is"
    assert nearest_name("stribek", ["stribeck", "joint_elasticity"]) == "stribeck"
