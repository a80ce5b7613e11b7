"""A model file holds all of the robot that the model's torque refers to."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from estimation import load_model
from estimation.models.extension import Extension
from estimation.models.model import Model
from estimation.models.robot_in_file import build_robot, describe_robot
from robots import load_robot
from robots.common.errors import InputError
from robots.limits import BOUNDS
from robots.regressor import default_model
from robots.terms.effects import EFFECTS, situation


@pytest.fixture(scope="module")
def er3a():
    """An arm whose joints have ranges that are not symmetric, torque limits, gears and rotors."""
    return load_robot("er3a")


@pytest.fixture(scope="module")
def moving(er3a):
    """Its motion of 20 s, about the middle of its ranges."""
    t = 0.004 * np.arange(5000)
    w = 2 * np.pi * (0.3 + 0.07 * np.arange(er3a.n))
    # From the end of a range to its middle and beyond: springs bend, load and friction turn round.
    middle, reach = (er3a.limits.upper + er3a.limits.lower) / 2, (er3a.limits.upper - er3a.limits.lower) / 4
    angle = np.outer(t, w)
    return t, middle + reach * np.sin(angle), reach * w * np.cos(angle), -reach * w**2 * np.sin(angle)


@pytest.fixture(scope="module")
def base(er3a):
    """The described robot as a model; that of a fit holds the first rotor within the first link."""
    model = default_model(er3a, velocity_scale=1e-3)
    kept = tuple(i for i, name in enumerate(model.names) if name != "Im_1")
    return Model(
        torque_model=model,
        columns=kept,
        values=model.nominal[list(kept)],
        covariance=np.zeros((len(kept), len(kept))),
        determined=np.full(len(kept), True),
        formulas=tuple(model.names[i] for i in kept),
    )


def _extensions(effect, model, state):
    """The effect on each of its joints, in some of its shapes, as large as what the model itself says."""
    for joint in effect.joints(model.robot):
        shapes = effect.grid(state, joint)
        for shape in shapes[:: max(1, len(shapes) // 3)]:
            count = len(effect.parameters(model.robot, joint))
            yield Extension(
                effect=effect.name,
                joint=joint,
                shape=tuple(shape),
                coefficients=np.linspace(0.05, 0.1, count),
                covariance=np.zeros((count + len(shape), count + len(shape))),
            )


@pytest.mark.slow
@pytest.mark.parametrize("name", EFFECTS)
def test_an_extended_model_says_the_same_once_loaded(name, base, moving, tmp_path):
    """Each effect's torque is the same by the model in memory and by its file: the file holds what it refers to."""
    t, *states = moving
    whole = np.zeros(base.torque_model.size)
    whole[list(base.columns)] = base.values
    tried = list(_extensions(EFFECTS[name], base, situation(base.torque_model, whole, t, *states)))
    assert tried
    replace(base, extensions=tuple(tried)).save(tmp_path / "model.json")
    loaded = load_model(tmp_path / "model.json")
    assert len(loaded.extensions) == len(tried)
    alone, alone_loaded = base.torque(*states, t), replace(loaded, extensions=()).torque(*states, t)
    np.testing.assert_allclose(alone_loaded, alone, rtol=0, atol=1e-8 * max(np.abs(alone).max(), 1.0))
    for extension, again in zip(tried, loaded.extensions, strict=True):
        expected = replace(base, extensions=(extension,)).torque(*states, t) - alone
        np.testing.assert_allclose(
            replace(loaded, extensions=(again,)).torque(*states, t) - alone,
            expected,
            rtol=0,
            atol=1e-8 * max(np.abs(alone).max(), 1.0),
        )


def test_the_robot_of_a_file_is_that_of_the_model(base, tmp_path):
    """Limits, gears, rotors and torque constants come back, bounds that are not there as none."""
    robot = replace(base.robot, limits=replace(base.robot.limits, torque=np.full(6, np.inf)))
    model = replace(base, torque_model=replace(base.torque_model, robot=robot))
    model.save(tmp_path / "model.json")
    loaded = load_model(tmp_path).robot
    for name in (*BOUNDS, "kinds"):
        np.testing.assert_array_equal(getattr(loaded.limits, name), getattr(robot.limits, name))
    for quantity in ("gear_ratio", "rotor_inertia", "torque_constant"):
        np.testing.assert_array_equal(getattr(loaded, quantity), getattr(robot, quantity))


def test_effects_of_a_file_without_limits_are_refused(base, tmp_path):
    """An older file's spring would be centred elsewhere; a model without effects is read as before."""
    extension = Extension(
        effect="spring", joint=2, shape=(0.0, 0.0, 3.0), coefficients=np.ones(4), covariance=np.zeros((7, 7))
    )
    path = tmp_path / "model.json"
    for extensions in ((), (extension,)):
        data = replace(base, extensions=extensions).to_dict()
        for key in ("limits", "gear_ratio", "rotor_inertia"):
            del data["robot"][key]
        path.write_text(json.dumps(data))
        if extensions:
            with pytest.raises(InputError, match="lacks the robot's limits"):
                load_model(path)
        else:
            assert np.isinf(load_model(path).robot.limits.upper).all()


def test_the_flange_is_in_the_file_and_a_payload_acts_there(tmp_path):
    """A model of an arm whose flange is not its last link's frame predicts a payload alike before and after."""
    ur10 = load_robot("ur10")
    model = default_model(ur10, velocity_scale=1e-3)
    made = Model(
        torque_model=model,
        columns=tuple(range(model.size)),
        values=model.nominal,
        covariance=np.zeros((model.size, model.size)),
        determined=np.full(model.size, True),
        formulas=model.names,
    )
    path = tmp_path / "model.json"
    made.save(path)
    state = np.random.default_rng(0).normal(size=(3, 5, 6))
    body = [2.0, 0.1, 0.0, 0.2, 0.03, 0.0, 0.0, 0.03, 0.0, 0.01]
    again = load_model(path)
    np.testing.assert_allclose(again.torque(*state, payload=body), made.torque(*state, payload=body), rtol=1e-12)
    data = json.loads(path.read_text())
    del data["robot"]["tip"]
    path.write_text(json.dumps(data))
    older = load_model(path)
    np.testing.assert_allclose(older.torque(*state), made.torque(*state), rtol=1e-12)
    with pytest.raises(InputError, match="does not state the pose of the flange"):
        older.torque(*state, payload=body)


def test_speed_limits_that_depend_on_the_position_are_kept():
    """They come back from JSON as they were."""
    robot = load_robot("fr3")
    again = build_robot(json.loads(json.dumps(describe_robot(robot)))).limits.ramp
    for name in ("lower", "upper", "offset", "deceleration", "reserve"):
        np.testing.assert_array_equal(getattr(again, name), getattr(robot.limits.ramp, name))
    assert again.share == robot.limits.ramp.share
