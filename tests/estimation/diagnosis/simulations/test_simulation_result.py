"""Tests of the closed-loop simulation of a diagnosis."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from estimation import load_model
from estimation.diagnosis import Diagnosis, diagnose
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.recordings.log_reading import build_recording
from estimation.diagnosis.simulations.forward_simulation import FittedRobot, simulate_both
from estimation.diagnosis.simulations.simulation_result import Simulation
from robots.base_parameters import find_base_parameters
from robots.plants import simulate
from robots.plants.closed_loop import Loop
from robots.plants.effects import plant_effect
from robots.regressor import default_model
from robots.robot import Robot
from robots.terms.effects import EFFECTS

pytestmark = pytest.mark.slow


def member(effect: str, joint: int | None, shape: tuple[float, ...], coefficients: list[float]) -> FittedEffect:
    """Builds an effect as a diagnosis would have found it."""
    return FittedEffect(Hypothesis(EFFECTS[effect], joint), shape, None, 0.0, np.array(coefficients), 1, 1.0)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def found(arm: Robot, arm_plant: Callable, fourier_motion: Callable) -> Diagnosis:
    """Returns the diagnosis of an arm with a spring on joint 2."""
    plant = arm_plant(torque_noise=0.01)
    spring = {"stiffness": 1.5, "stiffness_2": 1.0, "stiffness_3": -1.5}
    plant = replace(plant, effects=(plant_effect(arm, "spring", 2, spring),))
    logs = [simulate(plant, fourier_motion(arm, seed), seed=seed) for seed in (0, 1)]
    later = replace(logs[1], t=logs[1].t + 100.0)
    return diagnose(arm, logs[0], held_out=later, candidates=("spring", "stribeck"), friction="coulomb-viscous")


def test_the_simulated_robot_comes_nearer_with_what_was_found(found: Diagnosis) -> None:
    """On the joint with the spring, correction and position error fall by more than half."""
    assert found.verdict == "named"
    simulation = found.simulation
    assert simulation is not None
    assert simulation.torque[1][1] < 0.5 * simulation.torque[0][1]
    assert simulation.motion[1][1] < 0.5 * simulation.motion[0][1]
    assert (simulation.torque[1] < 1.1 * simulation.torque[0]).all()
    assert simulation.note == ""
    assert simulation.start >= 100.0
    assert simulation.end - simulation.start == pytest.approx(5.0, abs=0.1)
    assert "Forward simulation, joint 2: controller correction" in found.summary()


def test_what_grows_worse_is_reported_before_what_hardly_grows_better() -> None:
    """The summary describes the joint that changes most, for better or worse."""
    still = np.zeros(2)
    torque = (np.array([0.0231, 0.042]), np.array([0.0230, 0.051]))
    made = Simulation(start=0.0, end=5.0, loop=Loop(), torque=torque, motion=(still, still))
    assert "joint 2: controller correction 4.2 -> 5.1 % of torque" in made.summary(["rad", "rad"])
    assert made.summary(["rad", "rad"]).endswith(
        "position loop). The findings make the simulation of this joint worse."
    )
    better = replace(made, torque=made.torque[::-1], note="It did not settle.")
    assert better.summary(["rad", "rad"]).endswith("position loop). It did not settle.")


def test_it_is_written_and_read(found: Diagnosis, tmp_path: object) -> None:
    """`diagnosis.json` contains the simulation's numbers, and they are loaded again."""
    found.save(tmp_path)  # type: ignore[arg-type]
    again = Diagnosis.load(tmp_path).simulation  # type: ignore[arg-type]
    assert again is not None
    assert found.simulation is not None
    assert again.to_dict() == found.simulation.to_dict()
    assert again.curves is None
    assert load_model(tmp_path).extensions  # type: ignore[arg-type]


def test_where_nothing_is_found_nothing_is_simulated(arm: Robot, arm_plant: Callable, fourier_motion: Callable) -> None:
    """A diagnosis without findings has no simulation."""
    log = simulate(arm_plant(torque_noise=0.02), fourier_motion(arm, 0))
    result = diagnose(arm, log, candidates=("spring",), friction="coulomb-viscous")
    assert result.findings == ()
    assert result.simulation is None
    assert result.to_dict()["simulation"] is None


def planar(q: np.ndarray, v: np.ndarray, push: np.ndarray) -> np.ndarray:
    """Computes the arm's accelerations by Lagrange's equations of two links in a vertical plane."""
    length, m2, x2, y2 = 0.4, 2.0, 0.3, 0.1
    c2, s2 = np.cos(q[1]), np.sin(q[1])
    shared = 0.1 + length * (x2 * c2 - y2 * s2)
    M = np.array([[0.3 + m2 * length**2 + 2 * shared - 0.1 + 0.2, shared], [shared, 0.1 + 0.1]])
    bend = -length * (x2 * s2 + y2 * c2)
    outer = x2 * np.cos(q.sum()) - y2 * np.sin(q.sum())
    bias = np.array([bend * (2 * v[0] * v[1] + v[1] ** 2), -bend * v[0] ** 2])
    bias += 9.80665 * np.array([(0.8 + m2 * length) * np.cos(q[0]) + outer, outer])
    return np.linalg.solve(M, push - bias)


@pytest.mark.parametrize("stribeck", [False, True], ids=["base", "extended"])
def test_the_arm_moves_as_an_independent_solver_says(
    arm: Robot, arm_plant: Callable, fourier_motion: Callable, stribeck: bool
) -> None:
    """The simulated deviations agree with scipy's solution of Lagrange's equations to 3 % of their RMS.

    The sign of friction changes half a sample late, 2 ms. This moves joint 1 by up to 2 N m x 4 ms / (0.9 kg m2 x 19 /
    s) = 0.5 mrad/s / (19 / s), or 0.03 of its deviation of 1.1 mrad.
    """
    width, size, speed = 0.02, 1.5, 0.3
    motion = fourier_motion(arm, 3, duration=8.0)
    log = simulate(arm_plant(velocity_scale=width, torque_noise=0.0, encoder_counts=0.0), motion)
    t = np.asarray(motion.t)
    # An unexplained driving torque, smooth, so that both solvers see the same.
    torque = log.tau + 0.6 * np.sin(2 * np.pi * 0.7 * t)[:, None] * [1.0, -0.5]
    model = default_model(arm, friction="coulomb-viscous", velocity_scale=width)
    base = find_base_parameters(model)
    before = FittedRobot(model=model, columns=base.independent, values=base.from_standard(model.nominal))
    after = replace(before, members=(member("stribeck", 2, (speed, 2.0), [size]),), coefficients=(np.array([size]),))
    whole = replace(build_recording(arm, [log]), starts=(0,))
    rows = slice(0, len(whole))
    at = np.searchsorted(t, whole.t - 1e-9)
    whole = replace(whole, tau=torque[at], q=motion.q[at], dq=motion.dq[at], ddq=motion.ddq[at])
    loop = Loop(bandwidth=3.0)
    simulation = simulate_both(before, after, whole, rows, loop)
    assert simulation.note == ""
    # The loop's gains are for each joint's mean inertia, as in the simulation.
    c2, s2 = np.cos(whole.q[:, 1]), np.sin(whole.q[:, 1])
    inertia = np.array([0.3 + 0.32 + 0.1 + 0.8 * np.mean(0.3 * c2 - 0.1 * s2) + 0.2, 0.2])
    stiffness, damping = loop.gains(inertia)

    def rate(now: float, state: np.ndarray) -> np.ndarray:
        q, v = state[:2], state[2:]
        wanted = np.array([[np.interp(now, t, x[:, j]) for j in (0, 1)] for x in (torque, motion.q, motion.dq)])
        push = wanted[0] + stiffness * (wanted[1] - q) + damping * (wanted[2] - v)
        drag = np.array([2.0, 1.0]) + (size * np.exp(-((np.abs(v) / speed) ** 2)) * [0.0, 1.0] if stribeck else 0.0)
        return np.concatenate([v, planar(q, v, push - drag * np.tanh(v / width) - np.array([1.5, 0.8]) * v)])

    first = at[0]
    start = np.concatenate([motion.q[first] - 0.002 * motion.dq[first], motion.dq[first] - 0.002 * motion.ddq[first]])
    span = (t[first] - 0.002, whole.t[-1])
    exact = solve_ivp(rate, span, start, method="LSODA", t_eval=whole.t, rtol=1e-6, atol=1e-9, max_step=0.01).y[:2].T
    assert simulation.curves is not None
    deviation = exact - whole.q
    wrong = simulation.curves.deviation[int(stribeck)] - deviation
    assert (np.sqrt(np.mean(wrong**2, axis=0)) < 0.03 * np.sqrt(np.mean(deviation**2, axis=0))).all()


def test_what_is_read_wrong_does_not_drive_the_arm(arm: Robot, arm_plant: Callable, fourier_motion: Callable) -> None:
    """With a distorted torque reading, the extended model moves the arm like the true torque, with noise, too."""
    motion = fourier_motion(arm, 3, duration=8.0)
    log = simulate(arm_plant(velocity_scale=0.02, torque_noise=0.02, encoder_counts=0.0), motion)
    model = default_model(arm, friction="coulomb-viscous", velocity_scale=0.02)
    base = find_base_parameters(model)
    top, error = float(np.abs(log.tau[:, 0]).max()), 0.5
    read = log.tau + error * np.column_stack([log.tau[:, 0] * (log.tau[:, 0] / top) ** 2, 0.0 * log.tau[:, 1]])
    before = FittedRobot(model=model, columns=base.independent, values=base.from_standard(model.nominal))
    saturation = member("torque_constant_saturation", 1, (2.0, top), [error])
    after = replace(before, members=(saturation,), coefficients=(np.array([error]),))
    whole, distorted = (replace(build_recording(arm, [x]), starts=(0,)) for x in (log, replace(log, tau=read)))
    rows = slice(0, len(whole))
    plain, simulation = simulate_both(before, before, whole, rows), simulate_both(before, after, distorted, rows)
    assert plain is not None
    assert simulation is not None
    assert simulation.note == ""
    assert (simulation.motion[1] < 1.05 * plain.motion[1]).all()
    assert simulation.motion[0][0] > 3.0 * simulation.motion[1][0]


def test_the_file_says_what_is_assumed() -> None:
    """The simulation's data contain the assumed loop, and are read back unchanged."""
    pair = (np.array([0.02, 0.01]), np.array([0.01, np.nan]))
    simulation = Simulation(start=1.0, end=6.0, loop=Loop(bandwidth=4.0), torque=pair, motion=pair, note="as it is")
    data = simulation.to_dict()
    assert data["loop"] == {"bandwidth_hz": 4.0, "damping": 1.0}
    assert data["torque"]["after"] == [0.01, None]
    assert Simulation.from_dict(data).to_dict() == data
