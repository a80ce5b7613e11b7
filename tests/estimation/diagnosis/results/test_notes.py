"""Tests of notes on a diagnosis."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from estimation.diagnosis.calibration import MIN_WORSE_RATIO
from estimation.diagnosis.findings import Finding, Gain, Parameter
from estimation.diagnosis.results.notes import LITTLE, beside_larger, turning_joints, unsure_gain, worse_joints


def test_joints_that_the_extension_makes_worse_are_reported() -> None:
    """Joints whose held-out error grows by more than a tenth and 0.1 % of the torque are noted; others are not."""
    before = np.array([0.050, 0.050, 0.0005, 0.050, np.nan])
    after = np.array([0.051, 0.074, 0.0012, 0.080, np.nan])
    (note,) = worse_joints(before, after)
    assert note == "The extended model has a larger held-out error on joints 2 (5 -> 7.4 %), 4 (5 -> 8 %)."
    assert MIN_WORSE_RATIO * 0.05 < 0.074
    assert 0.0005 + LITTLE > 0.0012
    assert worse_joints(before[:1], after[:1]) == []
    (one,) = worse_joints(before[1:2], after[1:2])
    assert "on joint 1 (5 -> 7.4 %)" in one


def test_rows_at_rest_explain_an_error_that_is_far_larger_with_them() -> None:
    """A note states the fraction of rows that do not count if the error over all rows is twice as large."""
    counts = np.ones((1000, 4), dtype=bool)
    counts[:400, 0] = counts[:350, 1] = counts[:400, 2] = counts[:2, 3] = False
    after = np.array([0.025, 0.025, 0.025, 0.025])
    (note,) = turning_joints(np.array([0.31, 0.08, 0.04, 0.30]), after, counts)
    assert note.startswith("Joints 1, 2: in 35 to 40 % of the held-out rows the joint rests or reverses.")
    (one,) = turning_joints(np.array([0.31, 0.04, 0.04, 0.30]), after, counts)
    assert one.startswith("Joint 1: in 40 % of the held-out rows")
    assert turning_joints(np.full(4, np.nan), after, counts) == []
    assert turning_joints(after, after, counts) == []


def test_a_name_of_which_nothing_is_determined_is_no_more_than_likely() -> None:
    """A finding without a determined parameter or a significant gain is noted as the most likely cause only."""

    def finding(effect: str, *determined: bool) -> Finding:
        parameters = tuple(
            Parameter(name="p", value=1.0, unit="1", standard_error=1.0, ci95=(0.0, 2.0), determined=known)
            for known in determined
        )
        gain = Gain(nrmse_before=0.04, nrmse_after=0.036, ci95=(-0.01, 0.014))
        reported = {"p_value": 0.0, "delta_bic": 90.0, "rivals": (), "sentence": "", "visible": 1.0, "coordinate": ""}
        return Finding(effect=effect, joint=2, parameters=parameters, gain=gain, **reported)

    open_ = unsure_gain(finding("stribeck", False, False))
    assert open_.startswith("The held-out gain of stribeck of joint 2 is not significant")
    assert open_.endswith("the effect is reported as the most likely cause only.")
    for other in (finding("stribeck", False, True), finding("unexplained", False), finding("stribeck")):
        assert unsure_gain(other).endswith("its interval includes zero.")


def test_what_is_as_small_as_formulas_leave_is_reported_all_the_same() -> None:
    """An effect that is small beside a stronger one on its joint is noted, with its share of that one's gain."""
    step, delay, friction, spring = (
        SimpleNamespace(
            hypothesis=SimpleNamespace(label=label, effect=SimpleNamespace(delays_all_torque=label == "a delay")),
            group=SimpleNamespace(joints=tuple(gains)),
            gain_on=lambda joints, gains=gains: sum(gains.get(j, 0.0) for j in joints),
        )
        for label, gains in (
            ("a step", {2: 300.0}),
            ("a delay", {1: 900.0, 2: 900.0}),
            ("a friction", {2: 5000.0}),
            ("a spring", {1: 9000.0, 2: 600.0}),
        )
    )
    (note,) = beside_larger(step, [spring, friction])
    assert note.startswith("a step is significant too, but not reported as a finding.")
    assert "On joint 3, it improves the fit by only 6.0 % of what a friction improves it by." in note
    assert "A small error in the formula of a friction can produce the same residual." in note
    assert max(len(sentence.split()) for sentence in note.split(". ")) <= 25
    (note,) = beside_larger(delay, [friction])
    assert note.startswith("a delay is significant too, but not reported as a finding. A small error in the formula")
    assert beside_larger(None, [friction]) == ()
    assert beside_larger(step, []) == ()
