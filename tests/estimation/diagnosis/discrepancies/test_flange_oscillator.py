"""Tests of a swinging load at the flange, against pinocchio's kinematics and scipy's integration of its motion."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp

from estimation.models.extension import find_effect
from robots import load_robot
from robots.regressor import default_model
from robots.robot import Robot
from robots.terms.discrepancies.flange_oscillator import FlangeOscillator
from robots.terms.effect_bases.parameters import DAMPING_RATIO
from robots.terms.effects import Situation, situation
from robots.terms.situations.joining import join_situations
from tests.estimation.diagnosis.pinocchio_chains import chain_of

PERIOD = 0.004
RATES = np.array([0.9, 1.1, 1.3, 1.7, 2.1, 2.6])  # [rad/s]
SIZES = np.array([0.6, 0.4, 0.5, 0.7, 0.8, 0.9])  # [rad]
MIDDLE = np.array([0.3, -1.2, 1.4, -0.6, -1.2, 0.4])


def _motion(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Computes q0 + a sin^3(w t) and its derivatives (N, 6); velocity and acceleration are zero at t = 0."""
    s, c = np.sin(np.outer(t, RATES)), np.cos(np.outer(t, RATES))
    speed = 3 * SIZES * RATES * s**2 * c
    return MIDDLE + SIZES * s**3, speed, 3 * SIZES * RATES**2 * (2 * s * c**2 - s**3)


@dataclass(frozen=True)
class Flange:
    """A robot's flange in an independent pinocchio model."""

    model: pin.Model
    data: pin.Data
    frame: int

    def acceleration(self, t: float) -> np.ndarray:
        """Computes the acceleration (3,) in the base frame during the motion."""
        pin.forwardKinematics(self.model, self.data, *(values[0] for values in _motion(np.array([t]))))
        aligned = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        return pin.getFrameClassicalAcceleration(self.model, self.data, self.frame, aligned).linear

    def torque(self, q: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Computes J' f (N, n) for forces (N, 3) on the flange."""
        aligned = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        jacobians = (pin.computeFrameJacobian(self.model, self.data, row, self.frame, aligned)[:3] for row in q)
        return np.array([J.T @ f for J, f in zip(jacobians, force, strict=True)])


@pytest.fixture(scope="module")
def robot() -> Robot:
    """Returns a robot of six joints with a flange that is offset from the last link's frame."""
    found = load_robot("ur10")
    tip = np.eye(4)
    tip[:3, 3] = 0.03, -0.02, 0.12
    return replace(found, chain=replace(found.chain, tip=tip))


@pytest.fixture(scope="module")
def flange(robot: Robot) -> Flange:
    """Returns the robot's flange in pinocchio."""
    model, parent = chain_of(robot)
    tip = pin.SE3(np.asarray(robot.chain.tip)[:3, :3], np.asarray(robot.chain.tip)[:3, 3])
    frame = model.addFrame(pin.Frame("flange", parent, tip, pin.FrameType.OP_FRAME))
    return Flange(model, model.createData(), frame)


def _state(robot: Robot, t: np.ndarray, starts: tuple[int, ...] = (0,)) -> Situation:
    model = default_model(robot)
    return situation(model, np.zeros(model.size), t, *_motion(t), starts=starts)


@pytest.fixture(scope="module")
def state(robot: Robot) -> Situation:
    """Returns twelve seconds of motion at 250 Hz."""
    return _state(robot, PERIOD * np.arange(3000))


def _swung(flange: Flange, t: np.ndarray, frequency: float, damping: float) -> tuple[np.ndarray, np.ndarray]:
    """Computes w^2 x and w x' (N, 3) of x'' + 2 d w x' + w^2 x = -p'', integrated accurately from rest."""
    w = 2 * np.pi * frequency

    def slope(time: float, y: np.ndarray) -> np.ndarray:
        return np.concatenate([y[3:], -flange.acceleration(time) - 2 * damping * w * y[3:] - w**2 * y[:3]])

    path = solve_ivp(slope, (t[0], t[-1]), np.zeros(6), "DOP853", t, rtol=1e-8, atol=1e-10)
    return w**2 * path.y[:3].T, w * path.y[3:].T


def _forces(robot: Robot, flange: Flange, state: Situation, X: np.ndarray) -> np.ndarray:
    """Computes the forces on the flange (N, 3, k) that cause the columns (N, n, k), and checks that they exist."""
    aligned = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    forces = np.empty((len(X), 3, X.shape[2]))
    for row, (q, torque) in enumerate(zip(state.q, X, strict=True)):
        J = pin.computeFrameJacobian(flange.model, flange.data, q, flange.frame, aligned)[:3]
        forces[row] = np.linalg.lstsq(J.T, torque, rcond=None)[0]
        assert J.T @ forces[row] == pytest.approx(torque, abs=1e-9)
    return forces


@pytest.mark.slow
@pytest.mark.parametrize("frequency", [0.6, 1.5, 3.0])
def test_columns_are_the_torque_against_masses_on_springs(
    flange: Flange, robot: Robot, state: Situation, frequency: float
) -> None:
    """All four columns are -J' f of an independently integrated oscillator, to 1 %.

    At 250 Hz the bilinear rule shifts a frequency of 3 Hz by 0.05 %, a hundredth of the resonance's half width.
    """
    X = FlangeOscillator().columns(state, None, (frequency,))
    upright = np.array([0.0, 0.0, 1.0])
    for late, force in enumerate(_swung(flange, state.t, frequency, DAMPING_RATIO)):
        for k, direction in ((late, 1 - upright), (2 + late, upright)):
            expected = -flange.torque(state.q, force * direction)
            error = np.sqrt(np.mean((X[:, :, k] - expected) ** 2, axis=0))
            assert np.all(error < 0.01 * np.sqrt(np.mean(expected**2)))


@pytest.mark.slow
@pytest.mark.parametrize("factor", [0.5, 1.0, 2.0])
def test_a_tank_of_other_damping_is_a_mixture_of_both_phases(
    flange: Flange, robot: Robot, state: Situation, factor: float
) -> None:
    """Both columns fit an oscillator of 2 kg with another damping; with the assumed damping, they give m and 2 d m.

    With half or twice the damping the fitted mass differs, because it follows the height of the resonance. Less than a
    tenth of the energy remains.
    """
    mass, damping = 2.0, factor * DAMPING_RATIO
    X = FlangeOscillator().columns(state, None, (1.5,))[:, :, :2].reshape(-1, 2)
    place, rate = _swung(flange, state.t, 1.5, damping)
    torque = -flange.torque(state.q, mass * (place + 2 * damping * rate) * [1.0, 1.0, 0.0]).reshape(-1)
    found, (energy,), *_ = np.linalg.lstsq(X, torque, rcond=None)
    if factor == 1.0:
        assert found == pytest.approx([mass, 2 * damping * mass], abs=0.01 * mass)
    assert energy < 0.1 * np.sum(torque**2)


def test_a_stiff_spring_carries_a_payload_without_weight(flange: Flange, robot: Robot, state: Situation) -> None:
    """Far above the motion's frequencies the mass follows the flange, and the torque is J' m p''.

    The motion has at most 1.3 Hz, so at 12 Hz the oscillation is (1.3 / 12)^2, about a hundredth.
    """
    X = FlangeOscillator().columns(state, None, (12.0,))
    carried = flange.torque(state.q, np.array([flange.acceleration(t) for t in state.t]))
    error = X[:, :, 0] + X[:, :, 2] - carried
    assert np.sqrt(np.mean(error[250:] ** 2)) < 0.02 * np.sqrt(np.mean(carried**2))


@pytest.mark.parametrize("gravity", [(0.0, 0.0, -9.81), (0.0, -6.0, -7.5), (0.0, 0.0, 0.0)])
def test_level_is_across_gravity_and_upright_along_it(
    flange: Flange, robot: Robot, gravity: tuple[float, float, float]
) -> None:
    """Horizontal columns have no force along gravity, vertical ones none across it; without gravity, z is vertical."""
    turned = replace(robot, chain=replace(robot.chain, gravity=np.array(gravity)))
    state = _state(turned, PERIOD * np.arange(400))
    forces = _forces(robot, flange, state, FlangeOscillator().columns(state, None, (1.5,)))
    up = np.array(gravity) / np.linalg.norm(gravity) if any(gravity) else np.array([0.0, 0.0, 1.0])
    along = np.einsum("i,tik->tk", up, forces)
    across = forces - up[:, None] * along[:, None, :]
    size = np.abs(forces).max()
    assert np.abs(along[:, :2]).max() < 1e-8 * size
    assert np.abs(across[:, :, 2:]).max() < 1e-8 * size
    assert np.abs(along[:, 2:]).max() > 0.1 * size


@pytest.mark.slow
def test_each_log_begins_at_rest_under_its_own_gravity(robot: Robot) -> None:
    """The oscillator starts each log at rest, and the vertical direction is that of the log's own gravity."""
    t = PERIOD * np.arange(500)
    one, wedge = _state(robot, t), replace(robot, chain=replace(robot.chain, gravity=np.array([0.0, -6.0, -7.5])))
    two = _state(wedge, t + 100.0)
    X = FlangeOscillator().columns(join_situations([one, two]), None, (1.5,))
    for run, alone in ((slice(0, 500), one), (slice(500, 1000), two)):
        assert X[run] == pytest.approx(FlangeOscillator().columns(alone, None, (1.5,)), abs=1e-9)
    both = FlangeOscillator().columns(_state(robot, np.concatenate([t, t + 100.0]), (0, 500)), None, (1.5,))
    later = FlangeOscillator().columns(_state(robot, t + 100.0), None, (1.5,))
    assert both[500:] == pytest.approx(later, abs=1e-9)


def test_it_is_reported_in_words_and_read_from_its_name(robot: Robot, state: Situation) -> None:
    """The effect is found by its name, has four masses and a frequency within bounds, and describes both."""
    effect = find_effect("pattern:swinging:0:even")
    assert isinstance(effect, FlangeOscillator)
    assert effect.joints(robot) == (None,)
    assert [(c.name, c.unit) for c in effect.parameters(robot, None)] == [
        ("mass_level", "kg"),
        ("late_mass_level", "kg"),
        ("mass_upright", "kg"),
        ("late_mass_upright", "kg"),
    ]
    (low, high) = effect.bounds(state, None)[0]
    assert all(low < frequency < high for (frequency,) in effect.grid(state, None))
    text = effect.describe(None, np.array([0.2, -1.24, 0.0, 0.1]), (1.537,))
    assert "1.54 Hz" in text
    assert "1.2 kg" in text
