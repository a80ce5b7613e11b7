"""Measured logs of real robots. Torque is predicted as it was logged; low-passed errors are stated beside it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from estimation import identify, predict, read_log
from robots.common.errors import OedError
from robots.loading import load_robot
from tests.kr300 import kr300


def halves(log):
    middle = len(log) // 2
    return log.rows(slice(0, middle)), log.rows(slice(middle, None))


def filtered_spread(prediction, cutoff):
    """Standard deviation of the low-passed error over that of the torque, per joint."""
    period = float(np.median(np.diff(prediction.motion.t)))
    sections = butter(3, 2 * period * cutoff, output="sos")
    error = sosfiltfilt(sections, prediction.measured - prediction.predicted, axis=0)
    return error.std(axis=0) / prediction.measured.std(axis=0)


@pytest.mark.slow
def test_ur10_half_to_half(data):
    """The first half of a UR10's log predicts the second to .16 .05 .05 .14 .12 .32 of its torque's deviation."""
    log = read_log(data("ur10_unisa") / "exciting.parquet")
    known, unseen = halves(log)
    estimate = identify(load_robot("ur10"), known)
    spread = predict(estimate.model, unseen).relative_spread
    # Better on average, and on no joint worse by more than a tenth. Measured: .069 .043 .044 .052 .094 .328.
    table = np.array([0.16, 0.05, 0.05, 0.14, 0.12, 0.32])
    assert spread.mean() < 0.8 * table.mean(), spread
    assert (spread <= 1.1 * table).all(), spread
    assert all(joint.identified for joint in estimate.joints)
    # Filtered by its authors, the log has coloured residuals, and more parameters than it can show.
    assert estimate.colour > 2
    assert not estimate.model.determined.all()


@pytest.mark.slow
def test_lwr4_run_to_run(data):
    """Run 1 of a KUKA LWR4+ predicts run 2 to .24 .01 .08 .02 .30 .68 .44 of its torque's deviation."""
    folder = data("kuka_lwr4_flobaroid")
    estimate = identify(load_robot(folder / "kuka_lwr4.urdf"), read_log(folder / "run1.parquet"))
    spread = predict(estimate.model, read_log(folder / "run2.parquet")).relative_spread
    # Required to two digits. Measured: .244 .010 .082 .019 .285 .683 .400.
    assert (spread <= [0.245, 0.015, 0.085, 0.025, 0.315, 0.685, 0.445]).all(), spread


@pytest.mark.slow
def test_tiago_is_reported_to_be_badly_excited(data):
    """A badly excited log is not fitted in silence: its last arm joints are named, and their parameters marked."""
    folder = data("tiago_figaroh")
    names = ["torso_lift_joint", *(f"arm_{number}_joint" for number in range(1, 8))]
    robot = load_robot(folder / "tiago_48_schunk.urdf", joints=names)
    estimate = identify(robot, read_log(folder / "run1.parquet"))
    lost = {joint.name for joint in estimate.joints if not joint.identified}
    assert lost == {"arm_5_joint", "arm_6_joint", "arm_7_joint"}
    assert not estimate.success
    assert "Not identified" in estimate.warnings[0]
    assert all(name in estimate.warnings[0] for name in lost)
    own = [
        known
        for column, known in zip(estimate.model.parameters, estimate.model.determined, strict=True)
        if column.joint >= 6 and column.term not in ("rigid_body", "position_torque")
    ]
    assert len(own) == 18
    assert not any(own)
    written = [item["standard_error"] for item in estimate.model.to_dict()["parameters"] if item["joint"] == 8]
    assert sum(error is None for error in written) > len(written) / 2


@pytest.mark.slow
def test_panda_with_uneven_time(data):
    """A Panda's log of uneven time, with repeated messages, is fitted as well as today."""
    log = read_log(data("panda_gaz2019") / "traj1_first10s.parquet")
    estimate = identify(load_robot("panda"), log)
    prediction = predict(estimate.model, log)
    # A fit with hand-picked filters, which are not known, reached .065 .016 .015 .033 .070 .032 .183 from half to half
    # of 21 s. This is the fit itself, of 10 s: no like-for-like comparison, but a guard of what is reached now.
    # Measured .054 .007 .012 .019 .080 .036 .154, with a fifth to spare.
    assert (filtered_spread(prediction, 6.5) <= [0.065, 0.01, 0.015, 0.024, 0.096, 0.044, 0.185]).all()
    # Unfiltered torque carries the sensors' noise besides: measured .142 .024 .029 .064 .129 .116 .207.
    assert (prediction.relative_spread <= [0.17, 0.03, 0.036, 0.077, 0.156, 0.14, 0.25]).all()
    assert 400 < estimate.dropped_rows < 700


@pytest.mark.slow
def test_double_pendulum_runs(data):
    """Four runs of the double pendulum are fitted, friction and all, and predict one that was not."""
    folder = data("double_pendulum_dfki")
    robot = load_robot(folder / "dp_design_A.0_model_2.1_pendubot.urdf")
    train = [read_log(folder / f"A0_0{number}.parquet") for number in range(4)]
    estimate = identify(robot, train)
    assert all(joint.identified for joint in estimate.joints)
    fitted = np.array([joint.residual_rms / joint.torque_spread for joint in estimate.joints])
    # Simple fits leave .4 to .9 and .2 to .4. Measured .32 .23, with a fifth to spare.
    assert (fitted <= [0.39, 0.28]).all(), fitted
    # One unseen run: measured .63 .36. Not all runs are alike: on 5 of the 14 others joint 1 is worse than a constant.
    unseen = predict(estimate.model, read_log(folder / "A0_05.parquet")).relative_spread
    assert (unseen <= [0.76, 0.43]).all(), unseen


@pytest.mark.slow
@pytest.mark.parametrize(("run", "table"), [("ddp", 0.19), ("dircol", 0.22)])
def test_simple_pendulum_swing_ups(data, run, table):
    """The swing-ups of the simple pendulum are fitted; what is left is mostly above 4 Hz."""
    folder = data("simple_pendulum_dfki")
    log = read_log(folder / f"{run}.parquet")
    estimate = identify(load_robot(folder / "simple_pendulum.urdf", unlimited=True), log)
    prediction = predict(estimate.model, log)
    # Measured .06 and .07 below 4 Hz; .28 and .26 as logged, where hand-picked filters left .19 and .22.
    assert filtered_spread(prediction, 4.0)[0] < table / 2
    assert prediction.relative_spread[0] < 0.34


@pytest.mark.slow
def test_simple_pendulum_that_rings_is_refused(data):
    """The run that saturates and rings is refused with the reason; who insists gets the truth, with wide errors.

    The source states a mass of .6755 kg at .5 m, which makes the first moment .338 kg m.
    """
    folder = data("simple_pendulum_dfki")
    robot, log = load_robot(folder / "simple_pendulum.urdf", unlimited=True), read_log(folder / "sysid.parquet")
    with pytest.raises(OedError, match="badly excited"):
        identify(robot, log)
    table = identify(robot, log, check=False).to_frame()
    value, error = table.loc["mPy_1", ["value", "standard_error"]]
    assert abs(value - 0.338) < 1.96 * error
    assert error > 0.05


@pytest.mark.slow
def test_kr300_from_motor_torques(data, tmp_path):
    """A heavy arm from a DH table: motor torques times gear ratios are fitted to .25 .32 .46 .38 .19 .20.

    That is without a prior, which costs joint 1 some per cent and brings other joints as much.
    """
    robot, log = kr300(data("kuka_kr300_weigand"), tmp_path / "kr300.yaml")
    estimate = identify(robot, replace(log, qlink=None))
    spread = (estimate.measured - estimate.predicted).std(axis=0) / estimate.measured.std(axis=0)
    # Of three runs, of which one is here; joint 2 carries a counterbalance that the model lacks. Other readings of the
    # angle offsets fit within these figures too: this guards the fit, not the geometry.
    plain = np.array([0.25, 0.32, 0.46, 0.38, 0.19, 0.20])
    assert (spread <= 1.1 * plain).all(), spread
    assert spread.mean() <= plain.mean()
