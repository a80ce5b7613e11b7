"""Tests of the texts and intervals of a finding's parameters."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.diagnosis.findings import Finding, Gain, Parameter
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.results.wording import (
    _between_logs,
    _parameters,
    _roughly,
    _stopped,
    _uncertain_times,
    _within_logs,
    no_part,
)
from estimation.models.extension import Extension
from robots.robot import Robot
from robots.terms.effects import EFFECTS


@pytest.mark.parametrize(
    ("effect", "shape", "value", "interval", "roughly"),
    [
        ("thermal_friction", 0, 113.0, (80.0, 161.0), True),
        ("thermal_friction", 0, 113.0, (95.0, 134.0), False),
        ("load_dependent_friction", 0, 0.0, (-0.2, 0.2), True),
        ("load_dependent_friction", 0, 0.8, (0.7, 0.9), False),
        ("friction_step", 0, 2000.0, (1999.9, 2000.1), False),
        ("friction_step", 0, 2.0, (1.7, 2.3), True),
        # A dead centre is a position, so its size is not relative to zero.
        ("spring", 1, 0.01, (-0.1, 0.1), False),
        # An infinite interval is stated elsewhere.
        ("thermal_friction", 0, 113.0, (-np.inf, np.inf), False),
    ],
)
def test_a_fifth_of_a_value_or_of_a_second(
    effect: str, shape: int, value: float, interval: tuple[float, float], roughly: bool
) -> None:
    """A nonlinear parameter is rough if its interval exceeds a fifth of its value; for a time, 0.2 s."""
    assert _roughly(EFFECTS[effect].shapes[shape], value, interval) is roughly


@pytest.mark.parametrize(
    ("effect", "shape", "value", "stopped"),
    [
        ("presliding_hysteresis", 0, 0.2, True),
        ("presliding_hysteresis", 0, 1e-5, True),
        ("presliding_hysteresis", 0, 0.19, False),
        ("joint_elasticity", 2, 0.05, False),  # the default value
        ("torque_constant_saturation", 0, 1.0, False),  # an exponent, not a size
    ],
)
def test_a_size_at_its_bound_is_not_determined(effect: str, shape: int, value: float, stopped: bool) -> None:
    """A size at its bound is not determined, for any interval."""
    assert _stopped(EFFECTS[effect].shapes[shape], value) is stopped


def test_an_interval_holds_what_machines_may_have(arm: Robot) -> None:
    """Intervals are cut at physical bounds, and a rough value stays rough after that."""
    hypothesis = Hypothesis(EFFECTS["stribeck"], 1)
    member = FittedEffect(hypothesis, (0.05, 1.0), None, 100.0, np.array([7.9]), 3, 1.0)  # type: ignore[arg-type]
    extension = Extension(
        effect="stribeck",
        joint=1,
        shape=member.shape,
        coefficients=member.coefficients,
        covariance=np.diag([5.3, 0.001, 0.4]) ** 2,
    )
    fitted: Any = SimpleNamespace(model=SimpleNamespace(extensions=[extension]))
    torque, _, exponent = _parameters(arm, member, fitted, 0, np.array([False, True, True]))
    assert torque.ci95 == (0.0, pytest.approx(7.9 + 1.959964 * 5.3))
    assert exponent.ci95[0] >= EFFECTS["stribeck"].shapes[1].lower
    assert not exponent.determined


@pytest.mark.parametrize(("error", "reported"), [(0.02, True), (0.3, False)])
def test_levers_that_are_perhaps_none_have_no_dead_centre(arm: Robot, error: float, reported: bool) -> None:
    """A dead centre is determined only if the lever ratio is significantly above zero."""
    coefficients = np.array([400.0, -300.0, 0.0, 900.0])
    member = FittedEffect(Hypothesis(EFFECTS["spring"], 1), (0.3, -2.9, 3.0), None, 100.0, coefficients, 6, 1.0)  # type: ignore[arg-type]
    covariance = np.diag([4.0, 3.0, 0.0, 9.0, error, 0.1, 0.0]) ** 2
    extension = Extension(
        effect="spring", joint=1, shape=member.shape, coefficients=coefficients, covariance=covariance
    )
    fitted: Any = SimpleNamespace(model=SimpleNamespace(extensions=[extension]))
    centre = _parameters(arm, member, fitted, 0, np.ones(7, dtype=bool))[-1]
    assert centre.name == "dead_centre"
    assert centre.determined is reported
    assert bool(np.isfinite(centre.ci95).all()) is reported


def test_what_is_no_part_of_the_model_says_so() -> None:
    """A rejected finding is reported as unexplained, and its text says that the model does not contain it."""
    finding = Finding(
        effect="joint_elasticity",
        joint=2,
        parameters=(Parameter(name="x", value=1.0, unit="1", standard_error=0.1, ci95=(0.8, 1.2), determined=True),),
        p_value=1e-9,
        delta_bic=50.0,
        gain=Gain(nrmse_before=0.02, nrmse_after=0.03, ci95=(-0.02, -0.01), joints=(2, 3)),
        rivals=(("backlash", 3.0),),
        sentence="It winds up.",
        visible=0.5,
    )
    refuted = no_part(finding)
    assert (refuted.effect, refuted.joint, refuted.parameters, refuted.rivals) == ("unexplained", 2, (), ())
    assert "resembles joint elasticity" in refuted.sentence
    assert "the model does not contain it" in refuted.sentence
    assert "did not improve the held-out prediction" in no_part(finding_of("pattern:load:0:odd", finding)).sentence


def finding_of(pattern: str, finding: Finding) -> Finding:
    """Returns the finding as an unexplained pattern."""
    return replace(finding, effect="unexplained", pattern=pattern)


def test_a_gain_elsewhere_is_reported_with_its_joints() -> None:
    """A gain on other joints than the finding's own is stated with these joints."""
    gain = Gain(nrmse_before=0.02, nrmse_after=0.01, ci95=(0.0, 0.02))
    bare: Any = {"effect": "encoder_offset", "parameters": (), "p_value": 0.0, "delta_bic": 9.0, "rivals": ()}
    bare |= {"sentence": "", "visible": 1.0}
    reported = {
        joints: Finding(joint=4, gain=replace(gain, joints=joints), **bare).elsewhere
        for joints in ((), (4,), (5, 6), (5,))
    }
    assert reported == {(): "", (4,): "", (5, 6): " of joints 5, 6", (5,): " of joint 5"}


@pytest.mark.parametrize("effect", ["thermal_friction", "load_heat"])
@pytest.mark.parametrize(
    ("falls", "believed"),
    [
        ((3.0, 1.0), True),
        ((-1.0, 2.0), True),  # more friction at low speed, less at high speed
        ((-3.3, -1.6), False),
        ((-3.3, 0.2), False),  # more friction at all speeds of a joint of 10 rad/s
        ((3.3, -0.2), True),
    ],
)
def test_what_warms_up_gains_no_friction(arm: Robot, effect: str, falls: tuple[float, float], believed: bool) -> None:
    """Coulomb or viscous friction may rise with heat, but not the total friction at all speeds."""
    shape = tuple(400.0 if own.name == "time_constant" else 0.0 for own in EFFECTS[effect].shapes)
    fast = replace(arm, limits=replace(arm.limits, velocity=np.full(arm.n, 10.0)))
    assert EFFECTS[effect].is_plausible(fast, 1, np.array(falls), shape) is believed


def test_an_uncertain_time_of_a_change_is_stated_with_its_interval() -> None:
    """A determined time needs no sentence; nor does one without an interval, of which nothing is known."""
    sure = Parameter(
        name="change_time", value=210.37, unit="s", standard_error=0.01, ci95=(210.3, 210.4), determined=True
    )
    assert not _uncertain_times([sure])
    rough = replace(sure, ci95=(59.72, 361.04), determined=False)
    assert _uncertain_times([rough]) == " The time of the change is uncertain: between t = 59.7 and 361.0 s."
    assert not _uncertain_times([replace(rough, ci95=(-np.inf, np.inf))])


def test_a_push_with_open_edges_may_have_lasted_longer() -> None:
    """If start or duration has no interval; two intervals need no sentence."""
    start = Parameter(name="start", value=43.04, unit="s", standard_error=0.03, ci95=(42.9, 43.1), determined=True)
    duration = replace(start, name="duration", value=3.95, ci95=(3.6, 4.4))
    assert not _uncertain_times([start, duration])
    open_ = replace(start, ci95=(-np.inf, np.inf), determined=False)
    assert _uncertain_times([open_, duration]) == " It may have begun earlier or ended later."


@pytest.mark.parametrize(("value", "between"), [(10.0, True), (12.0, True), (12.5, False), (5.0, False)])
def test_a_change_between_two_logs_is_said_as_that(value: float, between: bool) -> None:
    """A change in the pause between two logs has their names, and its time stays inside the logs."""
    t = np.concatenate([np.arange(0.0, 8.0, 0.01), np.arange(12.0, 20.0, 0.01)])
    recording: Any = SimpleNamespace(t=t, starts=(0, 800), names=("monday", "tuesday"))
    own = Parameter(
        name="change_time", value=value, unit="s", standard_error=300.0, ci95=(-590.0, 610.0), determined=False
    )
    (limited,) = _within_logs(recording, [own], EFFECTS["payload_change"])
    assert limited.ci95 == (0.0, pytest.approx(19.99))
    sentence = EFFECTS["payload_change"].describe(None, np.ones(10), (value, 1.0))
    assert sentence == f"The payload increased by 1 kg at t = {value:.2f} s."
    found = _between_logs(recording, sentence, [limited])
    assert found == (("The payload increased by 1 kg between monday and tuesday." if between else sentence), between)
