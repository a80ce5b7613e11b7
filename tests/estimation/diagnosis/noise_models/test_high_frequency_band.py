"""Tests of the frequencies above the usable band: what effects gain there, and noise that repeats."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from estimation.diagnosis.calibration import MAX_HIGH_BAND_ERROR
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import refine
from estimation.diagnosis.hypothesis_tests.scoring import accept, score
from estimation.diagnosis.joint_fits.extended_fit import fit_extended
from estimation.diagnosis.noise_models.frequency_bands import TRANSITION
from estimation.diagnosis.recordings.log_reading import build_recording
from estimation.diagnosis.recordings.recording import Recording, cut_recording, join_recordings
from estimation.preprocessing import Cycle
from robots.regressor import default_model
from robots.robot import Robot
from robots.signals import Log
from robots.terms.discrepancies.patterns import Pattern, build_pattern
from robots.terms.effects import EFFECTS

RIPPLE = Hypothesis(EFFECTS["torque_ripple"], 1)
SHAPE = (150.0, 0.0, 0.0)
NOISE = 0.1  # of the torque, white [N m]
SIZE = 0.02  # amplitude of the ripple, a fifth of the noise
SHAKEN = 17.3  # [Hz]


@pytest.fixture(scope="module")
def clean(arm: Robot, arm_log: Callable[..., Log]) -> Recording:
    """Returns a recording without torque noise, with the position noise floor of a coarse encoder."""
    return replace(build_recording(arm, [arm_log(torque_noise=0.0)]), floor=np.full(2, 1e-11), cycles=(None,))


@pytest.fixture(scope="module")
def recording(clean: Recording) -> Recording:
    """Returns the same recording with white torque noise of known size."""
    return replace(clean, tau=clean.tau + NOISE * np.random.default_rng(1).standard_normal(clean.tau.shape))


def _rippled(recording: Recording) -> Recording:
    tau = recording.tau.copy()
    tau[:, 0] += SIZE * np.cos(SHAPE[0] * recording.q[:, 0])
    return replace(recording, tau=tau)


def _cosine(problem: Problem) -> tuple[float, float]:
    """Estimates the size of the ripple's cosine beside the base model, and its standard error."""
    group = problem.measured(RIPPLE, SHAPE)
    return float(group.cross[0] / group.gram[0, 0]), float(group.gram[0, 0] ** -0.5)


@pytest.mark.slow
def test_a_ripple_tells_its_energy_over_the_noise(recording: Recording, pose_arm: Callable[..., Problem]) -> None:
    """The information above the band is the wave's energy between both cut-offs over the noise density.

    Rows with an unknown sign and log ends, where the filter starts, do not count. A quarter is lost, because white
    noise sometimes resembles a burst.
    """
    below, both = (pose_arm(_rippled(recording), wider=wider) for wider in (None, MAX_HIGH_BAND_ERROR))
    cutoffs = below.whitening.bands[0].cutoff, both.high_band.whitening.bands[0].cutoff  # type: ignore[union-attr]
    assert cutoffs[0] < 12.0
    assert cutoffs[1] > 2 * cutoffs[0]
    spectrum = np.fft.rfft(np.cos(SHAPE[0] * recording.q[:, 0]))
    f = np.fft.rfftfreq(len(recording), recording.step)
    half = 1 - TRANSITION / 2  # of a cut-off, where the filter passes half
    spectrum[(f < half * cutoffs[0]) | (f > half * cutoffs[1])] = 0.0
    wave = np.fft.irfft(spectrum, len(recording))
    wave[recording.sign_unknown[:, 0]] = 0.0
    edge = round(7.2 / cutoffs[0] / recording.step)
    (_, slow), (size, error) = _cosine(below), _cosine(both)
    assert error**-2 - slow**-2 == pytest.approx(0.75 * np.sum(wave[edge:-edge] ** 2) / NOISE**2, rel=0.2)
    assert abs(size - SIZE) < 4 * error  # fails wrongly once in 16,000


@pytest.mark.parametrize("name", ["torque_ripple", "asymmetric_friction"])
def test_the_slope_has_the_products_of_an_effect_with_the_residual(
    recording: Recording, pose_arm: Callable[..., Problem], name: str
) -> None:
    """The score gradient gives the products of an effect's columns with the whitened residual, also above the band."""
    problem = pose_arm(_rippled(recording), wider=MAX_HIGH_BAND_ERROR)
    hypothesis, shape = (RIPPLE, SHAPE) if name == "torque_ripple" else (Hypothesis(EFFECTS[name], 1), ())
    slope = problem.score_gradient_for(hypothesis.effect)
    joints, columns = problem.columns_of(hypothesis, shape)
    products = np.sum([part.T @ slope[:, j] for j, part in zip(joints, columns, strict=True)], axis=0)
    group = problem.measured(hypothesis, shape)
    # The first rows of a log are filtered differently.
    np.testing.assert_allclose(products, group.cross, atol=0.05 * np.sqrt(np.diag(group.gram)).max())
    if hypothesis is RIPPLE:
        assert abs(group.cross[0]) > 4 * np.sqrt(group.gram[0, 0])


@pytest.mark.slow
def test_what_shakes_the_arm_is_no_inertia(arm: Robot, recording: Recording, pose_arm: Callable[..., Problem]) -> None:
    """A vibration above the band keeps its energy, because the arm's response does not count as inertia torque."""
    model = default_model(arm)
    wave = np.sin(2 * np.pi * SHAKEN * recording.t)
    answer = np.zeros_like(recording.ddq)
    answer[:, 0] = -1.0 * wave
    moves = [model.torque(recording.q, recording.dq, a, model.nominal) for a in (recording.ddq + answer, recording.ddq)]
    tau = recording.tau + moves[0] - moves[1]
    tau[:, 0] += SIZE * wave
    problem = pose_arm(replace(recording, ddq=recording.ddq + answer, tau=tau), wider=MAX_HIGH_BAND_ERROR)
    vibration = Hypothesis(build_pattern("pattern:vibration:0:even"), 1)  # type: ignore[arg-type]
    assert problem.whitening.bands[0].cutoff < SHAKEN < problem.high_band.whitening.bands[0].cutoff  # type: ignore[union-attr]
    known, taken = (problem.high_band.columns(wave[:, None], 0, bare=bare) for bare in (True, False))  # type: ignore[union-attr]
    assert np.sum(taken**2) < 0.3 * np.sum(known**2)
    found = refine(
        problem,
        vibration,
        vibration.effect.propose(problem.situation, 1, problem.score_gradient_exogenous, 4)[0],
        accept(problem, ()),
    )
    assert found.shape[0] == pytest.approx(SHAKEN, abs=0.01)
    # The gain is the wave's own energy over that of the noise.
    assert found.gain == pytest.approx(SIZE**2 * np.sum(known**2), rel=0.3)
    assert found.gain > 30.0  # noise exceeds this once in 10,000


@pytest.mark.slow
def test_only_fast_effects_are_measured_there(recording: Recording, pose_arm: Callable[..., Problem]) -> None:
    """An effect by acceleration has no rows above the band, and a slow signal has almost no energy there."""
    problem = pose_arm(recording, wider=MAX_HIGH_BAND_ERROR)
    assert problem.measured(RIPPLE, SHAPE).high_band_columns[0].shape[1] == 4
    assert not problem.measured(Hypothesis(EFFECTS["encoder_offset"], 1), ()).high_band_columns
    assert problem.high_band is not None
    slow = np.sin(recording.t)[:, None]
    assert np.sum(problem.high_band.columns(slow, 0) ** 2) < 1e-3 * np.sum(problem.whitening.apply(slow, 0) ** 2)


def test_found_beside_it_a_ripple_is_taken_off(recording: Recording, pose_arm: Callable[..., Problem]) -> None:
    """An accepted ripple has no gain left."""
    problem = pose_arm(_rippled(recording), wider=MAX_HIGH_BAND_ERROR)
    group = problem.measured(RIPPLE, SHAPE)
    accepted = accept(problem, (group,))
    assert accepted.gain > 15.0
    assert score(problem, group, accepted).gain == pytest.approx(0.0, abs=1e-3)


@pytest.mark.slow
def test_the_extended_model_knows_it_as_well(recording: Recording, pose_arm: Callable[..., Problem]) -> None:
    """Rows above the band reduce the standard errors of coefficients at least as much as in a score."""
    energies, extended = [], []
    for wider in (None, MAX_HIGH_BAND_ERROR):
        problem = pose_arm(_rippled(recording), wider=wider)
        member = refine(problem, RIPPLE, SHAPE, accept(problem, ()), effort=0)
        energies.append(np.sqrt(np.sum(score(problem, member.group, accept(problem, ())).root ** 2, axis=0)))
        extension = fit_extended(problem, [member], {}).model.extensions[0]
        extended.append(np.sqrt(np.diag(extension.covariance)[:4]))
    assert np.all(energies[1] < 0.5 * energies[0])
    # Standard errors include the uncertainty of the shape, which is smaller with the rows above the band.
    assert np.all(extended[1] / extended[0] < 1.4 * energies[1] / energies[0])


@pytest.mark.slow
@pytest.mark.parametrize("cut_off", [0, 30])
@pytest.mark.parametrize("same", [True, False])
def test_noise_that_repeats_with_the_motion_tells_less(
    clean: Recording, pose_arm: Callable[..., Problem], same: bool, cut_off: int
) -> None:
    """If the noise is the same in five repetitions, the information above the band is a fifth.

    This also holds if the ends of the log are cut off. The noise of some 60 frequencies is known to 13 %; the chance of
    an error above a half is 1 in 10,000.
    """
    period = len(clean) // 5
    noise = np.random.default_rng(3).standard_normal((5 * period, 2))
    rows = slice(0, 5 * period - cut_off)
    cycle = Cycle(0, rows.stop, period * clean.step, 5)
    energies = []
    for repeated in (np.tile(noise[:period], (5, 1)), noise) if same else (noise, noise[::-1]):
        log = cut_recording(clean, rows)
        problem = pose_arm(
            replace(log, tau=log.tau + NOISE * repeated[rows], cycles=(cycle,)), wider=MAX_HIGH_BAND_ERROR
        )
        assert problem.high_band is not None
        energies.append(float(np.sum(problem.high_band.columns(np.cos(SHAPE[0] * log.q[:, :1]), 0) ** 2)))
    assert energies[1] / energies[0] == pytest.approx(5.0 if same else 1.0, rel=0.5)


@pytest.mark.slow
@pytest.mark.parametrize("periods", [0.0, 2.95])
def test_noise_is_levelled(clean: Recording, pose_arm: Callable[..., Problem], periods: float) -> None:
    """Noise that grows with frequency has unit density above the band after whitening.

    This also holds in a log with a number of repetitions that is not whole.
    """
    rng = np.random.default_rng(5)
    noise = NOISE * rng.standard_normal(clean.tau.shape)
    noise += np.gradient(np.gradient(rng.standard_normal(clean.tau.shape), axis=0), axis=0) * 0.3
    cycle = Cycle(0, len(clean), len(clean) * clean.step / periods, 2) if periods else None
    problem = pose_arm(replace(clean, tau=clean.tau + noise, cycles=(cycle,)), wider=MAX_HIGH_BAND_ERROR)
    assert problem.high_band is not None
    wide = problem.high_band.whitening
    for j, above in enumerate(problem.high_band.joints):
        assert above is not None
        power = np.abs(np.fft.rfft(above.residual)) ** 2 / np.count_nonzero(above.counts)
        f = np.fft.rfftfreq(len(above.residual), clean.step * wide.stride)
        edges = np.linspace(1.1 * problem.whitening.bands[j].cutoff, 0.8 * wide.bands[j].cutoff, 5)
        # Each part has 60 frequencies or more.
        for low, high in pairwise(edges):
            assert power[(f >= low) & (f < high)].mean() == pytest.approx(1.0, abs=0.4)


@pytest.mark.slow
def test_a_log_in_which_a_joint_stands_levels_no_noise(clean: Recording, pose_arm: Callable[..., Problem]) -> None:
    """A longer log in which a joint rests does not change that joint's noise level above the band.

    The mean of some 500 frequencies has a standard error of 5 %.
    """
    rng = np.random.default_rng(6)
    noisy = replace(clean, tau=clean.tau + NOISE * rng.standard_normal(clean.tau.shape))
    whole = noisy
    for k in (1, 2):
        stands = replace(
            clean,
            t=clean.t + 100.0 * k,
            dq=clean.dq * [0.0, 1.0],
            ddq=clean.ddq * [0.0, 1.0],
            tau=clean.tau + [3.0, 0.0] + NOISE * rng.standard_normal(clean.tau.shape),
            sign_unknown=clean.sign_unknown | np.array([True, False]),
        )
        whole = join_recordings([whole, stands])
    upper = pose_arm(whole, wider=MAX_HIGH_BAND_ERROR).high_band
    assert upper is not None
    above = upper.joints[0]
    assert above is not None
    power = np.abs(np.fft.rfft(above.residual)) ** 2 / np.count_nonzero(above.counts)
    f = np.fft.rfftfreq(len(above.residual), clean.step * upper.whitening.stride)
    cutoffs = [above.high_pass.cutoff / (1 - TRANSITION / 2), 15.0]
    assert cutoffs[0] > 20.0
    assert power[(f > cutoffs[1]) & (f < 0.8 * cutoffs[0])].mean() == pytest.approx(1.0, abs=0.4)


@pytest.mark.slow
def test_a_vibration_above_the_band_is_reported(recording: Recording, pose_arm: Callable[..., Problem]) -> None:
    """A steady oscillation between both cut-offs is significant with the rows above the band only."""
    size = 0.03
    cutoffs = [pose_arm(recording, wider=MAX_HIGH_BAND_ERROR).whitening.bands[0].cutoff]
    cutoffs.append(pose_arm(recording, wider=MAX_HIGH_BAND_ERROR).high_band.whitening.bands[0].cutoff)  # type: ignore[union-attr]
    frequency = float(np.mean(cutoffs)) * (1 - TRANSITION / 2)
    wave = np.cos(2 * np.pi * frequency * (recording.t - recording.t[0]))
    tau = recording.tau.copy()
    tau[:, 0] += size * wave
    vibration = Hypothesis(Pattern("vibration"), 1)
    gains = []
    for wider in (None, MAX_HIGH_BAND_ERROR):
        problem = pose_arm(replace(recording, tau=tau), wider=wider)
        found = score(problem, problem.measured(vibration, (frequency,)), accept(problem, ()))
        gains.append(found.gain)
    energy = len(recording) * size**2 / 2 / NOISE**2
    assert gains[0] < 20.0
    # In a log of 20 s the line counts partly as noise, whose level is then a few times as high. The gain is still
    # significant: for pure noise the mean of eight functions' gain is 8.
    assert 35.0 < gains[1] < energy
    coefficients = found.bounded(np.full(8, -np.inf), np.full(8, np.inf))[1]
    energies = problem.situation, 1, (frequency,)
    assert np.corrcoef(Pattern("vibration").local(*energies) @ coefficients, wave)[0, 1] > 0.9
