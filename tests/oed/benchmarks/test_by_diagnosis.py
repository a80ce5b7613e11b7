"""What the diagnosis says, in the form of the benchmark's answers."""

from __future__ import annotations

from typing import Any

import pytest

from oed.benchmarks.answers import NamedEffect, StatedValue
from oed.benchmarks.by_diagnosis import named_effect


def finding(effect: str, joint: int | None, **values: Any) -> dict[str, Any]:
    """A finding of diagnosis.json."""
    stated = [{"name": name, "value": value, "ci95": ci95} for name, (value, ci95) in values.items()]
    return {"effect": effect, "joint": joint, "parameters": stated}


@pytest.mark.parametrize(
    ("found", "wanted"),
    [
        (
            finding("presliding_hysteresis", 3, presliding_travel=(0.01, [0.008, 0.02]), presliding_torque=(1.0, None)),
            NamedEffect(
                effect="presliding_hysteresis",
                joints=(3,),
                parameters={"presliding_distance": StatedValue(value=0.01, interval=(0.008, 0.02))},
            ),
        ),
        (
            finding("payload_change", None, mass_change=(2.0, [None, None]), change_time=(None, None)),
            NamedEffect(effect="payload_change", parameters={"mass": StatedValue(value=2.0)}),
        ),
        (finding("unexplained", 2), NamedEffect(effect="unknown", joints=(2,))),
    ],
)
def test_findings_become_effects(found: dict[str, Any], wanted: NamedEffect):
    """Names of parameters are translated, those that are not scored are left out, and so are undetermined bounds."""
    assert named_effect(found) == wanted
