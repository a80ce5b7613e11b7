"""Every criterion against numpy.linalg on the regressor itself, and its stand-ins against it."""

from __future__ import annotations

import numpy as np
import pytest

from oed.criteria import CRITERIA, CondDeterminant, Criterion, criterion, singular_values
from robots.common.errors import InputError
from robots.loading import load_robot
from robots.regressor import default_model

COND_WEIGHT = 0.7

# By numpy on Y itself: no eigenvalues of ours.
ORACLES = {
    "cond": np.linalg.cond,
    "d": lambda Y: np.linalg.slogdet(Y.T @ Y)[1],
    "a": lambda Y: np.trace(np.linalg.inv(Y.T @ Y)),
    "e": lambda Y: np.linalg.svd(Y, compute_uv=False)[-1],
    "i": lambda Y: np.trace(np.linalg.inv(Y.T @ Y)),  # in the directions of the task, which are all alike here
    "cond-d": lambda Y: np.log(np.linalg.cond(Y)) - np.linalg.slogdet(Y.T @ Y)[1] / (2 * Y.shape[1]),
}
# What the stand-ins are smooth versions of, as logarithms.
TARGETS = {
    "cond": lambda ev: np.log(ev[-1] / ev[0]) / 2,
    "d": lambda ev: -np.log(ev).sum() / (2 * len(ev)),
    "a": lambda ev: np.log((1 / ev).sum()) / 2,
    "e": lambda ev: -np.log(ev[0]) / 2,
    "i": lambda ev: np.log((1 / ev).sum()) / 2,
    "cond-d": lambda ev: np.log(ev[-1] / ev[0]) / 2 - np.log(ev).sum() / (2 * len(ev)),
}
EACH = pytest.mark.parametrize("name", list(CRITERIA))


def regressor(seed: int, columns: int = 12, spread: float = 2.0) -> np.ndarray:
    random = np.random.default_rng(seed)
    return random.normal(size=(200, columns)) * np.logspace(0, spread, columns)


def eigenvalues(seed: int, columns: int = 12) -> np.ndarray:
    return np.linalg.eigvalsh(regressor(seed, columns).T @ regressor(seed, columns))


@EACH
@pytest.mark.parametrize("seed", range(5))
def test_value(name: str, seed: int) -> None:
    """A criterion's value is what numpy.linalg computes from the regressor."""
    Y = regressor(seed)
    values = np.linalg.eigvalsh(Y.T @ Y)
    # Squaring loses half of the digits of cond = 1e2: 1e-16 * 1e4.
    assert criterion(name).value(values) == pytest.approx(ORACLES[name](Y), rel=1e-10)


@EACH
@pytest.mark.parametrize("sharpness", [1.0, 16.0, 64.0, 1024.0])
def test_gradient(name: str, sharpness: float) -> None:
    """A stand-in's gradient by the eigenvalues is exact."""
    chosen, values = criterion(name), eigenvalues(7)
    _, gradient = chosen.surrogate(values, sharpness)
    for i, value in enumerate(values):
        # Truncation of the central difference: (sharpness * step)^2 / 6 relative; rounding: 1e-16 / step.
        step = 1e-3 / sharpness * value
        ends = [chosen.surrogate(values + sign * step * np.eye(len(values))[i], sharpness)[0] for sign in (1, -1)]
        difference = (ends[0] - ends[1]) / (2 * step)
        assert gradient[i] * value == pytest.approx(difference * value, abs=1e-6 + 1e-12 * sharpness / 1e-3)


@EACH
def test_stand_in_bounds_from_above(name: str) -> None:
    """A stand-in is never below the criterion, and falls towards it as it gets sharper."""
    chosen = criterion(name)
    for seed in range(10):
        values = eigenvalues(seed)
        costs = [chosen.surrogate(values, p)[0] for p in (1.0, 4.0, 16.0, 64.0, 1024.0)]
        target = TARGETS[name](values)
        rounding = 1e-12
        assert costs[-1] >= target - rounding
        assert np.all(np.diff(costs) <= rounding)
        # log(m)/p for each of the two ends of the spectrum, halved.
        assert costs[-1] - target <= np.log(len(values)) / 1024.0 + rounding


@EACH
def test_limit_of_sharpness(name: str) -> None:
    """At infinite sharpness a stand-in is the criterion."""
    values = eigenvalues(3)
    assert criterion(name).surrogate(values, 1e9)[0] == pytest.approx(TARGETS[name](values), abs=1e-8)


def test_last_stand_in_is_within_half_a_percent() -> None:
    """The last stand-in of cond on 64 parameters exceeds it by less than half a percent, even in the worst spectrum."""
    ends = np.repeat([1.0, 100.0], 32)
    chosen = CRITERIA["cond"]()
    assert np.exp(chosen.surrogate(ends, chosen.finish[-1])[0]) / chosen.value(ends) < 1.005


@EACH
def test_cost_orders_as_the_value(name: str) -> None:
    """The smaller cost belongs to the better value."""
    chosen = criterion(name)
    one, other = eigenvalues(1), eigenvalues(2)
    better = chosen.value(one) > chosen.value(other)
    assert (chosen.cost(one) < chosen.cost(other)) == (better if chosen.larger_is_better else not better)


@EACH
def test_lost_eigenvalues(name: str) -> None:
    """Zero and negative eigenvalues, left by rounding, give finite numbers."""
    values = np.array([-1e-18, 0.0, 1.0, 2.0])
    chosen = criterion(name)
    cost, gradient = chosen.surrogate(values, 16.0)
    assert np.isfinite([chosen.value(values), cost]).all()
    assert np.isfinite(gradient).all()


@EACH
def test_more_rows_never_worsen_what_counts_information(name: str) -> None:
    """More measurements never make d, a and e worse."""
    if name in ("cond", "cond-d"):
        pytest.skip("a condition number may grow with more rows")
    Y = regressor(4)
    part, whole = (np.linalg.eigvalsh(rows.T @ rows) for rows in (Y[:100], Y))
    chosen = criterion(name)
    assert chosen.cost(whole) < chosen.cost(part)


def test_combination_weighs() -> None:
    """The combination adds the determinant with its weight, and says so."""
    values = eigenvalues(5)
    chosen = CondDeterminant(COND_WEIGHT)
    cond, volume = np.log(values[-1] / values[0]) / 2, np.log(values).mean() / 2
    assert chosen.value(values) == pytest.approx(cond - COND_WEIGHT * volume, rel=1e-12)
    assert "0.7" in chosen.label


def test_unknown_name() -> None:
    """An unknown criterion is answered with the known ones."""
    with pytest.raises(InputError, match=f"'f'.*{', '.join(CRITERIA)}"):
        criterion("f")


def test_own_criterion_passes() -> None:
    """A criterion of one's own is taken as it is."""
    own = CondDeterminant(2.0)
    assert criterion(own) is own
    assert isinstance(own, Criterion)


@pytest.mark.parametrize("samples", [3, 1999, 2001, 4500])
def test_singular_values_in_chunks(samples: int) -> None:
    """Singular values from chunks are those of the whole regressor; too few rows leave zeros."""
    model = default_model(load_robot("er3a"), friction="coulomb-viscous", velocity_scale=0.02, offset=False)
    columns = list(range(10, 40, 3))
    states = np.random.default_rng(0).normal(size=(3, samples, 6))
    Y = model.regressor(*states, columns=columns).reshape(-1, len(columns))
    expected = np.zeros(len(columns))
    found = np.linalg.svd(Y, compute_uv=False)
    expected[: len(found)] = found
    values = singular_values(model, columns, *states)
    # Orthogonal transformations: rounding of the largest value.
    np.testing.assert_allclose(values, expected[::-1], atol=1e-13 * expected[0])
    assert np.all(np.diff(values) >= 0)


def test_singular_values_of_too_few_rows() -> None:
    """A motion of fewer rows than columns leaves directions with a singular value of zero."""
    model = default_model(load_robot("er3a"), friction="coulomb-viscous", velocity_scale=0.02, offset=False)
    columns = list(range(10, 40))
    values = singular_values(model, columns, *np.random.default_rng(0).normal(size=(3, 2, 6)))
    assert values.shape == (30,)
    assert np.all(values[:18] == 0)
