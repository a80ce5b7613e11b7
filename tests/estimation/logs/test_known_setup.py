"""Specification of logs that state a payload or a gravity: parameters, predictions and refusals, against pinocchio."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from estimation import check_log, identify, load_model, predict
from estimation.estimators import RegressionData, WeightedLeastSquares
from estimation.exports import urdf_text
from estimation.identifications.fit import sum_moments
from estimation.regressions.joint_regressor import JointRegressor
from estimation.regressions.preparation import Rows
from estimation.thermal import fit_campaign
from robots.base_parameters import BaseParameters, find_base_parameters
from robots.common.errors import InputError
from robots.regressor import default_model
from robots.robot import Robot
from robots.signals import Log, Motion
from robots.terms.situations.flange_body import point_mass

LEVEL = np.array([0.0, 0.0, -9.81])
WALL = np.array([-9.81, 0.0, 0.0])
ANGLE = np.radians(15.0)
TILTED = 9.81 * np.array([0.0, -np.sin(ANGLE), -np.cos(ANGLE)])
MASS, CENTRE = 1.5, (0.02, -0.03, 0.1)
WIDTH = 1e-3  # [rad/s] of the sign
Torque = Callable[..., np.ndarray]
Build = Callable[..., Log]


def friction(robot: Robot, motion: Motion) -> np.ndarray:
    """Coulomb and viscous friction, and the rotors."""
    f = robot.friction
    return f[:, 0] * np.tanh(motion.dq / WIDTH) + f[:, 1] * motion.dq + robot.rotor_inertia * motion.ddq


@pytest.fixture(scope="module")
def build(upright: Robot, fourier_motion: Callable[..., Motion], pinocchio_torque: Torque) -> Build:
    """A log whose torque is pinocchio's; what is stated of it may be left out."""

    def make(seed: int, gravity: np.ndarray | None = None, mass: float = 0.0, noise: float = 0.01) -> Log:
        motion = fourier_motion(upright, seed)
        tau = friction(upright, motion) + pinocchio_torque(upright, motion, gravity, mass, CENTRE)
        tau = tau + noise * np.random.default_rng(seed).normal(size=tau.shape)
        payload = point_mass(mass, CENTRE) if mass else None
        return Log(t=motion.t + 100.0 * seed, q=motion.q, tau=tau, gravity=gravity, payload=payload)

    return make


def base_of(robot: Robot, *gravities: np.ndarray) -> BaseParameters:
    """Base parameters under the description's gravity and others."""
    model = default_model(robot, friction="coulomb-viscous", velocity_scale=WIDTH, offset=False)
    return find_base_parameters(model, gravities=gravities)


def test_a_tilted_base_shows_more_of_the_joint_on_a_vertical_axis(upright: Robot) -> None:
    """The waist's first moments about its axis, and nothing else, come with a tilt; other tilts show no more."""
    level, tilted = base_of(upright), base_of(upright, TILTED)
    assert set(tilted.names) - set(level.names) == {"mPx_1", "mPy_1"}
    assert set(level.names) < set(tilted.names)
    assert base_of(upright, TILTED, WALL).names == tilted.names
    assert base_of(upright, LEVEL).gravities == ()
    assert tilted.gravities == (tuple(TILTED),)


@pytest.mark.slow
def test_two_gravities_give_the_base_parameters_back_exactly(
    upright: Robot, fourier_motion: Callable[..., Motion], pinocchio_torque: Torque
) -> None:
    """Exact motions under two gravities: the streamed normal equations have the true parameters to 1e-9.

    One gravity alone leaves those of the waist open that only the other shows.
    """
    base = base_of(upright, TILTED)
    rows = []
    for seed, gravity in enumerate([None, TILTED]):
        motion = fourier_motion(upright, seed)
        tau = friction(upright, motion) + pinocchio_torque(upright, motion, gravity)
        rows.append(Rows(motion, tau, np.ones_like(tau), gravity))
    regressor = JointRegressor(base)
    moments = sum_moments(regressor, rows)
    truth = base.from_standard(base.model.nominal)
    # Ridge zero: columns are scaled, their condition number is some hundreds.
    values, weights = WeightedLeastSquares().solve(moments, 0.0)
    assert values == pytest.approx(truth, abs=1e-9 * np.abs(truth).max())
    data = RegressionData(base=base, moments=moments, parts=rows)
    for part in rows:
        found = np.concatenate([chunk.Y @ truth for chunk in data.chunks_of(part)])
        assert found == pytest.approx(part.tau, abs=1e-9 * np.abs(part.tau).max())
    level = sum_moments(regressor, rows[:1])
    open_ = [i for i, name in enumerate(base.names) if name in ("mPx_1", "mPy_1")]
    assert np.all(np.einsum("jii->i", level.gram)[open_] < 1e-20 * np.einsum("jii->i", moments.gram)[open_])
    assert weights.shape == (3,)


@pytest.fixture(scope="module")
def two(upright: Robot, build: Build) -> tuple[tuple[Log, Log], object]:
    """A level and a tilted log, the second with a payload, and what is identified of both."""
    logs = (build(0), build(1, TILTED, MASS))
    return logs, identify(upright, logs, friction="coulomb-viscous", offset=False)


@pytest.mark.slow
def test_identify_counts_gravity_and_payload_of_logs(upright: Robot, build: Build, two: tuple) -> None:
    """The parameters are the arm's own and two more than without the tilt; all within five standard errors."""
    _, estimate = two
    model = estimate.model
    base = base_of(upright, TILTED)
    assert model.columns == base.independent
    assert model.gravities == (tuple(TILTED),)
    truth = base.from_standard(base.model.nominal)
    first = [i for i, name in enumerate(model.names) if name in ("mPx_1", "mPy_1")]
    assert model.determined[first].all()
    errors = np.abs(model.values - truth)[model.determined]
    # Five: 19 parameters, and 1 % beside for what smoothing leaves of the reversals.
    assert np.all(errors < 5 * model.standard_errors[model.determined] + 0.01 * np.abs(truth[model.determined]))
    assert all(joint.residual_rms < 0.05 for joint in estimate.joints)
    alone = identify(upright, build(0), friction="coulomb-viscous", offset=False)
    assert len(alone.model.values) == len(model.values) - 2
    unstated = replace(build(1, TILTED, MASS), gravity=None, payload=None)
    with pytest.raises(InputError, match=r"mounted otherwise .*--gravity K="):
        identify(upright, unstated, friction="coulomb-viscous")
    blind = identify(upright, [build(0), unstated], friction="coulomb-viscous", check=False)
    assert max(joint.residual_rms for joint in blind.joints) > 1.0


@pytest.mark.slow
def test_a_saved_model_predicts_under_every_gravity_it_knows(
    upright: Robot, build: Build, two: tuple, pinocchio_torque: Torque, tmp_path: Path
) -> None:
    """Level, tilted, on a wall, with and without payload: within 1 % of pinocchio's torque RMS; the URDF too."""
    _, estimate = two
    estimate.save(tmp_path)
    model = load_model(tmp_path)
    for seed, (gravity, mass) in enumerate([(None, 0.0), (TILTED, 0.0), (TILTED, MASS), (WALL, MASS)], start=2):
        log = build(seed, gravity, mass, noise=0.0)
        found = predict(model, log)
        assert np.all(found.nrmse < 0.01), (gravity, mass)
        assert found.band is not None
    assert "waist" in urdf_text(model, upright)


@pytest.mark.slow
def test_a_model_of_a_level_base_does_not_guess_what_a_tilt_shows(upright: Robot, build: Build, two: tuple) -> None:
    """Its parameters lack the waist's first moments: an error that names them; other payloads are no trouble."""
    level = identify(upright, build(0), friction="coulomb-viscous", offset=False).model
    with pytest.raises(InputError, match=r"mPx_1, mPy_1.*identify the model again with"):
        predict(level, build(1, TILTED))
    assert np.all(predict(level, build(1, None, MASS)).nrmse < 0.02)
    same = replace(build(1), gravity=LEVEL)
    assert predict(level, same).predicted == pytest.approx(predict(level, build(1)).predicted)


@pytest.mark.slow
def test_the_gate_knows_how_the_robot_was_set_up(upright: Robot, build: Build) -> None:
    """A log on a wall with a payload is in order once both are stated; spikes in it are left out all the same."""
    log = build(3, WALL, MASS)
    assert not check_log(upright, log).refused
    tau = np.array(log.tau)
    tau[2000, 1] += 1e4
    report = check_log(upright, replace(log, tau=tau))
    (usable,) = report.usable(replace(log, tau=tau))
    assert len(usable) == len(log) - 1
    assert usable.gravity == pytest.approx(WALL)


@pytest.mark.parametrize("stated", ["gravity", "payload"])
@pytest.mark.parametrize(
    "use",
    [
        lambda robot, model, log: identify(robot, log, method="iv"),
        lambda robot, model, log: identify(robot, [log], method="didim"),
        lambda robot, model, log: fit_campaign(robot, log),
    ],
    ids=["iv", "didim", "heat"],
)
def test_what_does_not_know_a_payload_or_a_gravity_refuses_it(
    upright: Robot, build: Build, two: tuple, use: Callable, stated: str
) -> None:
    """One error that names the column, before any work."""
    log = build(0)
    changed = replace(log, **{stated: TILTED if stated == "gravity" else point_mass(MASS, CENTRE)})
    with pytest.raises(InputError, match=f"states a {stated}, which .* cannot use") as caught:
        use(upright, two[1].model, changed)
    assert caught.value.column == stated
