"""What every effect must do."""

from __future__ import annotations

import numpy as np
import pytest

from robots.regressor import default_model
from robots.terms.effects import EFFECTS, EXPERIMENTS, StaticEffect, situation

VOCABULARY = {
    "thermal_friction",
    "friction_step",
    "stribeck",
    "presliding_hysteresis",
    "asymmetric_friction",
    "load_dependent_friction",
    "position_dependent_friction",
    "torque_ripple",
    "backlash",
    "joint_elasticity",
    "joint_coupling",
    "spring",
    "torque_constant_error",
    "torque_constant_saturation",
    "current_clipping",
    "torque_sensor_drift",
    "time_delay",
    "encoder_offset",
    "payload_change",
    "base_tilt",
    "external_contact",
}

DRIVEN_BY_MOTION = {
    "thermal_friction",
    "friction_step",
    "stribeck",
    "asymmetric_friction",
    "load_dependent_friction",
    "position_dependent_friction",
    "joint_coupling",
    "time_delay",
    "current_lag",
    "shear_thinning",
    "load_stribeck",
    "load_heat",
}


@pytest.fixture(params=list(EFFECTS))
def effect(request):
    return EFFECTS[request.param]


def _points(effect, now):
    """The last joint that shows an effect, with three of its shapes: the first, the middle, the last."""
    shown = [(joint, grid) for joint in effect.joints(now.robot) if (grid := effect.grid(now, joint))]
    assert shown
    for joint, grid in shown[-1:]:
        for point in dict.fromkeys((grid[0], grid[len(grid) // 2], grid[-1])):
            yield joint, point


def test_the_vocabulary_is_there():
    """Every effect that a diagnosis may name exists, under its name."""
    assert set(EFFECTS) >= VOCABULARY
    assert all(name == effect.name for name, effect in EFFECTS.items())
    assert not any(EFFECTS[name].rare for name in VOCABULARY)


def test_rivals_and_experiments_exist(effect):
    """Each rival is an effect, another one, and each experiment is of a known kind."""
    assert effect.rivals
    assert effect.experiments
    assert set(effect.rivals) <= set(EFFECTS) - {effect.name}
    assert set(effect.experiments) <= set(EXPERIMENTS)


def test_columns_fit_the_parameters(effect, seen):
    """An effect gives one finite, not vanishing column per coefficient, on the joints that it says it acts on."""
    now = seen(velocity_scale=2e-3)
    for joint, point in _points(effect, now):
        parameters = effect.parameters(now.robot, joint)
        X = effect.columns(now, joint, point)
        assert X.shape == (len(now), now.robot.n, len(parameters))
        assert np.isfinite(X).all()
        size = np.abs(X).max(axis=(0, 1))
        if effect.name == "spring":  # a lever has no third order, and a linear spring no higher ones
            described = effect.described(now.robot, joint, point)
            size = size[[bool(coefficient.name) or k == 3 for k, coefficient in enumerate(described)]]
        if effect.name == "external_contact":  # one a joint, or a wrench's six
            size = size[: now.robot.n]
        if effect.name == "payload_change" and point[2]:  # a first link shows few parameters of its body
            size = size[size > 0]
        if effect.name != "torque_sensor_drift":  # of which a straight line is one column of eight
            assert size.min() > 0
        others = sorted(set(range(now.robot.n)) - set(effect.acts_on(now.robot, joint)))
        assert not X[:, others].any()
        assert len(point) == len(effect.shapes)
        names = [p.name for p in (*parameters, *effect.shapes) if p.name]
        assert len(set(names)) == len(names) >= len(point) + np.count_nonzero(size)
        assert all(p.lower < p.upper for p in parameters)


def test_the_grid_lies_within_the_bounds(effect, seen):
    """Every shape that a scan tries is possible, and within what the data allow."""
    now = seen(velocity_scale=2e-3)
    for joint in effect.joints(now.robot):
        bounds = effect.bounds(now, joint)
        assert len(bounds) == len(effect.shapes)
        for point in effect.grid(now, joint):
            assert len(point) == len(effect.shapes)
            for k, (value, (lower, upper), shape) in enumerate(zip(point, bounds, effect.shapes, strict=True)):
                assert value in effect.choices(now.robot, k) or lower <= value <= upper
                assert shape.lower <= value <= shape.upper


def test_proposals_come_from_the_grid(effect, seen):
    """Proposed shapes are points of the grid, no more than asked for unless all are given."""
    now = seen(velocity_scale=2e-3)
    residual = np.random.default_rng(0).normal(size=now.q.shape)
    joint = effect.joints(now.robot)[-1]
    grid = effect.grid(now, joint)
    proposed = effect.propose(now, joint, residual, 5)
    assert set(proposed) <= set(grid)
    assert len(proposed) <= 5 or proposed == grid


@pytest.mark.slow
def test_a_robot_at_rest_shows_no_friction(effect, seen, random_robot):
    """What motion brings about is zero at rest, and nothing at rest is not finite."""
    robot = random_robot(3, 4)
    model = default_model(robot, velocity_scale=2e-3)
    t = 0.004 * np.arange(400)
    zero = np.zeros((400, 4))
    now = situation(model, model.nominal, t, zero + 0.3, zero, zero)
    joint = effect.joints(robot)[-1]
    shape = tuple(min(max(1.0, s.lower), s.upper) for s in effect.shapes)
    X = effect.columns(now, joint, shape)
    assert np.isfinite(X).all()
    if effect.name in DRIVEN_BY_MOTION:
        np.testing.assert_allclose(X, 0.0, atol=1e-9)  # samples are summed in chunks: the last digit may differ
    for where in effect.joints(robot):
        assert all(np.isfinite(point).all() for point in effect.grid(now, where))


@pytest.mark.slow
def test_logs_do_not_touch_each_other(effect, seen):
    """But for heat, an effect sees each log as if it were alone."""
    t = np.concatenate([0.004 * np.arange(700), 60 + 0.004 * np.arange(800)])
    both = seen(times=t, starts=(0, 700), velocity_scale=2e-3)
    if "heat" in effect.name or effect.name == "thermal_friction":
        pytest.skip("heat passes from log to log")
    second = seen(times=t[700:], velocity_scale=2e-3)
    for joint, point in _points(effect, both):
        alone = effect.columns(second, joint, point)
        # The same arithmetic, summed in chunks that begin elsewhere; rounding is that of the largest values.
        atol = 1e-9 * max(float(np.abs(alone).max()), 1.0)
        np.testing.assert_allclose(effect.columns(both, joint, point)[700:], alone, rtol=1e-9, atol=atol)


def test_static_effects_share_one_expression(effect, seen):
    """The columns of a static effect are its symbolic expression, sample by sample."""
    if not isinstance(effect, StaticEffect):
        pytest.skip("has a memory, or acts through other sensitivities")
    now = seen(velocity_scale=2e-3)
    for joint, point in _points(effect, now):
        function = effect.function(now.robot, joint)
        X = effect.columns(now, joint, point)
        for i in (0, 333, 1400):
            signals = (now.q, now.dq, now.ddq, now.rigid, now.load, now.torque, now.sign)
            expected = function(*(signal[i] for signal in signals), list(point)).full()
            np.testing.assert_allclose(X[i], expected, rtol=1e-12, atol=1e-12)


def test_descriptions_and_coordinates_are_for_people(effect, seen):
    """An effect is reported in one sentence, and shows on an axis with a unit."""
    now = seen(velocity_scale=2e-3)
    for joint, point in _points(effect, now):
        text = effect.describe(joint, np.full(len(effect.parameters(now.robot, joint)), 0.1), point)
        assert text[0].isupper()
        assert text.endswith(".")
        assert not any(sign in text for sign in ("_", "nan", "inf "))
        label, values = effect.coordinate(now, joint, point)
        assert label.endswith("]")
        assert values.shape == (len(now),)
        assert np.isfinite(values).all()


@pytest.mark.parametrize(
    ("name", "shape", "more", "less"),
    [
        ("torque_constant_heat", (30.0,), "gives less torque", "gives more torque"),
        ("load_stribeck", (0.1,), "5 % of its load more", "5 % of its load less"),
    ],
)
def test_words_follow_the_sign(name: str, shape: tuple[float, ...], more: str, less: str) -> None:
    """A value below zero is reported as what it means."""
    for sign, words in ((1.0, more), (-1.0, less)):
        assert words in EFFECTS[name].describe(1, np.array([0.05 * sign]), shape)
