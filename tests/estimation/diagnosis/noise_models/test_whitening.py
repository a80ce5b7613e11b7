"""Tests of the noise model, and of rows whose direction of motion is unknown."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from estimation.diagnosis.noise_models.masked_rows import find_masked_rows
from estimation.diagnosis.noise_models.noise_estimate import estimate_whitening
from estimation.diagnosis.noise_models.whitening import Whitening
from estimation.diagnosis.validations.residual_shares import period_differences, period_mean, residual_shares
from estimation.linear_algebra.orthonormal import orthonormal
from estimation.preprocessing import Cycle
from tests.estimation.diagnosis.noisy_logs import STEP, noise_of, recording_of


def test_coloured_noise_becomes_white_and_of_unit_density_in_the_band() -> None:
    """Half coloured, half white noise has unit density at all frequencies of the band after whitening.

    Each of five parts of the band has some 700 frequencies: the standard error of its mean power is 4 %.
    """
    residual = noise_of(10_000)
    whitening = estimate_whitening(recording_of(), residual, 0, np.eye(2))
    white = whitening.all(residual)[50:]
    power = np.abs(np.fft.rfft(white, axis=0)) ** 2 / len(white)
    f = np.fft.rfftfreq(len(white), STEP * whitening.stride)
    edges = np.linspace(0.5, 0.75 * whitening.bands[0].cutoff, 6)
    for low, high in pairwise(edges):
        assert power[(f >= low) & (f < high)].mean(axis=0) == pytest.approx([1.0, 1.0], abs=0.2)
    correlation = np.linalg.inv(whitening.precision)
    assert correlation[0, 1] == pytest.approx(np.corrcoef(white.T)[0, 1], abs=0.04)


def _level(whitening: Whitening, residual: np.ndarray, rows: slice = slice(None)) -> np.ndarray:
    """Computes the mean power (2,) from 1.5 to 8 Hz of some rows of the whitened noise."""
    white = replace(whitening, weights=None).all(residual)[rows]
    power = np.abs(np.fft.rfft(white, axis=0)) ** 2 / len(white)
    f = np.fft.rfftfreq(len(white), STEP * whitening.stride)
    return np.asarray(power[(f > 1.5) & (f < 8.0)].mean(axis=0))


def test_a_slow_effect_is_not_taken_for_noise() -> None:
    """An effect below 1 Hz, four times as large as the noise, does not change the noise model.

    The mean over some 500 frequencies has a standard error of 4.5 %. At zero frequency a process fitted above 1 Hz is
    accurate to a fifth.
    """
    noise = noise_of(20_000)
    t = STEP * np.arange(20_000)[:, None]
    slow = 4 * noise.std(axis=0) * np.sin(2 * np.pi * np.array([0.05, 0.6]) * t)
    recording = recording_of(20_000)
    alone = estimate_whitening(recording, noise, 0, np.eye(2))
    beside = estimate_whitening(recording, noise + slow, 0, np.eye(2))
    assert _level(beside, noise) == pytest.approx(_level(alone, noise), rel=0.05)
    at_rest = [
        [scale / abs(1 - a.sum()) for a, scale in zip(w.coefficients, w.scale, strict=True)] for w in (alone, beside)
    ]
    assert at_rest[1] == pytest.approx(at_rest[0], rel=0.2)


@pytest.mark.parametrize("memory", [0.98, 0.995])
def test_noise_that_wanders_is_noise(memory: float) -> None:
    """The level at zero frequency of noise correlated over 0.2 or 0.8 s is not underestimated by more than a fifth.

    Forty coefficients estimate it to a tenth from 10,000 rows (Berk 1974), but hardly where the spectrum bends at 0.2
    Hz, because they cover only 0.3 s. The order with the best prediction above 1 Hz finds three quarters and a fifth of
    it.
    """
    rng = np.random.default_rng(1)
    rows = 20_000
    slow = lfilter([np.sqrt(1 - memory**2)], [1, -memory], rng.standard_normal((rows + 2000, 2)), axis=0)[2000:]
    noise = (rng.standard_normal((rows, 2)) + slow) * [2.0, 0.5]
    phase = 2 * np.pi * 0.3 * STEP * np.arange(rows)
    wave = np.column_stack([np.sin(phase), np.cos(phase)])
    found = estimate_whitening(recording_of(rows), noise, 0, np.eye(2), spared=(wave, wave))
    true = np.sqrt(1 + (1 + memory) / (1 - memory)) * np.array([2.0, 0.5])
    share = found.at_rest * np.sqrt(found.stride) / true
    assert np.all((share > 0.8) & (share < 2.2))


def test_kicks_at_reversals_and_times_at_rest_do_not_change_the_level() -> None:
    """Impulses at reversals and rests do not change the noise level."""
    noise = noise_of(20_000)
    unsure = np.zeros((20_000, 2), dtype=bool)
    residual = noise.copy()
    for start in range(100, 10_000, 200):
        unsure[start : start + 6, 0] = True
        residual[start : start + 6, 0] += 50 * noise[:, 0].std()
    unsure[10_000:18_000] = True  # both joints rest for two fifths of the time, held by brakes
    residual[10_000:18_000] = 0.0
    whitening = estimate_whitening(recording_of(20_000, unsure=unsure), residual, 0, np.eye(2))
    stride = whitening.stride
    assert _level(whitening, noise, slice(9_900 // stride)) == pytest.approx([1.0, 1.0], abs=0.2)
    assert whitening.weights is not None
    assert not whitening.weights[10_000 // stride + 1 : 18_000 // stride].any()
    assert np.median(whitening.weights[: 9_000 // stride], axis=0) == pytest.approx([1.0, 1.0])


def test_rows_of_unknown_direction_do_not_count() -> None:
    """A torque of any size within a short gap vanishes in the whitened residual."""
    unsure = np.zeros((10_000, 2), dtype=bool)
    unsure[3000:3006, 0] = True
    recording = recording_of(unsure=unsure)
    whitening = replace(estimate_whitening(recording, noise_of(10_000), 0, np.eye(2)), weights=None)
    kick = np.zeros(10_000)
    kick[3001:3005] = 1000.0
    plain = replace(whitening, masked=find_masked_rows(np.zeros_like(unsure), (0,)))
    assert np.linalg.norm(whitening.apply(kick, 0)) < 1e-9 * np.linalg.norm(plain.apply(kick, 0))
    assert np.linalg.norm(whitening.apply(kick, 1)) == pytest.approx(np.linalg.norm(plain.apply(kick, 1)))


def test_the_adjoint_has_the_products_of_the_filter() -> None:
    """The adjoint filter gives the products of filtered torques with whitened rows.

    It is tested next to rests and reversals, in thinned logs with two noise levels.
    """
    rng = np.random.default_rng(3)
    rows = 6_000
    unsure = np.zeros((rows, 2), dtype=bool)
    unsure[1_000:1_400] = unsure[2_500:2_504] = True
    recording = replace(recording_of(rows, unsure=unsure), starts=(0, 3_001), cycles=(None, None), names=("a", "b"))
    noise = noise_of(rows) * np.repeat([1.0, 0.3], [3_001, rows - 3_001])[:, None]
    whitening = estimate_whitening(recording, noise, 0, 0.2 * np.eye(2))
    whitening = replace(whitening, bands=tuple(replace(band, stride=2) for band in whitening.bands))
    whitening = replace(whitening, weights=None, masked=replace(whitening.masked, free=()))
    for joint in range(2):
        white = rng.standard_normal(len(whitening.apply(noise[:, joint], joint)))
        slope = whitening.adjoint(white, joint, rows)
        assert not slope[1_010:1_390].any()
        for first in (300, 2_480, 3_300, 5_960):
            torque = np.zeros(rows)
            torque[first : first + 30] = rng.standard_normal(30)
            product = whitening.apply(torque, joint) @ white
            assert torque @ slope == pytest.approx(product, abs=1e-9 * np.linalg.norm(slope)), first


def test_where_in_a_gap_friction_turns_round_does_not_matter() -> None:
    """The row of a sign change within a gap does not change the whitened sign."""
    unsure = np.zeros((10_000, 2), dtype=bool)
    unsure[3000:3016, 0] = True
    whitening = estimate_whitening(recording_of(unsure=unsure), noise_of(10_000), 0, np.eye(2))
    early, late = (np.where(np.arange(10_000) < turn, -1.0, 1.0) for turn in (3002, 3013))
    assert whitening.apply(early, 0) == pytest.approx(whitening.apply(late, 0), abs=1e-12)
    # Where the sign is known, its row matters.
    assert np.abs(whitening.apply(early, 1) - whitening.apply(late, 1)).max() > 0.1


def test_a_long_gap_is_bridged_within_its_log() -> None:
    """A rest is bridged by a straight line; at the end of a log the last known value is kept."""
    unsure = np.zeros((100, 1), dtype=bool)
    unsure[20:30], unsure[45:50] = True, True
    gaps = find_masked_rows(unsure, (0, 50), 3)
    series = np.arange(100.0)
    bent = series.copy()
    bent[20:30], bent[45:50] = 7.0, 7.0
    bridged = gaps.bridged(bent, 0)
    assert bridged[20:30] == pytest.approx(series[20:30])
    assert bridged[45:50] == pytest.approx(44.0)
    assert bridged[50] == 50.0


def test_differences_between_repetitions_hold_the_noise_and_nothing_that_repeats() -> None:
    """Differences between repetitions have the variance of the noise, and their mean is the repeating part."""
    rng = np.random.default_rng(0)
    wave = np.tile(100 * rng.standard_normal((250, 1)), (8, 1))
    series = wave + rng.standard_normal(wave.shape)
    differences = period_differences(series, 250.0, 8)
    # 1,750 degrees of freedom: a standard error of 1.7 % of the deviation.
    assert differences.std() == pytest.approx(1.0, abs=0.07)
    assert np.abs(period_mean(series, 250.0, 8) - wave).max() < 5 / np.sqrt(8)


def test_what_reversals_leave_does_not_repeat_as_an_effect_does() -> None:
    """Errors next to reversals do not count as repeating; a wave as large as the noise is half of the residual."""
    rows, period = 10_000, 1000
    recording = replace(recording_of(rows), cycles=(Cycle(0, rows, period * STEP, 10),))
    noise, phase = np.random.default_rng(4).standard_normal((rows, 2)), np.arange(rows) % period
    turns = np.isin(phase, (100, 101, 600, 601))
    noise[turns] += 20.0
    noise[:, 1] += np.sqrt(2) * np.sin(6 * np.pi * phase / period)
    unsure = np.repeat(turns[:, None], 2, axis=1)
    shares = residual_shares(SimpleNamespace(recording=replace(recording, sign_unknown=unsure), base_residual=noise))  # type: ignore[arg-type]
    np.testing.assert_allclose(shares, [[1.0, 0.0, 0.0], [0.5, 0.5, 0.0]], atol=0.03)
    assert residual_shares(SimpleNamespace(recording=recording, base_residual=noise))[0, 1] > 0.5  # type: ignore[arg-type]


def test_an_orthonormal_basis_leaves_out_what_is_not_determined() -> None:
    """Of two equal columns the basis has one direction."""
    x = np.random.default_rng(0).standard_normal((50, 2))
    basis = orthonormal(np.column_stack([x, x[:, :1]]), 1e-7)
    assert basis.shape == (50, 2)
    assert basis.T @ basis == pytest.approx(np.eye(2), abs=1e-12)


def test_a_push_counts_and_a_kick_at_a_reversal_does_not() -> None:
    """A large push keeps its weight; next to a reversal the same torque loses it."""
    noise = noise_of(20_000)
    unsure = np.zeros((20_000, 2), dtype=bool)
    unsure[12_000:12_006] = True
    residual = noise.copy()
    push = 20 * noise.std(axis=0) * np.sin(np.pi * np.linspace(0, 1, 42))[:, None]
    residual[5_000:5_042] += push
    residual[12_008:12_050] += push
    whitening = estimate_whitening(recording_of(20_000, unsure=unsure), residual, 0, np.eye(2))
    stride = whitening.stride
    assert whitening.weights is not None
    pushed, kicked = (whitening.weights[(at + 8) // stride : (at + 34) // stride] for at in (5_000, 12_008))
    assert np.mean(pushed == 1.0) > 0.8
    assert np.mean(kicked < 0.9) > 0.5


@pytest.mark.parametrize("seen", [0, 5])
def test_a_log_in_which_a_joint_stands_takes_nothing_from_the_others(seen: int) -> None:
    """A log in which one joint rests does not change that joint's noise model.

    A few rows that move by encoder flicker give no noise level. Standard errors of the powers are 5 %.
    """
    noise = noise_of(30_000)
    unsure = np.zeros((30_000, 2), dtype=bool)
    unsure[8_000:, 0] = True
    unsure[9_000 : 9_000 + 900 * seen : 900, 0] = False
    residual = noise.copy()
    residual[8_000:, 0] = 20.0  # a brake holds it
    recording = replace(recording_of(30_000, unsure=unsure), starts=(0, 8_000), cycles=(None, None), names=("a", "b"))
    both = estimate_whitening(recording, residual, 0, np.eye(2))
    alone = estimate_whitening(recording_of(8_000), noise[:8_000], 0, np.eye(2))
    assert [band.cutoff for band in both.bands] == pytest.approx([band.cutoff for band in alone.bands], rel=0.05)
    assert both.levels is not None
    assert both.levels == pytest.approx(1.0, abs=0.1)
    rows = slice(50, 8_000 // both.stride - 50)
    assert _level(both, residual, rows) == pytest.approx([1.0, 1.0], abs=0.2)
    assert both.weights is not None
    assert not both.weights[8_000 // both.stride + 1 :, 0].any()
    assert both.weights[8_000 // both.stride + 1 :, 1].any()
