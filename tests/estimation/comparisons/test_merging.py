"""The merged estimate, and between-run variance."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.comparisons import compare, run_of
from estimation.comparisons.common_parameters import common_parameters
from estimation.comparisons.merging import between_run_variance, merge


def test_between_run_variance_is_that_of_dersimonian_and_laird():
    """The moment estimator in closed form, and zero for runs that agree.

    tau^2 = (Q - (k - 1)) / (sum w - sum w^2 / sum w).
    """
    values, variances = np.array([0.1, 0.9, 0.4, 1.4]), np.array([0.04, 0.09, 0.01, 0.04])
    w = 1 / variances
    Q = w @ (values - w @ values / w.sum()) ** 2
    expected = (Q - 3) / (w.sum() - (w**2).sum() / w.sum())
    assert between_run_variance(values[:, None], variances[:, None]) == pytest.approx([expected])
    assert between_run_variance(np.ones((3, 1)), np.ones((3, 1))) == pytest.approx([0.0])


def test_agreeing_runs_merge_to_the_weighted_mean(draw, covariance):
    """Runs with covariances C and C / 4 that agree exactly are merged to their common value with covariance C / 5."""
    one = draw(1)
    other = replace(one, values=one.values * (1 + 1e-9), covariance=covariance / 4)
    merged = compare([one, other]).merged
    assert merged.model.values == pytest.approx(one.values, rel=1e-6)
    assert merged.model.covariance == pytest.approx(covariance / 5, rel=1e-5, abs=1e-12)
    assert merged.scatter == pytest.approx(np.zeros(len(one.values)))


@pytest.mark.slow
def test_merged_errors_are_honest(draw, truth):
    """Over 40 draws of four runs the merged estimate's 95 % intervals hold the truth in 92 % or more.

    Intervals of 37 parameters with correlated errors: the share scatters by about 1 % over seeds; between-run
    variances that are truncated at zero make the intervals wider, not narrower.
    """
    z = []
    for seed in range(40):
        runs = [run_of(draw(4 * seed + k), f"run {k}") for k in range(4)]
        model = merge(runs, common_parameters(runs, np.ones(3))).model
        z.append((model.values - truth) / model.standard_errors)
    assert np.mean(np.abs(z) < 1.96) >= 0.92


def test_runs_that_differ_have_wider_errors(draw):
    """Friction that differs between runs by far more than its errors widens its merged errors, and only those."""
    same, apart = (compare([draw(k, (1.0 + step * k, 1.0, 1.0)) for k in range(5)]).merged.model for step in (0.0, 0.2))
    ratio = apart.standard_errors / same.standard_errors
    friction = [c.friction and c.joint == 1 for c in apart.parameters]
    assert ratio[friction].min() > 3
    index = next(i for i, c in enumerate(apart.parameters) if c.friction and c.joint == 1)
    spread = np.std(0.2 * np.arange(5), ddof=1) * 2.0 / np.sqrt(5)  # f1 of joint 1 is 2 N m
    assert apart.standard_errors[index] == pytest.approx(spread, rel=0.2)


def test_the_prior_does_not_average_out(draw):
    """Where the prior makes all of a parameter's error, merging does not make it smaller."""
    pulled = [1.0] * len(draw(0).values)
    models = [draw(k, prior_share=pulled) for k in range(6)]
    merged = compare(models).merged.model
    assert merged.standard_errors == pytest.approx(models[0].standard_errors, rel=1e-6)


def test_models_that_do_not_state_the_prior_are_noted(draw):
    """Without the share of the prior the merged errors are those of single runs, and a note says so."""
    one, two = draw(1), draw(2)
    bare = [replace(m, provenance={k: v for k, v in m.provenance.items() if k != "prior_share"}) for m in (one, two)]
    found = compare(bare)
    assert found.merged.model.standard_errors == pytest.approx(one.standard_errors, rel=0.5)
    assert (found.merged.model.standard_errors >= 0.999 * one.standard_errors).all()
    assert any("the prior makes" in warning for warning in found.warnings)
