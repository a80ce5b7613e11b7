"""What a diagnosis found beyond a robot's description counts within the torque limits of the next design."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from oed.constraints import TorqueLimit, TorqueRms
from oed.experiments import Design, Effort, InteriorPoint
from robots.catalog import __path__ as catalog
from robots.common.errors import InputError
from robots.loading import load_robot
from robots.plants import Plant, PlantEffect
from robots.regressor import default_model
from robots.robot import Robot
from robots.signals import Motion
from tests.oed import flat

WIDTH = 0.02
SPRING = PlantEffect(effect="spring", joint=2, coefficients=(40.0, 15.0, -8.0, 0.0), shape=(0.0, 0.0, 3.0))
STRIBECK = PlantEffect(effect="stribeck", joint=2, coefficients=(12.0,), shape=(0.2, 2.0))
LOADED = PlantEffect(effect="load_dependent_friction", joint=3, coefficients=(0.1, 0.05), shape=(1.0, 0.0))
BORNE = PlantEffect(effect="load_dependent_friction", joint=2, coefficients=(0.1, 0.05), shape=(1.0, 0.0))
HEAT = PlantEffect(effect="thermal_friction", joint=1, coefficients=(5.0, 1.0), shape=(100.0, 0.0, 0.0))


@pytest.fixture(scope="module")
def robot() -> Robot:
    """A UR10 with limits of torque."""
    known = load_robot("ur10")
    return replace(known, limits=replace(known.limits, torque=np.array([400.0, 400.0, 200.0, 80.0, 80.0, 80.0])))


def by_hand(
    robot: Robot, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray, breaks: float = 12.0, shares: tuple = (0.0, 0.0)
) -> np.ndarray:
    """The torque of description, spring and frictions (N, n), by pinocchio and their formulas."""
    model = pin.buildModelFromUrdf(f"{next(iter(catalog))}/ur10.urdf")
    data = model.createData()
    tau = np.array([pin.rnea(model, data, *state) for state in zip(q, dq, ddq, strict=True)])
    middle = (robot.limits.lower[1] + robot.limits.upper[1]) / 2
    x, v = q[:, 1] - middle, dq[:, 1]
    tau[:, 1] += 40.0 * x + 15.0 * x**2 - 8.0 * x**3
    tau[:, 1] += np.abs(tau[:, 1]) * (shares[0] * np.tanh(v / WIDTH) + shares[1] * v)
    tau[:, 1] += breaks * np.exp(-((v / 0.2) ** 2)) * np.tanh(v / WIDTH)
    f = np.asarray(robot.friction)
    tau += f[:, 0] * np.tanh(dq / WIDTH) + f[:, 1] * dq + f[:, 2] * dq * np.abs(dq) + f[:, 3] * dq**3
    return tau + np.asarray(robot.rotor_inertia) * ddq


@pytest.mark.slow
def test_the_limit_counts_effects_with_their_derivatives(robot: Robot) -> None:
    """Values are those of pinocchio and of the formulas; the Jacobian is that of central differences."""
    rng = np.random.default_rng(0)
    q, dq, ddq = rng.uniform(-1, 1, (3, 20, 6)) * np.array([1.5, 1.0, 2.0])[:, None, None]
    model = default_model(robot, velocity_scale=WIDTH)
    limit = TorqueLimit(model, model.nominal, robot.limits.torque, margin=0.2, effects=(SPRING, STRIBECK))
    expected = by_hand(robot, q, dq, ddq) / (0.8 * robot.limits.torque)
    # The effect's own thousandth in its exponent, see `Stribeck`.
    np.testing.assert_allclose(limit.values(q, dq, ddq), expected, atol=1e-4)
    loaded = TorqueLimit(model, model.nominal, robot.limits.torque, effects=(SPRING, STRIBECK, LOADED))
    J, step = loaded.jacobian(q, dq, ddq), 1e-6
    for k in range(18):
        move = np.zeros((3, 1, 6))
        move[k // 6, 0, k % 6] = step
        up, down = (loaded.values(*(np.stack([q, dq, ddq]) + sign * move)) for sign in (1, -1))
        np.testing.assert_allclose(J[:, :, k], (up - down) / (2 * step), atol=2e-5 * np.abs(J).max())
    again = pickle.loads(pickle.dumps(loaded))
    np.testing.assert_array_equal(again.values(q, dq, ddq), loaded.values(q, dq, ddq))
    rms = TorqueRms(model, model.nominal, robot.limits.torque, effects=(SPRING,))
    plain = TorqueLimit(model, model.nominal, robot.limits.torque, effects=(SPRING,)).values(q, dq, ddq)
    np.testing.assert_allclose(rms.values(q, dq, ddq), np.sqrt(np.mean(plain**2, axis=0)))


def test_a_gear_bears_the_spring_behind_it(robot: Robot) -> None:
    """Friction that is a share of the load is one of weight, inertia and spring, in the limit and in the plant."""
    rng = np.random.default_rng(1)
    q, dq, ddq = rng.uniform(-1, 1, (3, 20, 6)) * np.array([1.5, 1.0, 2.0])[:, None, None]
    model = default_model(robot, velocity_scale=WIDTH)
    expected = by_hand(robot, q, dq, ddq, breaks=0.0, shares=(0.1, 0.05))
    assert np.abs(expected - by_hand(robot, q, dq, ddq, breaks=0.0)).max() > 5.0
    limit = TorqueLimit(model, model.nominal, robot.limits.torque, margin=0.0, effects=(BORNE, SPRING))
    np.testing.assert_allclose(limit.values(q, dq, ddq) * robot.limits.torque, expected, atol=1e-2)
    plant = Plant(model=model, parameters=model.nominal, effects=(BORNE, SPRING))
    motion = Motion(0.01 * np.arange(20.0), q, dq, ddq)
    np.testing.assert_allclose(plant.torque(motion), expected, atol=1e-2)


def test_an_effect_of_the_past_is_refused(robot: Robot) -> None:
    """A limit that is watched instant by instant cannot count heat."""
    model = default_model(robot, velocity_scale=WIDTH)
    with pytest.raises(InputError, match="depends on the motion's history"):
        TorqueLimit(model, model.nominal, robot.limits.torque, effects=(HEAT,))


def made(robot: Robot, **options: object) -> Design:
    """A brief design."""
    return flat.design(
        robot,
        harmonics=3,
        periods=1,
        strokes=False,
        workers=1,
        home=np.array([0.0, -1.2, 0.8, 0.0, 0.0, 0.0]),
        effort=Effort(islands=1, starts=1, screened=20, hops=0, finish_samples=60),
        solver=InteriorPoint(max_iter=40, finish_iter=15),
        **options,
    )


@pytest.fixture(scope="module")
def tight(robot: Robot) -> Robot:
    """The robot with a shoulder that its own weight almost takes up."""
    return replace(robot, limits=replace(robot.limits, torque=np.array([np.inf, 170.0, np.inf, *[np.inf] * 3])))


@pytest.mark.slow
def test_the_motion_keeps_the_limit_with_the_spring(tight: Robot, tmp_path) -> None:
    """Designed with the spring, the motion keeps the limit by pinocchio and the formula; without, it does not.

    What counts is said, and what cannot be; a saved design says the same.
    """
    effects = (SPRING, STRIBECK, HEAT)
    unaware = made(tight)
    passed = by_hand(tight, unaware.motion.q, unaware.motion.dq, unaware.motion.ddq)[:, 1]
    assert np.abs(passed).max() > 170.0
    aware = made(tight, effects=effects)
    kept = by_hand(tight, aware.motion.q, aware.motion.dq, aware.motion.ddq)[:, 1]
    assert np.abs(kept).max() <= 170.0
    stated = next(margin for margin in aware.margins if margin.quantity == "torque" and margin.joint == 2)
    # The effect's own thousandth in its exponent, see `Stribeck`.
    assert abs(stated.value) == pytest.approx(np.abs(kept).max(), rel=1e-3)
    assert "included in the torque limits: spring of joint 2, stribeck of joint 2" in aware.summary()
    assert "NOT included in the torque limits, because they depend on time or history: thermal" in aware.summary()
    aware.save(tmp_path)
    again = Design.load(tmp_path, tight)
    assert again.effects == effects
    assert [m.value for m in again.check()] == pytest.approx([m.value for m in aware.margins], rel=1e-6)


@pytest.mark.slow
def test_without_limits_nothing_is_claimed_to_count(make_robot) -> None:
    """A robot without torque limits or dynamics: the summary says that the spring could not be counted."""
    spring = PlantEffect(effect="spring", joint=1, coefficients=(1.0, 0.0, 0.0, 0.0), shape=(0.0, 0.0, 3.0))
    result = made_plain(make_robot("RR", "plain"), spring)
    assert "NOT included in the torque limits, because torque limits or dynamics are not described" in result.summary()


def made_plain(robot: Robot, effect: PlantEffect) -> Design:
    """A brief design of a robot that has no more than kinematics."""
    return flat.design(
        robot,
        friction="coulomb-viscous",
        harmonics=3,
        periods=1,
        strokes=False,
        workers=1,
        effects=(effect,),
        effort=Effort(islands=1, starts=1, screened=10, hops=0, finish_samples=60),
        solver=InteriorPoint(max_iter=15, finish_iter=5),
    )
