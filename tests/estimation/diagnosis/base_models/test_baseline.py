"""Tests of the base model's smooth velocity sign, whose width is chosen from the data."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation.diagnosis.base_models.baseline import base_parameters, build_baseline
from estimation.diagnosis.pipeline import diagnose
from estimation.diagnosis.recordings.log_reading import build_recording
from estimation.diagnosis.recordings.recording import Recording
from estimation.diagnosis.recordings.thinning import shift_motion
from estimation.diagnosis.searches.search import fit_plain
from robots.plants import simulate
from robots.robot import Robot
from robots.signals import Log


@pytest.mark.parametrize("share", [0.01, 0.02, 0.04])
def test_a_sign_is_as_wide_as_the_friction_turns_round(
    arm: Robot, arm_plant: Callable, fourier_motion: Callable, share: float
) -> None:
    """Widths up to a twentieth of a joint's largest speed are estimated to a factor of two."""
    motion = fourier_motion(arm, 0)
    width = share * float(np.abs(motion.dq).max(axis=0).min())
    log = simulate(arm_plant(velocity_scale=width, torque_noise=0.01), motion, seed=0)
    recording = build_recording(arm, [log])
    chosen = build_baseline(base_parameters(arm, "coulomb-viscous", (0.001, 0.001)), recording)
    scales = chosen.situation(recording, np.zeros(chosen.base.size)).velocity_scale
    assert np.all(np.abs(np.log(scales / width)) < np.log(2.0))


@pytest.mark.slow
@pytest.mark.parametrize("share", [1.0, 0.03])
def test_friction_that_turns_round_at_once_leaves_nothing(
    arm: Robot, arm_plant: Callable, fourier_motion: Callable, share: float
) -> None:
    """Sharp Coulomb friction leaves no residual, on joints at usual and at low speed.

    A sign that is too wide would leave a residual at each reversal that resembles a delay.
    """
    motions = [fourier_motion(arm, k, duration=30.0) for k in range(2)]
    slow = [replace(m, q=share * m.q, dq=share * m.dq, ddq=share * m.ddq) for m in motions]
    log, other = (simulate(arm_plant(velocity_scale=1e-9, torque_noise=0.005), m, seed=k) for k, m in enumerate(slow))
    similar = ("presliding_hysteresis", "stribeck", "time_delay", "backlash", "joint_elasticity")
    result = diagnose(arm, log, held_out=other, candidates=similar)
    assert result.verdict == "none"
    assert np.all(result.baseline < 0.006)


@pytest.mark.slow
@pytest.mark.parametrize("power", [2, 3])
def test_friction_that_bends_over_all_speeds_has_no_name(
    arm: Robot, arm_plant: Callable, fourier_motion: Callable, power: int
) -> None:
    """The square or the cube of the speed belongs to the base model, and is no Stribeck friction at high speed."""
    motion = fourier_motion(arm, 0, duration=60.0)
    log = simulate(arm_plant(torque_noise=0.005), motion, seed=0)
    speed = motion.dq / np.abs(motion.dq).max(axis=0)
    bent = replace(log, tau=log.tau - 0.15 * log.tau.std(axis=0) * speed * np.abs(speed) ** (power - 1))
    result = diagnose(arm, bent, candidates=("stribeck", "load_dependent_friction", "torque_constant_saturation"))
    assert result.verdict == "none", result.summary()


@pytest.mark.slow
def test_beside_reversals_a_fit_to_the_other_rows_leaves_no_more_than_the_torque(
    arm: Robot, arm_plant: Callable, fourier_motion: Callable
) -> None:
    """If rows near reversals do not count, the residual there is still not larger than the torque.

    Only these rows show the width of the sign. Residuals above a joint's band are filtered over all rows, so large ones
    would hide a ripple.
    """
    log = simulate(arm_plant(velocity_scale=1e-3, torque_noise=0.01), fourier_motion(arm, 0, duration=30.0), seed=0)
    recording = build_recording(arm, [log])
    recording = replace(recording, sign_unknown=recording.sign_unknown | (np.abs(recording.dq) < 0.05))
    _, settled = fit_plain(base_parameters(arm, "polynomial", (0.001, 0.001)), recording)
    assert np.all(np.abs(settled.residual).max(axis=0) < np.abs(recording.tau).max(axis=0))


def test_friction_that_is_logged_late_is_as_sharp_as_it_is(arm: Robot, arm_log: Callable[..., Log]) -> None:
    """With a delayed torque the sign is as sharp as without delay, if the motion is shifted by the delay."""
    log = arm_log(velocity_scale=1e-4, torque_noise=0.02)
    coarse, late = 3, 2
    rows = np.arange(coarse, len(log), coarse)
    by = late * float(np.diff(log.t).mean())
    recordings = [build_recording(arm, [replace(log.rows(rows), tau=log.tau[rows - lag])]) for lag in (0, late)]

    def sharpness(recording: Recording, **known: Recording) -> np.ndarray:
        chosen = build_baseline(base_parameters(arm, "coulomb-viscous", (0.001, 0.001)), recording, **known)
        return chosen.situation(recording, np.zeros(chosen.base.size)).velocity_scale

    on_time, blurred = (sharpness(recording) for recording in recordings)
    known = sharpness(recordings[1], known=shift_motion(recordings[1], by))
    assert (known < 0.5 * blurred).all()
    assert (known <= on_time).all()
    assert shift_motion(recordings[1], 0.0) is recordings[1]
