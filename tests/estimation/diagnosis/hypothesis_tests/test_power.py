"""The chances of finding and of naming, against simulated least squares."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from estimation.diagnosis.calibration import POWER
from estimation.diagnosis.hypothesis_tests.power import (
    chance_to_resolve,
    detectable_energy,
    residual_energy,
    resolving_energy,
    size_per_energy,
    unit_mixtures,
)

DRAWS = 20_000


@pytest.mark.parametrize(("degrees", "tries"), [(1, 1), (2, 127), (4, 420)])
def test_an_effect_of_the_detectable_energy_is_found_as_often_as_said(degrees, tries):
    """Least squares of noise and an effect of that energy exceeds the false-alarm level with the stated chance."""
    energy = detectable_energy(degrees, tries)
    random = np.random.default_rng(0)
    mean = np.sqrt(energy) * np.eye(degrees)[0]
    found = (
        ((mean + random.standard_normal((DRAWS, degrees))) ** 2).sum(axis=1) > chi2.isf(0.01 / tries, degrees)
    ).mean()
    # Five standard errors of a share of 20,000 draws: it fails wrongly once in two million.
    assert found == pytest.approx(POWER, abs=5 * np.sqrt(POWER * (1 - POWER) / DRAWS))


def test_a_penalty_asks_for_more():
    """What the selection charges for parameters must be exceeded, too."""
    assert detectable_energy(2, 100, penalty=60.0) > detectable_energy(2, 100) > detectable_energy(1, 1)


@pytest.mark.parametrize("margin", [0.0, 10.0])
def test_a_rival_falls_out_as_often_as_said(margin):
    """Of two models fitted to the true one's data, the wrong one is worse by the margin with the stated chance."""
    random = np.random.default_rng(1)
    energy = resolving_energy(margin)
    a, b = np.array([1.0, 0.0, 0.0]), np.array([0.6, 0.8, 0.0])
    left = energy / (1 - (a @ b) ** 2)
    y = np.sqrt(left) * a + random.standard_normal((DRAWS, 3))
    # Twice the log-likelihood ratio with the true coefficient known: the noise of the fit cancels between the two.
    difference = (y @ a) ** 2 - (y @ b) ** 2
    assert (difference > margin).mean() == pytest.approx(POWER, abs=0.02)  # normal to second order in 1 / energy
    assert chance_to_resolve(energy, margin) == pytest.approx(POWER, abs=1e-9)
    assert chance_to_resolve(0.0) == 0.0


def test_what_a_rival_leaves_is_a_projection():
    """The energy beside a rival is that of the columns projected off the rival's."""
    random = np.random.default_rng(2)
    A, B = random.normal(size=(50, 2)), random.normal(size=(50, 3))
    A[:, 0] += B[:, 0]
    Q = np.linalg.qr(B)[0]
    expected = A.T @ (A - Q @ (Q.T @ A))
    got = residual_energy(A.T @ A, A.T @ B, B.T @ B, np.sum(B**2, axis=0))
    np.testing.assert_allclose(got, expected, atol=1e-10)


def test_the_size_of_one_column_is_its_root_mean_square():
    """A column of energy E and mean square s has the size sqrt(s / E) per unit of energy, whatever its scale."""
    assert size_per_energy(unit_mixtures(np.array([[4.0]])), np.array([[25.0]])) == pytest.approx(0.4)
    assert size_per_energy(unit_mixtures(1e6 * np.array([[4.0]])), 1e6 * np.array([[25.0]])) == pytest.approx(0.4)
    assert size_per_energy(unit_mixtures(np.array([[4.0]])), np.array([[0.0]])) == np.inf
    assert size_per_energy(unit_mixtures(np.array([[0.0]])), np.array([[0.0]])) == np.inf


def test_the_size_does_not_depend_on_the_units():
    """Columns in other units give the same typical size."""
    random = np.random.default_rng(3)
    X = random.normal(size=(40, 3))
    gram, left = X.T @ X, X.T @ np.diag(random.uniform(0.1, 1, 40)) @ X
    units = np.diag([1e-3, 5.0, 1e4])
    scaled = size_per_energy(unit_mixtures(units @ gram @ units), units @ left @ units)
    assert scaled == pytest.approx(size_per_energy(unit_mixtures(gram), left), rel=0.25)  # other mixtures are drawn
