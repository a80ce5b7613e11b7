"""The verb `calibrate`: what it finds of an independent arm, and what it says of its own doubts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.calibration_parts import oracle
from estimation import calibrate, load_calibration
from estimation.calibrations import CalibrationOptions
from estimation.calibrations.selection import select_kinds
from robots.common.errors import InputError, NotIdentifiableError
from robots.geometry_errors import (
    CameraBoard,
    Distances,
    Inclinometer,
    Markers,
    error_term,
    random_positions,
    simulate_poses,
)
from tests.estimation.calibrations.conftest import NOISE, measured

FIXED = CalibrationOptions(kinds=("joint_zero", "link_placement"), diagnose=False)


@pytest.mark.slow
def test_held_out_poses_are_predicted_to_the_noise(calibration):
    """An arm with zeros, links, eccentricity and compliance is predicted to the noise, by the kinds that it has."""
    # Three numbers a marker: the distance is root three times the noise; forty poses leave an error of estimation of a
    # sixth of the noise.
    assert calibration.levels.held_out < 1.25 * np.sqrt(3.0) * NOISE
    assert calibration.check is not None
    assert calibration.check.held_out < 1.25 * np.sqrt(3.0) * NOISE
    assert calibration.levels.before > 50.0 * calibration.levels.held_out
    assert set(calibration.kinds) >= {"joint_zero", "link_placement", "eccentricity"}
    assert not {"gear_ratio", "backlash", "time_offset", "thermal_growth"} & set(calibration.kinds)
    assert calibration.success


@pytest.mark.slow
def test_the_corrected_robot_is_the_true_one(ur10, truth, calibration):
    """The corrected chain moves the tool as the true arm without its pose-dependent errors, but for base and tool."""
    rigid = oracle.Errors.none(6)
    rigid.zero, rigid.shift, rigid.turn = truth.zero, truth.shift, truth.turn
    q = random_positions(ur10, 50, seed=9)
    true = oracle.flange(oracle.Arm.of(ur10), q, rigid)[:, :3, 3]
    own = calibration.corrected.chain.flange(q)
    nominal = ur10.chain.flange(q)

    def misfit(poses):
        # Base and tool are free: points of the tool and of the tracker are registered.
        from robots.geometry_errors.measurements.base import registration

        tracker, tool = registration(poses, true)
        found = poses[:, :3, :3] @ tool + poses[:, :3, 3]
        return np.sqrt(np.mean(np.sum((found @ tracker[:3, :3].T + tracker[:3, 3] - true) ** 2, axis=1)))

    # Eccentricity that the poses cannot tell from zeros stays in them: some tens of micrometres.
    assert misfit(own) < 0.1 * misfit(nominal)


@pytest.mark.slow
def test_errors_lie_within_their_intervals(ur10):
    """Zeros of joints between others are within 95 % intervals of the truth, and redundant ones are named."""
    errors = oracle.Errors.none(6)
    errors.zero[[1, 2, 4]] = (0.004, -0.003, 0.005)
    options = CalibrationOptions(kinds=("joint_zero",), diagnose=False)
    found = calibrate(ur10, measured(ur10, 30, errors, seed=3), options=options)
    values = {item.name: item for item in found.errors}
    for name, true in (("zero_2", 0.004), ("zero_3", -0.003), ("zero_5", 0.005)):
        item = values[name]
        # Four standard errors: one test in 5,000 fails wrongly.
        assert abs(item.value - true) < 4.0 * item.standard_error
        assert item.standard_error < 1e-4
    redundant = {item.name: item for item in found.undetermined}
    assert redundant["zero_1"].reason == "redundant"
    assert "tracker_rz" in redundant["zero_1"].partners
    assert "zero_1" not in values
    assert found.joint_zeros[ur10.joint_names[0]] == 0.0


@pytest.mark.slow
def test_a_joint_that_never_moved_is_named_with_the_motion_that_is_lacking(ur10):
    """Without motion of joint 5 its neighbours' errors stay open, and the sentence says which joint to move."""
    errors = oracle.Errors.none(6)
    poses = measured(ur10, 40, errors, seed=4)
    q = poses.q.copy()
    q[:, 4] = 0.7
    poses = replace(
        poses,
        q=q,
        observed=oracle.markers(
            oracle.flange(oracle.Arm.of(ur10), q, errors), *oracle.usual_setup(np.random.default_rng(0))
        )
        + NOISE * np.random.default_rng(1).standard_normal(poses.observed.shape),
    )
    found = calibrate(ur10, poses, options=FIXED)
    open_ = [item for item in found.undetermined if item.reason == "poses"]
    assert open_
    assert any(5 in item.joints for item in open_)
    kept = {item.name for item in found.errors}
    assert not kept & {item.name for item in open_ if item.name not in kept}


@pytest.mark.slow
def test_outliers_are_named_and_change_nothing(ur10):
    """A pose off by 2 mm and one by 0.5 mm are named; the result is that without them."""
    errors = oracle.Errors.none(6)
    errors.zero[1] = 0.004
    clean = measured(ur10, 40, errors, seed=5)
    observed = clean.observed.copy()
    observed[7, :3] += (0.002, 0.0, 0.0)
    observed[20, 3:] += 0.0005
    found = calibrate(ur10, replace(clean, observed=observed), options=FIXED)
    assert {item.pose for item in found.outliers} == {8, 21}
    rows = np.ones(40, dtype=bool)
    rows[[7, 20]] = False
    other = calibrate(ur10, clean.part(rows), options=FIXED)
    ours, theirs = ({item.name: item for item in result.errors} for result in (found, other))
    for name, item in theirs.items():
        assert abs(ours[name].value - item.value) < 0.2 * item.standard_error


@pytest.mark.slow
def test_clean_poses_have_no_outliers(ur10):
    """Of a set without faults no pose is named; one in 1,000 such sets would have one."""
    found = calibrate(ur10, measured(ur10, 40, oracle.Errors.none(6), seed=11), options=FIXED)
    assert found.outliers == ()


@pytest.mark.slow
@pytest.mark.parametrize("measurement", [Distances(count=3), Inclinometer()], ids=lambda m: m.kind)
def test_other_instruments_determine_zeros(ur10, measurement):
    """Distances and inclinations determine the zeros that they can show."""
    q = random_positions(ur10, 50, seed=6)
    noise = {"m": 5e-5, "rad": 5e-5}
    poses = simulate_poses(ur10, q, measurement, {"zero_2": 0.004, "zero_5": -0.003}, noise=noise, seed=1)
    options = CalibrationOptions(kinds=("joint_zero",), diagnose=False)
    values = {item.name: item for item in calibrate(ur10, poses, options=options).errors}
    for name, true in (("zero_2", 0.004), ("zero_5", -0.003)):
        assert abs(values[name].value - true) < 4.0 * values[name].standard_error + 1e-5


@pytest.mark.slow
def test_time_offset_and_thermal_growth_are_found(ur10):
    """A clock that is off by 5 ms while the arm moves, and a link that grows, are estimated."""
    q, rng = random_positions(ur10, 60, seed=7), np.random.default_rng(2)
    from robots.geometry_errors import Markers

    poses = simulate_poses(
        ur10,
        q,
        Markers(count=3),
        {"time_offset": 0.005, "expansion_3": 2e-5},
        noise={"m": NOISE},
        temperature=20.0 + rng.uniform(0.0, 20.0, 60),
        velocity=rng.uniform(-0.5, 0.5, (60, 6)),
        seed=1,
    )
    options = CalibrationOptions(kinds=("thermal_growth", "time_offset"), diagnose=False)
    values = {item.name: item for item in calibrate(ur10, poses, options=options).errors}
    for name, true in (("time_offset", 0.005), ("expansion_3", 2e-5)):
        assert abs(values[name].value - true) < 4.0 * values[name].standard_error


@pytest.mark.slow
def test_results_are_saved_and_read_back(calibration, tmp_path):
    """A saved calibration reads back as it was, and refuses to be overwritten."""
    calibration.save(tmp_path)
    assert load_calibration(tmp_path).to_dict() == calibration.to_dict()
    with pytest.raises(InputError, match="exists"):
        calibration.save(tmp_path)
    assert "mm" in calibration.summary()
    assert len(calibration.to_frame()) == len(calibration.parameters)
    assert calibration.plot().get_ylabel() == "error [mm]"


def test_files_that_are_no_calibrations_are_refused(tmp_path):
    """A file of something else, and a damaged one, are refused by name."""
    other = tmp_path / "calibration.json"
    other.write_text("{}")
    with pytest.raises(InputError, match="not a calibration file"):
        load_calibration(other)
    other.write_text('{"format": "robot-oed calibration", "format_version": 1}')
    with pytest.raises(InputError, match="is missing"):
        load_calibration(other)


def test_what_cannot_be_done_is_said(ur10):
    """Too few poses, a kind without its data and another number of joints are refused with what is needed."""
    errors = oracle.Errors.none(6)
    few = measured(ur10, 4, errors)
    with pytest.raises(NotIdentifiableError, match="at least 6"):
        calibrate(ur10, few)
    poses = measured(ur10, 20, errors)
    with pytest.raises(InputError, match="a column temp"):
        calibrate(ur10, poses, options=CalibrationOptions(kinds=("thermal_growth",)))
    with pytest.raises(InputError, match="unknown geometric error"):
        CalibrationOptions(kinds=("friction",))
    with pytest.raises(InputError, match="joints"):
        calibrate(ur10, replace(poses, q=poses.q[:, :5]))


def test_kinds_that_only_help_together_are_found(ur10):
    """A gear ratio whose error a zero takes up in the middle of a narrow range: neither alone explains anything."""
    q = random_positions(ur10, 60, seed=4)
    middle = 1.5
    q[:, 2] = middle + 0.1 * np.random.default_rng(4).uniform(-1.0, 1.0, 60)
    errors = {"ratio_3": 0.02, "zero_3": -0.02 * middle}
    poses = simulate_poses(ur10, q, Markers(count=2), errors, noise={"m": 5e-5}, seed=1)
    terms = (error_term("joint_zero"), error_term("gear_ratio"))
    chosen, trials = select_kinds([ur10], terms, poses)
    assert [term.kind for term in chosen] == ["joint_zero", "gear_ratio"]
    # Both belong to one trial; only the noise of 0.05 mm in six numbers remains.
    assert trials[0].with_it == trials[1].with_it < 1.3 * 5e-5 * np.sqrt(3.0)


@pytest.mark.slow
def test_a_camera_is_calibrated_with_the_robot(ur10):
    """Focal lengths, centre and lens of a camera on the flange are found with the zeros, from images of one board."""
    lens = (-0.2, 0.06, 1e-3, -5e-4, 0.01)
    true = CameraBoard(intrinsics=(1010.0, 1005.0, 650.0, 470.0), distortion=lens)
    board = np.eye(4)
    board[:3, :3], board[:3, 3] = Rotation.from_euler("x", np.pi).as_matrix(), (0.55, 0.1, 0.05)
    setup = {**true.example, "board": replace(true.example["board"], value=board)}
    q, rng = [], np.random.default_rng(2)
    while len(q) < 40:
        drawn = random_positions(ur10, 4000, seed=int(rng.integers(1 << 30)))
        seen = np.isfinite(simulate_poses(ur10, drawn, true, {}, setup=setup).observed).all(axis=1)
        q += list(drawn[seen])
    poses = simulate_poses(ur10, np.array(q[:40]), true, {"zero_3": 0.004}, setup=setup, noise={"px": 0.2}, seed=3)
    fitted = CameraBoard(intrinsics=(1000.0, 1000.0, 640.0, 480.0), fit="distortion")
    options = CalibrationOptions(kinds=("joint_zero",), diagnose=False)
    found = {p.name: p for p in calibrate(ur10, replace(poses, measurement=fitted), options=options).parameters}
    wanted = dict(zip(("fx", "fy", "cx", "cy"), true.intrinsics, strict=True))
    for name, value in [("zero_3", 0.004), *((f"camera_px_{k}", v) for k, v in wanted.items()), ("lens_k1", lens[0])]:
        item = found[name]
        # Four standard errors of a Gaussian: one in 16,000.
        assert abs(item.value - value) < 4.0 * item.standard_error, name
    assert found["camera_px_fx"].standard_error < 2.0
