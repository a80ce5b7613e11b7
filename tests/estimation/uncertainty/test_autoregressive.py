import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.signal import lfilter

from estimation.uncertainty import Noise
from estimation.uncertainty.autoregressive import HIGHEST_NOISE_ORDER, autocovariance, fit_noise

SAMPLES = 20_000


def process(coefficients, samples=SAMPLES, seed=0, scale=1.0):
    rng = np.random.default_rng(seed)
    driven = scale * rng.standard_normal(samples + 2000)
    return lfilter([1.0], np.concatenate([[1.0], -np.asarray(coefficients)]), driven)[2000:]


def fitted(residual):
    counts = np.full(residual.shape[1], float(len(residual)))
    own = np.stack([autocovariance(column, count) for column, count in zip(residual.T, counts, strict=True)])
    return fit_noise(residual, counts, own)


@pytest.mark.parametrize("truth", [[0.9], [-0.5], [1.2, -0.5], [0.3, 0.4]])
def test_coefficients_are_recovered(truth):
    """The fit of an AR(1) or AR(2) process finds its coefficients, and next to nothing beyond their order."""
    noise = fitted(process(truth, scale=2.0)[:, None])
    found = np.zeros(HIGHEST_NOISE_ORDER)
    found[: len(noise.coefficients[0])] = noise.coefficients[0]
    expected = np.zeros(HIGHEST_NOISE_ORDER)
    expected[: len(truth)] = truth
    # 1/sqrt(N) is 0.007, the standard error of a coefficient; five of them.
    np.testing.assert_allclose(found, expected, atol=0.035)
    assert noise.covariance[0, 0] == pytest.approx(4.0, rel=0.05)  # a variance of 20000 draws: 1 %


@pytest.mark.parametrize(("truth", "order"), [([], 0), ([0.9], 1), ([1.2, -0.5], 2)])
def test_the_order_is_not_too_low_and_rarely_too_high(truth, order):
    """Akaike's order is the true one or more, and in the median of 30 processes at most one above."""
    orders = [len(fitted(process(truth, samples=4000, seed=seed)[:, None]).coefficients[0]) for seed in range(30)]
    assert min(orders) >= order
    # Akaike keeps one coefficient too many in 16 % of cases, and more in some; the median stays.
    assert np.median(orders) <= order + 1


def test_whitening_gives_innovations():
    """Filtering a process by its own model leaves what drove it: white, of the innovations' variance."""
    residual = process([1.2, -0.5])[:, None]
    white = fitted(residual).whitened(residual)[100:, 0]
    correlation = autocovariance(white, len(white), 20) / white.var()
    # 20 correlations of standard error 0.007 each.
    assert np.abs(correlation[1:]).max() < 0.03
    np.testing.assert_allclose(Noise((np.array([0.6]),), np.eye(1)).whitened(np.ones((3, 1)))[:, 0], [1, 0.4, 0.4])


def test_the_autocovariance_is_the_sum_of_products():
    """Products at each lag, summed over the rows and divided by the count that is given."""
    series = np.random.default_rng(0).normal(size=300)
    direct = [series[: 300 - lag] @ series[lag:] / 250 for lag in range(6)]
    np.testing.assert_allclose(autocovariance(series, 250, 5), direct, rtol=1e-10, atol=1e-12)


def test_drawn_noise_has_the_colour_and_the_correlation_of_its_model():
    """Simulated noise has the model's closed-form variance, and its joints the stated correlation of innovations."""
    noise = Noise((np.array([0.9]), np.array([])), np.array([[1.0, 0.6], [0.6, 2.0]]))
    drawn = noise.simulated(200_000, np.random.default_rng(0))
    # The variance of AR(1) is 1 / (1 - a^2); its estimate from correlated rows has a standard error of 1 %.
    assert drawn[:, 0].var() == pytest.approx(1 / (1 - 0.81), rel=0.04)
    assert drawn[:, 1].var() == pytest.approx(2.0, rel=0.02)
    innovations = noise.whitened(drawn)[1:]
    np.testing.assert_allclose(np.cov(innovations.T), noise.covariance, atol=0.03)


def test_correlated_joints_are_found():
    """Innovations that joints share show in the covariance that is fitted."""
    rng = np.random.default_rng(0)
    shared = rng.multivariate_normal([0, 0], [[1.0, 0.8], [0.8, 1.0]], SAMPLES)
    residual = np.column_stack([lfilter([1.0], [1.0, -0.9], shared[:, 0]), lfilter([1.0], [1.0, -0.5], shared[:, 1])])
    covariance = fitted(residual).covariance
    # Standard error of a correlation of 20000 rows: 0.003.
    assert covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1]) == pytest.approx(0.8, abs=0.015)


def test_joints_that_mirror_each_other_do_no_harm():
    """Identical, or exactly vanishing, residuals give a covariance that can be factorised."""
    one = process([0.5], samples=2000)
    for residual in (np.column_stack([one, one, -one]), np.zeros((2000, 2))):
        assert np.isfinite(np.linalg.cholesky(fitted(residual).covariance)).all()


def test_the_process_is_stable():
    """A residual with a slow drift gives a stable model all the same."""
    drifting = (np.linspace(-1, 1, 4000) + 0.01 * process([], samples=4000))[:, None]
    (coefficients,) = fitted(drifting).coefficients
    assert np.abs(np.roots(np.concatenate([[1.0], -coefficients]))).max() < 1
    assert np.linalg.eigvalsh(toeplitz(autocovariance(drifting[:, 0], 4000.0))).min() > 0


@pytest.mark.parametrize("correlation_time", [0.04, 0.1])
def test_twice_akaike_s_order_holds_the_density_at_rest(correlation_time):
    """Half white, half correlated: Akaike's order loses some of the density at rest, twice that order next to none."""
    step, rows, rng = 0.004, 7500, np.random.default_rng(5)
    rho = np.exp(-step / correlation_time)
    expected = np.sqrt(0.5 + 0.5 * (1 + rho) / (1 - rho))
    ratios = []
    for _ in range(40):
        innovations = rng.standard_normal((2, rows + 2000))
        coloured = lfilter([np.sqrt(1 - rho**2)], [1.0, -rho], innovations[1])
        noise = (np.sqrt(0.5) * (innovations[0] + coloured))[2000:, None]
        own = autocovariance(noise[:, 0], rows)[None]
        fits = [fit_noise(noise, np.array([rows]), own, times) for times in (1, 2)]
        ratios.append([np.sqrt(fit.covariance[0, 0]) / (1 - fit.coefficients[0].sum()) / expected for fit in fits])
    once, twice = np.mean(ratios, axis=0)
    # The mean of 40 is known to a per cent; what is left of the loss is that of a density from so few rows.
    assert abs(twice - 1) < 0.04
    assert twice - once > 0.01
