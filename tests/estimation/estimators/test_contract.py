import numpy as np
import pytest

from estimation.estimators import ESTIMATORS, OrdinaryLeastSquares, WeightedLeastSquares, estimator
from estimation.moments import Moments
from robots.common.errors import InputError

ALL = [*(kind() for kind in ESTIMATORS.values()), WeightedLeastSquares(temper=1.0), WeightedLeastSquares(temper=0.0)]
TRUTH = np.array([2.0, -1.0, 0.5, 3.0])


def moments_of(noise, seed=0, rows=400):
    rng = np.random.default_rng(seed)
    Y = rng.normal(size=(rows, len(noise), len(TRUTH)))
    tau = Y @ TRUTH + rng.normal(size=(rows, len(noise))) * noise
    return Moments.of(Y, tau, np.ones_like(tau))


@pytest.mark.parametrize("member", ALL, ids=lambda member: f"{member.name}-{getattr(member, 'temper', '')}")
class TestContract:
    """What every estimator keeps."""

    def test_exact_data_give_the_truth(self, member):
        """Without noise the parameters come back exactly."""
        values, _ = member.solve(moments_of(np.zeros(3)), 0.0)
        np.testing.assert_allclose(values, TRUTH, rtol=1e-9)

    def test_noisy_data_give_the_truth_on_average(self, member):
        """The mean over 200 noisy fits is the truth within four standard errors of a mean."""
        found = np.array([member.solve(moments_of(np.array([0.1, 1.0, 3.0]), seed), 0.0)[0] for seed in range(200)])
        error = (found.mean(axis=0) - TRUTH) / (found.std(axis=0) / np.sqrt(200))
        # Four parameters: a wrong alarm in 1 of 4000 draws, and the draws are fixed.
        assert np.abs(error).max() < 4

    def test_weights_are_positive_and_one_a_joint(self, member):
        """Weights are finite and positive, even of a joint that fits exactly."""
        weights = member.weights(moments_of(np.array([0.0, 1.0, 3.0])), 1e-8)
        assert weights.shape == (3,)
        assert np.isfinite(weights).all()
        assert (weights > 0).all()

    def test_the_solution_is_that_of_its_weights(self, member):
        """Values are the moments' solution under the weights that are returned with them."""
        moments = moments_of(np.array([0.1, 1.0, 3.0]))
        values, weights = member.solve(moments, 1e-6)
        np.testing.assert_array_equal(values, moments.solve(weights, 1e-6))

    def test_units_of_torque_do_not_matter(self, member):
        """Torque in other units gives the parameters in those units."""
        moments = moments_of(np.array([0.1, 1.0, 3.0]))
        scaled = Moments(moments.gram, 1000 * moments.cross, 1e6 * moments.square, moments.count)
        np.testing.assert_allclose(member.solve(scaled, 1e-8)[0], 1000 * member.solve(moments, 1e-8)[0], rtol=1e-9)


def test_ordinary_least_squares_counts_all_joints_alike():
    """Its weights are ones."""
    assert (OrdinaryLeastSquares().weights(moments_of(np.array([0.1, 1.0, 3.0])), 0.0) == 1).all()


def test_full_weights_are_the_inverse_variance():
    """With temper 1, weights are inverse residual variances: of 400 rows, within 20 %."""
    noise = np.array([0.1, 1.0, 3.0])
    weights = WeightedLeastSquares(temper=1.0).weights(moments_of(noise), 0.0)
    # 400 rows know a variance to 7 %; the first, unweighted fit adds a per cent to the quiet joint's.
    np.testing.assert_allclose(weights, noise**-2, rtol=0.35)
    half = WeightedLeastSquares(temper=0.5).weights(moments_of(noise), 0.0)
    np.testing.assert_allclose(half, np.sqrt(weights), rtol=1e-12)


def test_weighting_pays_where_noise_differs():
    """Under unequal noise, weighted least squares scatters less than ordinary least squares."""
    noise = np.array([0.1, 1.0, 3.0])
    spread = {
        kind: np.std([ESTIMATORS[kind]().solve(moments_of(noise, seed), 0.0)[0] for seed in range(100)], axis=0)
        for kind in ("wls", "ols")
    }
    assert (spread["wls"] < 0.6 * spread["ols"]).all()


def test_estimators_are_found_by_name():
    """A name gives its estimator, an estimator itself; an unknown name is refused with the names that exist."""
    assert isinstance(estimator("wls"), WeightedLeastSquares)
    own = OrdinaryLeastSquares()
    assert estimator(own) is own
    with pytest.raises(InputError, match="method 'kalman'; allowed: wls, ols"):
        estimator("kalman")


@pytest.mark.parametrize("temper", [-0.1, 1.1, np.nan])
def test_a_temper_out_of_range_is_refused(temper):
    """The temper is a number from 0 to 1."""
    with pytest.raises(InputError, match="allowed: 0 to 1"):
        WeightedLeastSquares(temper=temper)
