from dataclasses import replace

import numpy as np
import pytest

from estimation import identify, predict
from estimation.estimators import WeightedLeastSquares
from estimation.identifications.comparison import VELOCITY_SCALES, Comparison
from estimation.identifications.transfer import Transfer
from estimation.identifications.trials import Candidates
from estimation.preprocessing import LowPass
from estimation.regressions.preparation import prepare
from robots.base_parameters import find_base_parameters
from robots.plants import simulate
from robots.regressor import default_model
from robots.signals import Motion
from robots.terms.situations.flange_body import with_body


@pytest.fixture(scope="module")
def transfer(arm, arm_log):
    base = find_base_parameters(default_model(arm, friction="coulomb-viscous", velocity_scale=VELOCITY_SCALES[0]))
    comparison = Comparison(base, [prepare(arm, arm_log())], WeightedLeastSquares(), Candidates())
    return Transfer(comparison, LowPass(10.0))


def test_splits_are_halves_and_other_motions(transfer):
    """Each split predicts the half that it does not fit: the slow half fast blocks, one side of a range the other."""
    blocks = len(transfer.splits[0].fitted)
    for split in transfer.splits:
        assert not (split.fitted & split.judged).any()
        assert split.fitted.sum() == pytest.approx(blocks / 2, abs=1)
    motion = transfer.rows[0].motion
    pieces = transfer.comparison.pieces(transfer.rows[0])
    usual = np.sqrt(np.mean(motion.dq**2, axis=0))
    speed = np.array([(np.abs(motion.dq[piece]) / usual).mean() for piece in pieces])
    slow = transfer.splits[0]
    assert speed[slow.fitted].max() <= speed[slow.judged].min()


def slowed(motion, factor):
    """The same path, so many times slower, at the same sampling."""
    t = np.arange(0, motion.duration * factor, motion.period)
    q, dq, ddq = (
        np.column_stack([np.interp(t / factor, motion.t - motion.t[0], column) for column in signal.T])
        for signal in (motion.q, motion.dq, motion.ddq)
    )
    return Motion(t=t, q=q, dq=dq / factor, ddq=ddq / factor**2)


@pytest.mark.slow
def test_a_slow_log_predicts_the_full_motion(arm, arm_plant, fourier_motion):
    """Fitted to a motion slowed 2.5 times, the model errs by little more than one of the full motion.

    The band then holds most of the torque, and most of the rows are said to extrapolate or lie beyond the log.
    """
    plant = arm_plant(torque_noise=0.02)
    full = fourier_motion(arm, 0)
    slow_log = simulate(plant, slowed(full, 2.5), seed=0)
    known, unseen = simulate(plant, full, seed=1), simulate(plant, fourier_motion(arm, 1), seed=2)
    best = predict(identify(arm, known).model, unseen).error_rms
    found = predict(identify(arm, slow_log).model, unseen)
    assert (found.error_rms <= 1.5 * best).all()
    assert (found.band_coverage >= 0.85).all()
    assert any("times the recorded speed" in text for text in found.beyond)
    assert "extrapolate" in found.summary()
    # The polynomial that the slow log leaves open errs far more.
    polynomial = predict(identify(arm, slow_log, friction="polynomial").model, unseen)
    assert polynomial.error_rms.mean() >= 0.9 * found.error_rms.mean()


@pytest.mark.slow
def test_a_torque_by_position_is_taken_where_there_is_one(arm, arm_log):
    """A hidden cable's torque is found by position, without a cause; a log without one gets no such columns."""
    clean = arm_log(torque_noise=0.02)
    assert not identify(arm, clean).choice.position
    pull = 0.15 * clean.tau.std(axis=0) * np.cos(2 * clean.q + 0.4)
    found = identify(arm, replace(clean, tau=clean.tau + pull))
    assert found.choice.position
    assert any("torque by its position" in text for text in found.warnings)
    values = dict(zip(found.model.names, found.model.values, strict=True))
    size = np.hypot([values["sin2_1"], values["sin2_2"]], [values["cos2_1"], values["cos2_2"]])
    np.testing.assert_allclose(size, 0.15 * clean.tau.std(axis=0), rtol=0.3)
    assert not identify(arm, replace(clean, tau=clean.tau + pull), position=False).choice.position


@pytest.mark.slow
def test_logs_that_contradict_each_other_are_said(arm, arm_plant, fourier_motion):
    """An unstated body at the flange in the second log is reported as a contradiction; two equal logs are not."""
    motions = [fourier_motion(arm, seed) for seed in (0, 1)]
    plant = arm_plant(torque_noise=0.01)
    first, second = (simulate(plant, motion, seed=seed) for seed, motion in enumerate(motions))
    assert identify(arm, [first, second]).choice.contradiction is None
    body = np.array([2.0, 0.4, 0, 0, 0, 0, 0, 0.08, 0, 0.08])
    with_load = replace(plant, parameters=with_body(plant.model, plant.parameters, body))
    loaded = simulate(with_load, motions[1], seed=1)
    estimate = identify(arm, [first, loaded])
    clash = estimate.choice.contradiction
    assert clash is not None
    assert clash.together > 4 * clash.alone
    assert any("contradict each other" in text for text in estimate.warnings)
