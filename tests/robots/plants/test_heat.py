"""A virtual robot that warms up: its friction falls as an independent integration says."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from robots.common.errors import InputError
from robots.loading import load_robot
from robots.plants import Plant, Sensors, load_plant, nominal_plant, simulate
from robots.plants.heat import heat_piece, plant_heat, reference_friction
from robots.robot import Robot
from robots.signals import Motion

JOINT = {"model": "second", "alpha": -0.012, "K1": 1.0, "K2": 1.2, "C1": 90.0, "C2": 700.0}


@pytest.fixture(scope="module")
def er3a() -> Robot:
    """A robot with published thermal models."""
    return load_robot("er3a")


def swing(robot: Robot, minutes: float) -> Motion:
    """All joints swing at 0.2 Hz, with 1 rad/s at most."""
    t = np.arange(0.0, 60.0 * minutes, 0.02)
    w = 2 * np.pi * 0.2
    one = np.ones((1, robot.n))
    return Motion(t, np.sin(w * t)[:, None] / w * one, np.cos(w * t)[:, None] * one, -w * np.sin(w * t)[:, None] * one)


def plant_of(robot: Robot, **options: object) -> Plant:
    """The described robot without noise, with the heat that the options ask for."""
    still = Sensors(torque_noise=0.0, encoder_counts=0.0)
    return replace(nominal_plant(robot, sensors=still), heat=plant_heat(robot, **options))  # type: ignore[arg-type]


@pytest.mark.slow
def test_friction_falls_as_an_independent_integration_says(er3a: Robot) -> None:
    """Torque lost to heat in five minutes equals that of the two balances integrated by scipy, within 0.1 %."""
    plant, motion = plant_of(er3a, joints={2: JOINT}), swing(er3a, 5.0)
    cold = reference_friction(plant.model, plant.parameters, motion)[:, 1]
    power = cold * motion.dq[:, 1]

    def balance(t: float, T: np.ndarray) -> list[float]:
        W = float(np.interp(t, motion.t, power))
        through = T[0] - T[1]
        return [(W * (1.0 - 0.012 * (T[0] - 20.0)) - through) / 90.0, (through - 1.2 * (T[1] - 20.0)) / 700.0]

    T = solve_ivp(balance, (0.0, motion.t[-1]), [20.0, 20.0], t_eval=motion.t, max_step=0.1, rtol=1e-8).y[0]
    lost = (plant.torque(motion) - replace(plant, heat=None).torque(motion))[:, 1]
    truth = -0.012 * (T - 20.0) * cold
    # Power is averaged over a second, in which it changes the temperature by some hundredths of a degree.
    assert np.sqrt(np.mean((lost - truth) ** 2)) < 2e-3 * np.sqrt(np.mean(truth**2))
    assert truth[-100:].min() < -0.1


def test_joints_without_a_model_stay_as_they_are(er3a: Robot) -> None:
    """Only the joint that has a thermal model changes."""
    plant, motion = plant_of(er3a, joints={2: JOINT}), swing(er3a, 1.0)
    lost = plant.torque(motion) - replace(plant, heat=None).torque(motion)
    assert not np.any(np.delete(lost, 1, axis=1))


def test_a_rest_cools_down(er3a: Robot) -> None:
    """Between two motions the joint cools: after a day it is as cold as at first, after a second as warm as it was."""
    plant, motion = plant_of(er3a, known=True), swing(er3a, 2.0)
    assert plant.heat is not None
    piece = heat_piece(motion, reference_friction(plant.model, plant.parameters, motion))
    end = float(motion.t[-1])
    for rest, share in ((86400.0, 0.0), (1.0, 1.0)):
        warmth = plant.heat.follow([piece, piece.shifted(end + rest)])
        rise = warmth.at(np.array([end, end + rest]))[:, 3] - 20.0
        assert rise[1] == pytest.approx(share * rise[0], abs=0.02 * rise[0])
    with pytest.raises(InputError, match="before the last one ends"):
        plant.heat.follow([piece, piece])


def test_power_keeps_its_energy_and_pauses_have_none(er3a: Robot) -> None:
    """Averages over a second hold the motion's energy; a minute without samples adds nothing."""
    motion = swing(er3a, 0.5)
    friction = np.sign(motion.dq) * 3.0
    later = Motion(
        np.concatenate([motion.t, motion.t + 90.0]), *(np.tile(x, (2, 1)) for x in (motion.q, motion.dq, motion.ddq))
    )
    energy = np.trapezoid(3.0 * np.abs(motion.dq[:, 0]), motion.t)
    for moves, count in ((motion, 1.0), (later, 2.0)):
        piece = heat_piece(moves, np.tile(friction, (int(count), 1)))
        assert piece.power[:, 0] @ np.diff(piece.edges) == pytest.approx(count * energy, rel=1e-9)


def test_thermometers_are_logged_where_the_plant_has_them(er3a: Robot) -> None:
    """The log holds no temperature, that of the surroundings, or also those of the joints."""
    motion = swing(er3a, 0.2)
    for kind, around, joints in (("none", False, False), ("ambient", True, False), ("all", True, True)):
        log = simulate(plant_of(er3a, known=True, start=35.0, ambient=25.0, thermometers=kind), motion)
        assert (log.ambient is not None, log.temperature is not None) == (around, joints)
    assert log.ambient is not None
    assert log.temperature is not None
    assert log.ambient[0] == 25.0
    assert log.temperature[0].tolist() == [35.0] * 6


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("thermal: {}", "no joint has a model"),
        ("thermal: {joints: {9: {alpha: -0.01}}}", "joint 9"),
        ("thermal: {joints: {1: {model: third}}}", "unknown thermal model"),
        ("thermal: {joints: {1: {alpha: -0.01}}}", "K1"),
        ("thermal: {joints: {1: {alpha: 0.01, K1: 1, K2: 1, C1: 1, C2: 1}}}", "alpha"),
        ("thermal: {known: true, ambient: 293.15}", "ambient is 293.15"),
        ("thermal: {known: true, thermometer: all}", "unknown key 'thermometer'"),
        (
            "thermal: {known: true}\neffects: [{effect: thermal_friction, joint: 1, parameters: {f: 1}}]",
            "thermal_friction",
        ),
    ],
)
def test_a_wrong_section_is_reported(er3a: Robot, tmp_path: Path, text: str, message: str) -> None:
    """Unknown joints, models and parameters, values out of range and heat reported twice are refused with the file."""
    path = tmp_path / "plant.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        load_plant(path, er3a)
    assert caught.value.file is not None


def test_a_plant_file_states_heat(er3a: Robot, tmp_path: Path) -> None:
    """Published models, one joint's own before them, another temperature at the start."""
    path = tmp_path / "plant.yaml"
    path.write_text(
        "thermal:\n  known: true\n  start: 30\n  joints:\n    2: {model: first, alpha: -0.02, K: 2, C: 900}\n"
    )
    heat = load_plant(path, er3a).heat
    assert heat is not None
    assert [model.name if model else None for model in heat.models] == ["second", "first", *["second"] * 4]
    assert heat.start == 30.0


def test_a_robot_without_published_models_is_reported(tmp_path: Path) -> None:
    """known: true needs a robot for which something is published."""
    path = tmp_path / "plant.yaml"
    path.write_text("thermal: {known: true}")
    with pytest.raises(InputError, match="no thermal models of ur10"):
        load_plant(path, load_robot("ur10"))
