"""All kinds of measurements and errors: derivatives, predictions by an independent arm, and starts."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.calibration_parts import oracle
from robots import Limits, Robot, load_robot
from robots.common.errors import InputError
from robots.geometry.chain import Chain, Joint
from robots.geometry_errors import (
    TERMS,
    BodyPoses,
    CameraBoard,
    Distances,
    GeometryModel,
    HeldPart,
    Inclinometer,
    Markers,
    MeasuredPoses,
    Planes,
    Points,
    random_positions,
    simulate_poses,
)
from robots.geometry_errors.measurements.setup import moved_setup
from robots.geometry_errors.poses import approaches

MEASUREMENTS = (
    Markers(count=2),
    BodyPoses(),
    Distances(count=2, offset=True),
    Planes(count=2),
    Points(count=2),
    CameraBoard(rows=2, across=3),
    CameraBoard(rows=2, across=3, on_flange=False),
    CameraBoard(rows=2, across=3, distortion=(-0.2, 0.05, 1e-3, -2e-3, 0.01), fit="distortion"),
    Inclinometer(),
)
POSES = 12


@pytest.fixture(scope="module")
def robot():
    return load_robot("panda")


def model_of(robot, measurement, rng):
    """A model with all kinds of errors at random poses, and a setup that is not at rest."""
    q = random_positions(robot, POSES, seed=3)
    observed = rng.standard_normal((POSES, len(measurement.columns)))
    if measurement.kind in ("planes", "points"):
        observed[:, 0] = 1 + np.arange(POSES) % 2
    poses = MeasuredPoses(
        q=q,
        measurement=measurement,
        observed=observed,
        temperature=20.0 + rng.uniform(0.0, 10.0, POSES),
        velocity=rng.standard_normal(q.shape),
        session=np.arange(POSES) // 6,
        approach=approaches(q),
    )
    model = GeometryModel([robot], TERMS, poses)
    values = np.array([item.scale * rng.standard_normal() for item in model.errors])
    start = measurement.example if measurement.kind not in ("planes", "points") else model.start()
    return model, values, moved_setup(start, 0.05 * rng.standard_normal(sum(part.size for part in start.values())))


@pytest.mark.parametrize(
    "measurement", MEASUREMENTS, ids=lambda m: f"{m.kind}-{getattr(m, 'on_flange', '')}-{getattr(m, 'fit', '')}"
)
def test_derivatives_are_those_of_the_prediction(robot, measurement):
    """The Jacobian of every kind of error and of the setup is the derivative of the prediction, by differences."""
    model, values, setup = model_of(robot, measurement, np.random.default_rng(0))
    found = model.evaluate(values, setup)
    assert np.isfinite(found.residual).any()
    errors = len(values)
    for k, item in enumerate(model.parameters(setup)):
        step = 1e-2 * item.scale if k < errors else 1e-5
        move = np.zeros(len(model.parameters(setup)))
        move[k] = step
        ahead = model.residual(values + move[:errors], moved_setup(setup, move[errors:]))
        behind = model.residual(values - move[:errors], moved_setup(setup, -move[errors:]))
        difference = (behind - ahead) / (2.0 * step)
        seen = np.isfinite(difference) & (np.abs(difference) < 1e6)
        scale = max(np.abs(difference[seen]).max(initial=0.0), 1e-3)
        # Central differences of steps of a hundredth of the usual size err by 1e-5 of the derivative at most; pixels of
        # corners near the edge of the view bend more.
        tolerance = 2e-3 if measurement.kind == "camera" else 2e-4
        assert np.abs((difference - found.jacobian[:, :, k])[seen]).max() < tolerance * scale, item.name


@pytest.mark.parametrize("name", ["ur10", "er3a"])
def test_markers_are_where_an_independent_arm_has_them(name):
    """Zeros, eccentricity, gears, compliance and backlash move markers as an arm in plain numpy says."""
    robot, rng = load_robot(name), np.random.default_rng(1)
    arm = oracle.Arm.of(robot)
    q = random_positions(robot, 20, seed=1)
    truth = oracle.usual_errors(arm, rng)
    truth.shift[:], truth.turn[:] = 0.0, 0.0
    truth.ratio, truth.gap, truth.approach = 1e-3 * rng.standard_normal(6), 1e-3 * np.ones(6), approaches(q)
    names = {"zero": "zero", "sine": "sine", "cosine": "cosine", "ratio": "ratio", "gap": "gap"}
    errors = {f"{ours}_{i + 1}": getattr(truth, own)[i] for own, ours in names.items() for i in range(6)}
    errors |= {f"joint_compliance_{i + 1}": truth.compliance[i] for i in range(6)}
    measurement = Markers(count=3)
    points = np.array([measurement.example[f"marker_{k + 1}"].value for k in range(3)])
    expected = oracle.markers(oracle.flange(arm, q, truth), np.eye(4), points)
    found = simulate_poses(robot, q, measurement, errors).observed
    # The oracle differentiates the energy with steps of 1e-5: its torque is right to 1e-6 of 100 N m.
    np.testing.assert_allclose(found, expected, atol=1e-8)


def test_link_placements_are_those_of_an_independent_arm():
    """Small shifts and turns of all links move markers as an arm in plain numpy says, to second order."""
    robot, rng = load_robot("ur10"), np.random.default_rng(2)
    arm = oracle.Arm.of(robot)
    q = random_positions(robot, 20, seed=1)
    truth = oracle.Errors.none(6)
    truth.shift, truth.turn = 1e-5 * rng.standard_normal((6, 3)), 1e-5 * rng.standard_normal((6, 3))
    errors = {f"link_{i + 1}_{axis}": truth.shift[i, k] for i in range(6) for k, axis in enumerate("xyz")}
    errors |= {f"link_{i + 1}_r{axis}": truth.turn[i, k] for i in range(6) for k, axis in enumerate("xyz")}
    measurement = Markers()
    point = measurement.example["marker_1"].value[None]
    expected = oracle.markers(oracle.flange(arm, q, truth), np.eye(4), point)
    # A shift before a turn of 1e-5 rad and after it differ by 1e-10 m.
    np.testing.assert_allclose(simulate_poses(robot, q, measurement, errors).observed, expected, atol=2e-9)


@pytest.mark.parametrize("measurement", [Markers(count=2), BodyPoses(), CameraBoard(on_flange=False), Inclinometer()])
def test_the_start_finds_the_setup_of_exact_poses(measurement):
    """From poses without errors the first guess of tracker, tool or camera predicts them without any iteration."""
    robot, rng = load_robot("er3a"), np.random.default_rng(4)
    setup = dict(measurement.example)
    if measurement.kind in ("markers", "poses"):
        setup = moved_setup(setup, 0.5 * rng.standard_normal(sum(part.size for part in setup.values())))
    q = random_positions(robot, 60, seed=2)
    if measurement.kind == "camera":
        # A camera two metres above looks down at the arm.
        pose = np.eye(4)
        pose[:3, :3] = Rotation.from_euler("x", np.pi).as_matrix()
        pose[:3, 3] = (-0.3, 0.0, 2.0)
        setup["camera"] = type(setup["camera"])(kind="pose", value=pose)
        setup["board"] = type(setup["board"])(kind="pose", value=np.eye(4))
    poses = simulate_poses(robot, q, measurement, {}, setup=setup)
    model = GeometryModel([robot], (), poses)
    residual = model.residual(np.zeros(0), model.start())
    # Registration alternates to 1e-9 m; angles and pixels follow.
    limits = {"m": 1e-6, "rad": 1e-6, "px": 1e-3}
    for k, unit in enumerate(measurement.units):
        assert np.nanmax(np.abs(residual[:, k])) < limits[unit]


def test_both_arms_that_hold_a_part_agree():
    """For a part that two arms hold, the start finds the part and the second base of exact poses."""
    # Three slides and three turns about z, y and x reach any pose in closed form.
    axes = [np.eye(3)[k] for k in (0, 1, 2, 2, 1, 0)]
    kinds = ["prismatic"] * 3 + ["revolute"] * 3
    joints = tuple(
        Joint(f"g{k}", kind, np.eye(3), np.zeros(3), axis)
        for k, (kind, axis) in enumerate(zip(kinds, axes, strict=True))
    )
    ones = {name: np.ones(6) for name in ("velocity", "acceleration", "jerk", "torque")}
    wide = Limits(lower=np.full(6, -9.0), upper=np.full(6, 9.0), **ones)
    first, second = Robot(name="gantry", chain=Chain(joints), limits=wide), load_robot("er3a")
    base, part = np.eye(4), np.eye(4)
    base[:3, :3], base[:3, 3] = Rotation.from_rotvec([0.3, -0.5, 1.0]).as_matrix(), (1.0, 0.2, 0.1)
    part[:3, :3], part[:3, 3] = Rotation.from_rotvec([0.1, 0.4, -0.2]).as_matrix(), (0.3, 0.0, 0.1)
    q2 = random_positions(second, 25, seed=1)
    wanted = base @ second.chain.flange(q2) @ np.linalg.inv(part)
    q1 = np.hstack([wanted[:, :3, 3], Rotation.from_matrix(wanted[:, :3, :3]).as_euler("ZYX")])
    poses = MeasuredPoses(q=q1, second=q2, measurement=HeldPart(), observed=np.zeros((25, 0)))
    model = GeometryModel([first, second], (), poses)
    setup = model.start()
    np.testing.assert_allclose(setup["second_base"].value, base, atol=1e-9)
    np.testing.assert_allclose(setup["part"].value, part, atol=1e-9)
    # The gap's derivatives by both arms and the setup are those by differences.
    full = GeometryModel([first, second], TERMS[:2], poses)
    moved = moved_setup(setup, 0.02 * np.random.default_rng(3).standard_normal(12))
    values = np.array([item.scale for item in full.errors])
    found = full.evaluate(values, moved)
    for k in range(len(full.parameters(moved))):
        move = np.zeros(len(full.parameters(moved)))
        move[k] = 1e-6
        own, setup_step = move[: len(values)], move[len(values) :]
        ahead, behind = (
            full.residual(values + own, moved_setup(moved, setup_step)),
            full.residual(values - own, moved_setup(moved, -setup_step)),
        )
        # Differences of steps of 1e-6 are right to 1e-9.
        np.testing.assert_allclose((behind - ahead) / 2e-6, found.jacobian[:, :, k], atol=1e-7)


def test_unknown_errors_are_refused(robot):
    """An error that the robot has not is refused by its name."""
    with pytest.raises(InputError, match="zero_9"):
        simulate_poses(robot, np.zeros((8, 7)), Markers(), {"zero_9": 1e-3})
