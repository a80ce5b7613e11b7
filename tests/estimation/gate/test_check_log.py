"""Specification of findings on logs with one known fault, and on logs without."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from estimation.gate import check_log
from robots.common.errors import InputError
from robots.geometry.chain import Chain, Joint
from robots.limits import Limits
from robots.loading import load_robot
from robots.plants import Sensors, nominal_plant, simulate
from robots.robot import Robot
from robots.signals import Log
from tests.estimation.gate.findings_of import found, joints


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.longer) for seed in (2, 3))])
@pytest.mark.parametrize("options", [{}, {"period": 0.02}, {"torque_noise": 0.15}, {"encoder_counts": 1024.0}])
def test_good_log_has_no_findings(er3a, good, seed, options):
    """A log without a fault has no findings, at 250 or 50 Hz, with noise, with coarse encoders."""
    report = check_log(er3a, good(seed + 10, **options))
    assert report.findings == ()
    assert report.success
    assert (report.unexplained < 0.3).all()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ur10", "panda"])
def test_good_logs_of_other_robots_have_no_findings(name, fourier_motion):
    """Robots without friction or gear ratios in their description pass as well."""
    robot = load_robot(name)
    log = simulate(nominal_plant(robot, sensors=Sensors()), fourier_motion(robot, 2), seed=2)
    assert check_log(robot, log).findings == ()


@pytest.mark.slow
def test_degrees_as_radians_are_refused(good, spoilt):
    """Positions in degrees leave the ranges, and the unit is named."""
    report = spoilt(q=np.rad2deg(good().q))
    assert report.refused
    assert "degrees" in found(report, "unit_of_position")[0].text


@pytest.mark.slow
def test_motor_side_positions_are_refused(er3a, good, spoilt):
    """Positions of the motors leave the ranges; divided by the gear ratios they do not."""
    report = spoilt(q=good().q * er3a.gear_ratio)
    assert report.findings[0].name == "motor_side_position"
    with pytest.raises(InputError, match="of the motors, not the links") as caught:
        report.raise_if_refused()
    assert "mapping" in caught.value.remedy


@pytest.mark.slow
def test_small_motion_in_degrees_is_found_by_its_velocities(good, spoilt):
    """Positions in degrees that stay inside the ranges disagree with velocities in radians."""
    log = good()
    dq = np.gradient(log.q, log.t, axis=0) / 50
    report = spoilt(q=np.rad2deg(log.q) / 50, dq=dq)
    assert report.findings[0].name == "unit_of_position"
    assert report.findings[0].value == pytest.approx(np.pi / 180, rel=0.02)


def test_milliseconds_are_refused(good, spoilt):
    """A step of 4 s on a robot with a controller of 4 ms is one of milliseconds."""
    report = spoilt(t=1e3 * good().t)
    assert "milliseconds" in found(report, "unit_of_time")[0].text
    assert {finding.name for finding in report.findings} == {"unit_of_time"}
    assert report.refused


@pytest.mark.parametrize("joint", range(6))
def test_inverted_torque_is_refused(good, spoilt, joint):
    """The torque of one joint with the wrong sign is refused, and the joint is named."""
    tau = good().tau.copy()
    tau[:, joint] *= -1
    report = spoilt(tau=tau)
    assert report.refused
    assert joint + 1 in [finding.joint for finding in report.of("refuse")]


def test_all_torques_inverted_are_refused(good, spoilt):
    """Torques that all have the wrong sign are refused: inertia and friction are negative."""
    assert len(joints(spoilt(tau=-good().tau), "torque_sign")) >= 4


def test_time_that_runs_backward_is_refused(good, spoilt):
    """In a motion played backward, friction drives."""
    log = good()
    report = spoilt(q=log.q[::-1], tau=log.tau[::-1])
    assert report.refused
    assert found(report, "negative_friction")


def test_percent_of_rated_torque_is_reported(er3a, good, spoilt):
    """Torques in percent do not agree on the links that the joints share."""
    report = spoilt(tau=100 * good().tau / er3a.limits.torque)
    assert "in percent" in found(report, "torque_meaning")[0].text


@pytest.mark.slow
def test_motor_torque_is_found_by_the_description(good, spoilt):
    """Torques of a hundredth of those of the description are reported."""
    (finding,) = found(spoilt(tau=good().tau / 100), "torque_meaning")
    assert finding.value == pytest.approx(0.01, rel=0.3)


@pytest.mark.slow
@pytest.mark.parametrize("samples", [0.7, 1.7, 5.0, 30.0])
def test_common_delay_is_measured_to_a_part_of_a_sample(good, spoilt, samples):
    """A late torque is reported with an error below 0.3 samples, or four standard errors if these are more."""
    log = good(duration=20.0)
    late = CubicSpline(log.t, log.tau)(np.clip(log.t - 0.004 * samples, 0, None))
    report = spoilt(tau=late)
    (finding,) = found(report, "delay")
    assert finding.joint is None
    errors = 4 * float(np.nanmin(report.delay_error))
    assert finding.value == pytest.approx(0.004 * samples, abs=max(errors, 0.0012))


@pytest.mark.slow
def test_delay_of_one_joint_is_reported_for_that_joint(good, spoilt):
    """A delay of one joint is not attributed to the others."""
    log = good()
    tau = log.tau.copy()
    tau[:, 1] = CubicSpline(log.t, log.tau[:, 1])(np.clip(log.t - 0.012, 0, None))
    report = spoilt(tau=tau)
    assert joints(report, "delay") == [2]
    assert report.delay[1] == pytest.approx(0.012, abs=0.002)


@pytest.mark.slow
def test_joint_that_stands_is_reported(er3a, good):
    """A joint that hardly moves is named; if none moves, the log is refused."""
    log = good()
    q = log.q.copy()
    q[:, 2] = q[0, 2] + 1e-4 * q[:, 2]
    assert joints(check_log(er3a, replace(log, q=q)), "hardly_moves") == [3]
    still = check_log(er3a, replace(log, q=np.tile(log.q[0], (len(log), 1))))
    assert found(still, "no_motion")
    assert still.refused


@pytest.mark.slow
def test_velocity_columns_are_compared(good, spoilt):
    """Velocities in degrees, with the wrong sign or of another joint are reported."""
    log = good()
    dq = np.gradient(log.q, log.t, axis=0)
    assert spoilt(dq=dq).findings == ()
    assert "degrees per second" in found(spoilt(dq=np.rad2deg(dq)), "velocity_column")[0].text
    inverted = dq * np.array([1, 1, -1, 1, 1, 1])
    assert joints(spoilt(dq=inverted), "velocity_column") == [3]
    assert joints(spoilt(dq=dq[:, [1, 0, 2, 3, 4, 5]]), "velocity_column") == [1, 2]
    assert found(spoilt(dq=dq * 1000), "unit_of_time")


@pytest.mark.slow
def test_torque_without_connection_to_the_motion_is_refused(good, spoilt):
    """The motion does not explain shuffled torques."""
    rng = np.random.default_rng(0)
    report = spoilt(tau=rng.permutation(good().tau))
    assert joints(report, "badly_excited") == [1, 2, 3, 4, 5, 6]
    assert report.refused


@pytest.mark.slow
def test_joint_of_noise_is_badly_excited(good, spoilt):
    """A joint whose torque is noise is reported, and the others stay usable."""
    tau = good().tau.copy()
    tau[:, 5] = np.random.default_rng(0).normal(size=len(tau))
    report = spoilt(tau=tau)
    assert joints(report, "badly_excited") == [6]
    assert not report.refused
    assert report.unexplained[5] > 0.9


def test_arm_that_is_moved_by_hand_is_refused(fourier_motion):
    """A torque that balances gravity but never accelerates a pendulum does not determine its inertia."""
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    one = np.ones(1)
    limits = Limits(
        lower=-3 * one, upper=3 * one, velocity=6 * one, acceleration=40 * one, jerk=900 * one, torque=9 * one
    )
    joint = Joint("pivot", "revolute", turn, np.zeros(3), np.array([0.0, 0.0, 1.0]))
    robot = Robot(name="pendulum", chain=Chain((joint,)), limits=limits)
    motion = fourier_motion(robot, 0)
    hold = 3.3 * np.sin(motion.q) + 0.01 * np.random.default_rng(0).normal(size=motion.q.shape)
    assert found(check_log(robot, Log(motion.t, motion.q, tau=hold)), "moved_by_others")
    moved = hold + 0.17 * motion.ddq  # of a mass of 0.68 kg at 0.5 m, as the weight is
    assert check_log(robot, Log(motion.t, motion.q, tau=moved)).findings == ()


def test_joint_of_opposite_direction_is_reported(arm, arm_log):
    """A position and a torque of opposite sign fit the description poorly; inverted they fit it."""
    log = arm_log(motion_seed=3)
    sign = np.array([1.0, -1.0])
    report = check_log(arm, replace(log, q=log.q * sign, tau=log.tau * sign))
    assert joints(report, "position_sign") == [2]


def test_absurd_values_are_refused_without_a_fit(good, spoilt):
    """Values near the largest number are reported, not squared."""
    tau = good().tau.copy()
    tau[:, 1] = 1e300
    report = spoilt(tau=tau)
    assert joints(report, "absurd_value") == [2]
    assert np.isnan(report.unexplained).all()


def test_current_is_checked_as_torque_is(arm, arm_log):
    """Currents are checked as the torques that the torque constants give."""
    log = arm_log()
    current = log.tau / arm.torque_constant
    report = check_log(arm, Log(log.t, log.q, current=current))
    assert report.findings == ()
    assert (report.unexplained < 0.2).all()
    inverted = check_log(arm, Log(log.t, log.q, current=-current))
    assert {finding.column for finding in found(inverted, "torque_sign")} == {"i1", "i2"}


def test_motion_without_torque_is_checked_too(er3a, good):
    """A log of a motion without torque passes, or has findings on its motion."""
    log = good()
    report = check_log(er3a, Log(log.t, log.q))
    assert report.findings == ()
    assert np.isnan(report.delay).all()
    assert check_log(er3a, Log(1e3 * log.t, log.q)).refused


def test_few_rows_are_refused(er3a, good):
    """Fewer rows than the smoothing needs are refused."""
    for rows in (2, 10, 40):
        assert found(check_log(er3a, good().rows(slice(0, rows))), "short"), rows


def test_log_of_another_robot_is_an_input_error(arm, good):
    """Another number of joints is an error, not a finding."""
    with pytest.raises(InputError, match="6 joints"):
        check_log(arm, good())


@pytest.mark.slow
def test_report_has_verdict_findings_and_actions(good, spoilt):
    """Summary, table and JSON name verdict, findings, numbers and what to do."""
    report = spoilt(q=np.mod(good().q, 2 * np.pi))
    assert "refused" in report.summary()
    assert "wraps" in report.summary()
    frame = report.to_frame()
    assert list(frame["severity"]) == sorted(frame["severity"], key=["refuse", "warning", "info"].index)
    stated = json.loads(json.dumps(report.to_dict(), allow_nan=False))
    assert stated["refused"] is True
    assert stated["findings"][0]["action"]
    with pytest.raises(InputError, match="more: "):
        report.raise_if_refused()


@pytest.mark.slow
def test_a_long_log_is_checked_whole(er3a, good):
    """A fault near the end of a long log is found, though only excerpts are fitted."""
    log = good(duration=20.0)
    times = 60
    t = 0.004 * np.arange(times * len(log))
    tau = np.tile(log.tau, (times, 1))
    # The rows at which two copies meet jump, and are few.
    whole = check_log(er3a, Log(t, np.tile(log.q, (times, 1)), tau=tau))
    assert whole.samples == times * len(log)
    t[-1000:] += 5.0
    assert found(check_log(er3a, Log(t, np.tile(log.q, (times, 1)), tau=tau)), "gap")


def test_short_log_is_reported(er3a, good):
    """Standard errors from two seconds of six joints are unreliable."""
    report = check_log(er3a, good().rows(slice(0, 500)))
    assert found(report, "short")[0].severity == "warning"
