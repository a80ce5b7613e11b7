"""Specification of extensions and patterns: names that are read again, values that fit, words."""

from __future__ import annotations

import numpy as np
import pytest

from estimation.models.extension import Extension, extension_torque, find_effect, read_extension
from robots.common.errors import InputError
from robots.regressor import default_model
from robots.robot import Robot
from robots.terms.discrepancies.clock_drift import ClockDrift
from robots.terms.discrepancies.flange_oscillator import FlangeOscillator
from robots.terms.discrepancies.flange_spring import FlangeSpring
from robots.terms.discrepancies.gain_drift import GainDrift
from robots.terms.discrepancies.offset_step import ZeroStep
from robots.terms.discrepancies.patterns import all_patterns, build_pattern
from robots.terms.discrepancies.payload_drift import PayloadDrift
from robots.terms.effects import Situation, situation


@pytest.fixture(scope="module")
def state(arm: Robot) -> Situation:
    """Three hundred samples of a smooth motion of the arm, long enough for slow swings."""
    t = 0.04 * np.arange(300)
    q = np.column_stack([np.sin(2 * t), np.cos(3 * t)])
    dq, ddq = np.column_stack([2 * np.cos(2 * t), -3 * np.sin(3 * t)]), -q * [4.0, 9.0]
    model = default_model(arm, velocity_scale=1e-3)
    return situation(model, model.nominal, t, q, dq, ddq)


def test_every_pattern_is_read_from_its_name_and_has_as_many_columns_as_it_says(arm: Robot, state: Situation) -> None:
    """A pattern in a model file is the pattern that was found; all its values are finite."""
    *own, swinging, pulling, fading, draining, parting, _, _, _ = all_patterns(arm)
    for pattern in own:
        if isinstance(pattern, ZeroStep):
            # It acts on several joints.
            continue
        assert build_pattern(pattern.name) == pattern
        for shape in pattern.grid(state, 1)[:2]:
            X = pattern.columns(state, 1, shape)
            assert X.shape == (300, 2, len(pattern.parameters(arm, 1)))
            assert np.isfinite(X).all()
            assert not X[:, 1].any()
        assert pattern.describe(1, np.zeros(1), pattern.grid(state, 1)[0]).startswith("The residual torque of joint 1")
    assert type(build_pattern(swinging.name)) is type(swinging) is FlangeOscillator
    assert swinging.joints(arm) == (None,)
    for shape in swinging.grid(state, None)[:2]:
        X = swinging.columns(state, None, shape)
        assert X.shape == (300, 2, len(swinging.parameters(arm, None)))
        assert np.isfinite(X).all()
        # The flange is on the elbow's axis: it moves, but no force on it turns the elbow.
        assert X[:, 0].any(axis=0).all()
        assert not X[:, 1].any()
    assert type(build_pattern(pulling.name)) is type(pulling) is FlangeSpring
    assert pulling.joints(arm) == (None,)
    assert pulling.columns(state, None).shape == (300, 2, len(pulling.parameters(arm, None)))
    assert type(build_pattern(fading.name)) is type(fading) is GainDrift
    assert type(build_pattern(draining.name)) is type(draining) is PayloadDrift
    assert type(build_pattern(parting.name)) is type(parting) is ClockDrift
    for whole in (swinging, pulling):
        text = whole.describe(None, np.zeros(12), whole.grid(state, None)[0])
        assert text.startswith("The residual torque of all joints")


def test_what_repeats_along_a_linear_axis_does_so_by_millimetres() -> None:
    """A wave number is reported as a length; of a joint that turns it stays a number per turn."""
    turns = build_pattern("pattern:turns:0:even")
    assert turns is not None
    shape = (2 * np.pi / 0.04,)
    assert "repeats every 40 mm and grows" in turns.describe(1, np.zeros(8), shape, force="N", length="m")
    assert "repeats 157 times a turn of the joint" in turns.describe(1, np.zeros(8), shape)


def test_an_odd_pattern_turns_round_with_the_motion(arm: Robot, state: Situation) -> None:
    """It is its even sibling times the sign of the velocity."""
    even, odd = build_pattern("pattern:angle:2:even"), build_pattern("pattern:angle:2:odd")
    assert even is not None
    assert odd is not None
    assert odd.local(state, 1) == pytest.approx(even.local(state, 1) * state.sign[:, :1])
    assert "direction" in odd.sentence(1)


def test_what_repeats_per_turn_is_all_that_an_error_of_the_position_does(state: Situation) -> None:
    """An error e of eight waves a turn makes M e'' + D e' + K e, its derivatives in closed form."""
    pattern = build_pattern("pattern:turns:0:even")
    assert pattern is not None
    h, phase = 8.0, 0.7
    q, v, a = (x[:, 0] for x in (state.q, state.dq, state.ddq))
    s, c = np.sin(h * q + phase), np.cos(h * q + phase)
    torque = 3.0 * (-h * a * s - (h * v) ** 2 * c) + 20.0 * (-h * v * s) + 400.0 * c
    X = pattern.local(state, 1, (h,))
    left = torque - X @ np.linalg.lstsq(X, torque)[0]
    assert np.abs(left).max() < 1e-9 * np.abs(torque).max()


def test_an_extension_survives_plain_data(arm: Robot, state: Situation) -> None:
    """Effect, joint, shape, coefficients and covariance, unknown variances too."""
    extension = Extension(
        effect="friction_step",
        joint=2,
        shape=(1.5,),
        coefficients=np.array([0.3, 0.1]),
        covariance=np.diag([0.01, np.inf, 0.04]),
    )
    again = read_extension(extension.to_dict(robot=arm), arm)
    assert again.torque(state) == pytest.approx(extension.torque(state))
    assert np.array_equal(again.covariance, extension.covariance)
    expected = (state.t >= 1.5) * (0.3 * state.sign[:, 1] + 0.1 * state.dq[:, 1])
    assert extension.torque(state)[:, 1] == pytest.approx(expected)
    assert [item["name"] for item in extension.parameters(arm)] == ["coulomb_step", "viscous_step", "change_time"]


def test_what_is_late_is_all_that_comes_before_a_cut(arm: Robot, state: Situation) -> None:
    """A drift is logged late with the rest, whatever the order of the file; and all of that is cut off by a limit."""

    def extension(effect: str, joint: int | None, shape: tuple[float, ...], coefficients: list[float]) -> Extension:
        size = len(shape) + len(coefficients)
        values = np.array(coefficients)
        return Extension(effect=effect, joint=joint, shape=shape, coefficients=values, covariance=np.eye(size))

    delay, level = 0.02, 0.6 * float(np.abs(state.torque[:, 0]).max())
    late = extension("time_delay", None, (delay,), [delay])
    spring = extension("spring", 1, (0.0, 0.0, 3.0), [3.0, 0.0, 0.0, 1.0])
    cut = extension("current_clipping", 1, (level,), [1.0])
    plain = spring.torque(state)
    before = np.interp(state.t - delay, state.t, plain[:, 0])
    for order in ([late, spring], [spring, late]):
        reported = extension_torque(order, state)[:, 0]
        assert reported[1:] == pytest.approx((late.torque(state)[:, 0] + before)[1:])
    assert np.abs(before - plain[:, 0]).max() > 0.01
    all_of_it = extension_torque([cut, late, spring], state) + state.torque
    assert np.abs(all_of_it[:, 0]).max() == pytest.approx(level)
    assert all_of_it[:, 1] == pytest.approx((extension_torque([late, spring], state) + state.torque)[:, 1])


def test_a_damaged_extension_is_refused(arm: Robot) -> None:
    """An unknown effect, a joint that the robot has not, too few values, or others than this version has, are named."""
    good = {"effect": "friction_step", "joint": 1, "shape": [1.0], "coefficients": [1, 2], "covariance": np.eye(3)}
    good["covariance"] = np.eye(3).tolist()
    with pytest.raises(InputError, match="unknown effect"):
        find_effect("pattern:nothing:0:even")
    with pytest.raises(InputError, match="joint 7"):
        read_extension({**good, "joint": 7}, arm)
    with pytest.raises(InputError, match="coefficients"):
        read_extension({**good, "coefficients": [1]}, arm)
    with pytest.raises(InputError, match="finite"):
        read_extension({**good, "coefficients": [1, float("inf")]}, arm)
    old = {
        "effect": "joint_elasticity",
        "joint": 1,
        "shape": [30.0, 0.0, 0.05],
        "coefficients": [1e-4],
        "covariance": np.eye(4).tolist(),
    }
    named = [{"name": name, "value": 1.0} for name in ("compliance", "resonance")]
    with pytest.raises(InputError, match="resonance"):
        read_extension({**old, "parameters": named}, arm)
    assert read_extension(old, arm).shape == (30.0, 0.0, 0.05)
    shorter = {**old, "shape": [30.0], "covariance": np.eye(2).tolist()}
    with pytest.raises(InputError, match="1 coefficients and 1 shape values"):
        read_extension(shorter, arm)
    with pytest.raises(InputError, match="another version"):
        read_extension({**shorter, "parameters": [{"name": "compliance"}, {"name": "dynamic_stiffness"}]}, arm)


@pytest.mark.parametrize("kind", ["speed", "load", "torque", "acceleration"])
def test_a_function_of_an_input_is_the_same_in_a_log_in_which_that_is_smaller(
    arm: Robot, state: Situation, kind: str
) -> None:
    """What was found in a whole motion says of its calmest part what it said there."""
    pattern = build_pattern(f"pattern:{kind}:0:even")
    assert pattern is not None
    (shape,) = pattern.grid(state, 1)
    assert pattern.bounds(state, 1) == ((shape[0], shape[0]),)
    coefficients = np.arange(1.0, len(pattern.parameters(arm, 1)) + 1)
    found = Extension(
        effect=pattern.name, joint=1, shape=shape, coefficients=coefficients, covariance=np.eye(len(coefficients) + 1)
    )
    rows = slice(100, 110)
    part = situation(state.model, state.parameters, state.t[rows], state.q[rows], state.dq[rows], state.ddq[rows])
    assert pattern.grid(part, 1)[0][0] < shape[0]
    assert found.torque(part) == pytest.approx(found.torque(state)[rows], abs=1e-12)
