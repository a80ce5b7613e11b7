"""Designs for a payload, and designs of a robot that carries one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from oed.experiments import Design, LimitOptions, ModelOptions, SearchOptions, TrajectoryOptions
from oed.experiments import design as run
from robots.catalog import __path__ as catalog
from robots.common.errors import InputError
from robots.geometry.inertia import inertial_parameters
from robots.limits import BOUNDS, Limits
from robots.loading import load_robot
from robots.regressor import default_model
from robots.robot import Robot
from robots.terms.situations.flange_body import FLANGE, carrying, payload_part, point_mass
from tests.oed.experiments.conftest import TINY

BODY = inertial_parameters(4.0, [0.05, -0.02, 0.1], np.diag([0.02, 0.03, 0.01]), np.eye(4))


@pytest.fixture(scope="module")
def ur10() -> Robot:
    """An arm whose flange is turned and moved from its last link."""
    return load_robot("ur10")


def test_a_carried_body_adds_the_torque_that_pinocchio_gives_it(ur10: Robot) -> None:
    """At random states the rigid-body torque is that of the URDF with the body fixed to tool0."""
    model = pin.buildModelFromUrdf(f"{next(iter(catalog))}/ur10.urdf")
    place = model.frames[model.getFrameId("tool0")].placement
    body = pin.Inertia(4.0, np.array([0.05, -0.02, 0.1]), np.diag([0.02, 0.03, 0.01]))
    model.inertias[6] += place.act(body)
    data = model.createData()
    q, dq, ddq = np.random.default_rng(0).uniform(-2, 2, (3, 10, 6))
    expected = np.array([pin.rnea(model, data, *state) for state in zip(q, dq, ddq, strict=True)])
    frictionless = replace(ur10, friction=np.zeros((6, 4)), rotor_inertia=np.zeros(6))
    loaded = default_model(carrying(frictionless, BODY), velocity_scale=1e-3)
    np.testing.assert_allclose(loaded.torque(q, dq, ddq, loaded.nominal), expected, atol=1e-9)
    assert carrying(ur10, BODY) is carrying(ur10, BODY)
    assert carrying(ur10, None) is ur10


def test_a_robot_without_a_known_flange_carries_nothing(ur10: Robot) -> None:
    """An older model file does not say where the flange is: an error that says what to do."""
    with pytest.raises(InputError, match=r"does not state the pose of the flange.*identify the model again"):
        carrying(replace(ur10, assumed=(FLANGE,)), BODY)


def test_the_payloads_columns_are_those_of_the_last_link(ur10: Robot) -> None:
    """All ten where the wrist has three axes."""
    names = payload_part(default_model(ur10, velocity_scale=0.02)).names
    assert list(names) == [f"{name}_6" for name in ("m", "mPx", "mPy", "mPz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")]


def test_an_arm_of_parallel_axes_shows_part_of_a_payload(horizontal_arm: Robot) -> None:
    """Two parallel joints: what is left are first moments in the plane, a mass by the first arm, and one inertia."""
    model = default_model(horizontal_arm, velocity_scale=0.02)
    part = payload_part(model)
    Y = model.regressor(*np.random.default_rng(0).normal(size=(3, 50, 2)), columns=range(10, 20)).reshape(-1, 10)
    assert part.size == np.linalg.matrix_rank(Y, tol=1e-8)
    assert part.size < 10


@pytest.fixture
def horizontal_arm(ur10: Robot) -> Robot:
    """Two joints of the ur10 that turn about parallel axes."""
    from robots.geometry.chain import Chain

    chain = Chain((ur10.chain.joints[1], ur10.chain.joints[2]), gravity=ur10.chain.gravity)
    limits = Limits(**{name: getattr(ur10.limits, name)[1:3] for name in BOUNDS})
    return replace(
        ur10,
        name="arm",
        chain=chain,
        limits=limits,
        inertia=ur10.inertia[1:3],
        rotor_inertia=None,
        friction=None,
        gear_ratio=None,
        torque_constant=None,
        motor_speed=None,
    )


@pytest.mark.slow
def test_a_payload_design_tells_more_of_the_payload_than_one_for_the_arm(ur10: Robot, tmp_path) -> None:
    """By log det of the information on ten parameters, at equal duration and effort; the file reads back."""
    search = SearchOptions(effort=TINY, workers=1)
    plan = TrajectoryOptions(periods=1, strokes=False)
    own = run(
        ur10,
        criterion="d",
        model=ModelOptions(payload_only=True),
        trajectory=plan,
        limits=LimitOptions(payload=BODY),
        search=search,
    )
    arm = run(ur10, criterion="cond", trajectory=plan, limits=LimitOptions(payload=BODY), search=search)
    columns = own.base.independent

    def worth(design: Design) -> float:
        motion = design.part("fourier")
        Y = own.base.model.regressor(motion.q, motion.dq, motion.ddq, columns=columns).reshape(-1, len(columns))
        return float(np.linalg.slogdet(Y.T @ Y / len(motion))[1])

    assert worth(own) > worth(arm)
    # The payload's torque counts within the limits, on the samples of the file.
    motion = own.motion
    loaded = default_model(carrying(ur10, BODY), velocity_scale=0.02)
    tau = loaded.torque(motion.q, motion.dq, motion.ddq, loaded.nominal)
    assert (np.abs(tau) <= np.asarray(ur10.limits.torque)).all()
    largest = {m.joint: abs(m.value) for m in own.margins if m.quantity == "torque"}
    assert largest[2] == pytest.approx(np.abs(tau[:, 1]).max(), rel=1e-9)
    own.save(tmp_path)
    again = Design.load(tmp_path, ur10)
    assert again.base.names == own.base.names
    np.testing.assert_allclose(again.robot.inertia, own.robot.inertia)


def test_a_payload_that_is_none_is_refused() -> None:
    """Another number of values, or a negative mass."""
    for body in (np.ones(4), -point_mass(1.0, (0, 0, 0.1))):
        with pytest.raises(InputError, match="payload"):
            LimitOptions(payload=body)
