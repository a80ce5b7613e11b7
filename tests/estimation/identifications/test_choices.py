from dataclasses import replace

import numpy as np
import pytest

from estimation import identify, predict
from estimation.estimators import WeightedLeastSquares
from estimation.identifications.choices import VELOCITY_SCALES, Candidates, choose
from estimation.regressions.preparation import prepare
from robots.base_parameters import find_base_parameters
from robots.plants import simulate
from robots.regressor import default_model
from tests.estimation.identifications.stops import stop_and_go


@pytest.fixture(scope="module")
def base(arm):
    return find_base_parameters(default_model(arm, velocity_scale=VELOCITY_SCALES[0]))


@pytest.fixture(scope="module")
def chosen(arm, base):
    def choose_for(*logs, **options):
        return choose(base, [prepare(arm, log) for log in logs], WeightedLeastSquares(), Candidates(**options))

    return choose_for


@pytest.mark.slow
def test_a_true_sign_stays_sharp(chosen, arm_log):
    """Where the truth is a sign, no joint gets a wider one."""
    choice = chosen(arm_log(velocity_scale=1e-4))
    assert choice.velocity_scales == (VELOCITY_SCALES[0],) * 2


@pytest.mark.slow
def test_a_wide_sign_is_found(chosen, arm_log):
    """Where friction changes sign over 0.05 rad/s, its width is found to the nearest candidates."""
    choice = chosen(arm_log(velocity_scale=0.05, torque_noise=0.005))
    assert all(0.02 <= scale <= 0.1 for scale in choice.velocity_scales)


@pytest.mark.slow
def test_noisy_encoders_ask_for_a_low_cutoff(chosen, arm_log):
    """Coarse encoders lower the cut-off; fine ones allow all that the motion holds."""
    fine, coarse = (chosen(arm_log(encoder_counts=counts)) for counts in (0.0, 3.0))
    assert coarse.cutoff < fine.cutoff
    # The motion's fifth harmonic is 0.5 Hz: a lower cut-off than 1.5 Hz would lose it.
    assert fine.cutoff >= 1.5


@pytest.mark.slow
def test_the_same_data_give_the_same_choice(chosen, arm_log):
    """Nothing in the choice is random."""
    first, again = chosen(arm_log()), chosen(arm_log())
    assert (first.cutoff, first.ridge, first.velocity_scales) == (again.cutoff, again.ridge, again.velocity_scales)
    assert np.array_equal(first.held_out, again.held_out)


@pytest.mark.slow
def test_good_data_are_predicted_to_the_noise(chosen, arm_log):
    """An exciting motion predicts left-out blocks to the noise, prior or not."""
    log = arm_log(torque_noise=0.02)
    noise = 0.02 * np.sqrt(np.mean(log.tau**2, axis=0))
    np.testing.assert_allclose(chosen(log).held_out, noise, rtol=0.1)


def test_candidates_are_what_is_chosen_from(chosen, arm_log):
    """A single candidate is taken as it is; cut-offs beyond the sampling are not tried."""
    assert chosen(arm_log(), cutoffs=(7.0, 1000.0), smoothers=()).cutoff == 7.0
    assert chosen(arm_log(), cutoffs=(1000.0,), smoothers=()).cutoff == pytest.approx(100.0)  # 0.4 of 250 Hz


@pytest.mark.slow
def test_several_logs_are_chosen_for_together(chosen, arm_log):
    """Blocks come from all logs; short ones count as blocks of their own."""
    long, short = arm_log(), arm_log(1, 1)
    choice = chosen(long, short.rows(slice(0, 600)))
    assert choice.cost < np.log(0.1)


@pytest.mark.slow
def test_a_standing_joint_does_no_better_than_a_constant(chosen, arm_log):
    """A joint that is held still is predicted by a constant only, and its cost counts as one."""
    log = arm_log()
    rng = np.random.default_rng(0)
    tau = np.column_stack([log.tau[:, 0], 3.0 + rng.normal(size=len(log))])
    still = replace(log, q=np.column_stack([log.q[:, 0], np.full(len(log), 0.3)]), tau=tau)
    for cutoff in (2.0, 5.0, 20.0, 50.0):  # what rounding leaves of its velocity depends on the filter
        choice = chosen(still, cutoffs=(cutoff,))
        assert choice.held_out[1] > 0.9 * choice.spread[1]


@pytest.mark.slow
def test_ideal_data_are_no_trouble(chosen, arm_log):
    """Without any noise the left-out error may be zero, and the cost is finite."""
    assert np.isfinite(chosen(arm_log(encoder_counts=0.0, torque_noise=0.0)).cost)


@pytest.mark.slow
def test_left_out_errors_are_those_of_a_prediction(arm, arm_plant):
    """Where joints start from rest, left-out errors are those of an unseen log, and the cut-off is among the best."""
    plant = arm_plant(torque_noise=0.02)
    known, unseen = (simulate(plant, stop_and_go(np.random.default_rng(seed))[0], seed=seed) for seed in (0, 1))
    scale = np.sqrt(np.mean(unseen.tau**2, axis=0) / np.mean(known.tau**2, axis=0))
    for cutoff in (12.0, 30.0):
        estimate = identify(arm, known, candidates=Candidates(cutoffs=(cutoff,), smoothers=()))
        # Other places, other torques: within a sixth. By moving rows alone it would be half of what a prediction has.
        np.testing.assert_allclose(
            estimate.choice.held_out * scale, predict(estimate.model, unseen).error_rms, rtol=1 / 6
        )
    # Moving rows are fitted alike from 12 Hz up; what separates cut-offs is how joints start and stop.
    assert identify(arm, known).choice.cutoff >= 30.0
