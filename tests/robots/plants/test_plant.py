"""The virtual robot."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

from robots.common.errors import InputError
from robots.plants import Plant, Sensors, nominal_plant, plant_effect, simulate
from robots.regressor import default_model
from robots.signals import Motion

IDEAL = Sensors(encoder_counts=0, torque_noise=0)


@pytest.fixture
def er3a(catalogue_robot):
    return catalogue_robot("er3a")


@pytest.fixture
def motion(er3a, states):
    q, dq, ddq = states(er3a, 200)
    return Motion(0.004 * np.arange(200), q, dq, ddq)


def pseudo_inertia(row):
    """The (4, 4) matrix whose positive definiteness says that a body of these parameters exists."""
    m, h, (xx, xy, xz, yy, yz, zz) = row[0], row[1:4], row[4:]
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    second = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    return np.block([[second, h[:, None]], [h[None, :], np.array([[m]])]])


def test_ideal_sensors_show_the_truth(er3a, motion, twin):
    """With ideal sensors the log is the motion, and pinocchio's torque plus friction plus rotor inertia."""
    log = simulate(nominal_plant(er3a, sensors=IDEAL), motion)
    dq = motion.dq
    # A joint that hardly moves feels hardly any Coulomb friction: tanh(dq / 1 mrad/s).
    shapes = np.stack([np.tanh(dq / 1e-3), dq, dq * np.abs(dq), dq**3], axis=2)
    expected = twin(er3a).torque(motion.q, dq, motion.ddq, er3a.inertia)
    expected += np.sum(shapes * er3a.friction, axis=2) + er3a.rotor_inertia * motion.ddq
    # 1e-9 of the torque's scale, as of the regressor
    np.testing.assert_allclose(log.tau, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    np.testing.assert_array_equal(log.q, motion.q)
    np.testing.assert_array_equal(log.t, motion.t)
    assert log.name == "virtual er3a"


def test_the_seed_makes_the_noise(er3a, motion):
    """The same seed gives the same log, another one another."""
    plant = nominal_plant(er3a)
    first, again, other = (simulate(plant, motion, seed=seed) for seed in (4, 4, 5))
    np.testing.assert_array_equal(first.tau, again.tau)
    np.testing.assert_array_equal(first.q, again.q)
    assert (first.tau != other.tau).all()


def test_one_sample_is_enough(er3a, motion):
    """A motion of one sample gives a log of one sample."""
    assert simulate(nominal_plant(er3a), motion.slice(0, 1)).tau.shape == (1, 6)


def test_a_motion_of_other_joints_is_refused(er3a):
    """A motion of another number of joints is refused."""
    motion = Motion(np.array([0.0, 1.0]), *np.zeros((3, 2, 5)))
    with pytest.raises(InputError, match="a motion of 5 joints; allowed: 6, as er3a has"):
        simulate(nominal_plant(er3a), motion)


@pytest.mark.parametrize("spread", [0.1, 0.5, 1.0])
def test_a_spread_keeps_bodies_possible(er3a, spread):
    """However wide the spread, every link stays a possible body: its pseudo-inertia is positive definite."""
    for seed in range(10):
        plant = nominal_plant(er3a, spread=spread, seed=seed)
        for row in plant.parameters[:60].reshape(6, 10):
            assert np.linalg.eigvalsh(pseudo_inertia(row))[0] > 0
        assert (plant.parameters[60:90] >= 0).all()


def test_a_spread_has_its_size(er3a):
    """Masses, friction and rotors scatter by the stated relative deviation, and a seed repeats them."""
    draws = np.array([nominal_plant(er3a, spread=0.1, seed=seed).parameters for seed in range(100)])
    ratio = np.log(draws[:, [0, 10, 20, 60, 64, 84, 85]] / nominal_plant(er3a).parameters[[0, 10, 20, 60, 64, 84, 85]])
    # Of 100 draws a deviation scatters by 7 percent, the mean of seven by 3: 15 percent is five times that.
    assert ratio.std(axis=0).mean() == pytest.approx(0.1, rel=0.15)
    np.testing.assert_array_equal(draws[3], nominal_plant(er3a, spread=0.1, seed=3).parameters)
    np.testing.assert_array_equal(nominal_plant(er3a).parameters, default_model(er3a).nominal)


def test_overrides(er3a):
    """Single parameters can be set by name; an unknown name is refused with the nearest ones."""
    plant = nominal_plant(er3a, overrides={"f1_3": 7.5, "offset_2": -1.0})
    assert plant.parameters[plant.model.names.index("f1_3")] == 7.5
    assert plant.parameters[plant.model.names.index("offset_2")] == -1.0
    with pytest.raises(InputError, match=r"unknown parameter f1_9; allowed: such as f1_\d"):
        nominal_plant(er3a, overrides={"f1_9": 1.0})


def test_impossible_plants_are_refused(er3a):
    """A negative spread, parameters that are unknown or of a wrong number are refused."""
    with pytest.raises(InputError, match=r"a spread of -0\.1"):
        nominal_plant(er3a, spread=-0.1)
    unknown = np.array(er3a.inertia)
    unknown[1] = np.nan
    with pytest.raises(InputError, match="joint 2: a virtual robot needs masses, which the description of er3a does"):
        nominal_plant(replace(er3a, inertia=unknown))
    with pytest.raises(InputError, match=r"\(3,\) plant parameters; allowed: \(96,\)"):
        Plant(model=default_model(er3a), parameters=np.ones(3))


def test_a_plant_keeps_its_own_parameters(er3a):
    """A plant's parameters are a copy that cannot be changed, and it pickles."""
    parameters = default_model(er3a).nominal.copy()
    plant = Plant(model=default_model(er3a), parameters=parameters)
    parameters[0] = -1.0
    assert plant.parameters[0] > 0
    with pytest.raises(ValueError, match="read-only"):
        plant.parameters[0] = 1.0
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(plant)).parameters, plant.parameters)


def test_effects_add_their_torque(er3a, motion):
    """What a plant has beyond its model adds to the torque: here a spring's, written out."""
    spring = plant_effect(er3a, "spring", 2, {"stiffness": 40.0, "stiffness_3": -8.0})
    plain, sprung = nominal_plant(er3a, sensors=IDEAL), nominal_plant(er3a, sensors=IDEAL, effects=(spring,))
    middle = (er3a.limits.lower[1] + er3a.limits.upper[1]) / 2
    x = motion.q[:, 1] - middle
    difference = simulate(sprung, motion).tau - simulate(plain, motion).tau
    # The difference of two torques of some 1000 N m.
    np.testing.assert_allclose(difference[:, 1], 40.0 * x - 8.0 * x**3, atol=1e-9)
    np.testing.assert_allclose(np.delete(difference, 1, axis=1), 0.0, atol=1e-9)


def test_a_plant_with_effects_can_be_pickled(er3a, motion):
    """A plant with effects plays the same in another process."""
    effect = plant_effect(er3a, "friction_step", 1, {"coulomb_step": 3.0, "change_time": 0.4})
    plant = nominal_plant(er3a, effects=(effect,))
    again = pickle.loads(pickle.dumps(plant))
    np.testing.assert_array_equal(simulate(again, motion, seed=3).tau, simulate(plant, motion, seed=3).tau)
