from itertools import pairwise

import numpy as np
import pytest

from estimation.gate.quick_fits.delays import _remaining, _Search, estimate_delays
from estimation.gate.quick_fits.excerpts import excerpts_of, stretch
from estimation.gate.quick_fits.joint_columns import OWN
from estimation.gate.quick_fits.joint_fit import Rows
from estimation.gate.quick_fits.rigid_body import joint_rows, rigid_body, used_columns
from estimation.gate.quick_fits.whole_fit import fit_all


@pytest.fixture(scope="module")
def rows(er3a, good):
    log = good()
    parts = [stretch(log, log.tau, piece, 0.004) for piece in (slice(0, 2500), slice(2500, 5000))]
    return Rows.of(er3a, excerpts_of(parts, 0.004, 12.0))


def test_joint_rows_are_those_of_the_rigid_body(er3a):
    """Each joint's columns are the regressor's, and those left out are zero."""
    states = np.random.default_rng(0).normal(size=(3, 40, er3a.n))
    Y = rigid_body(er3a).regressor(*states, backend="vectorised")
    for joint, (found, used) in enumerate(zip(joint_rows(er3a, *states), used_columns(er3a), strict=True)):
        np.testing.assert_allclose(found, Y[:, joint, used], rtol=1e-12, atol=1e-12)
        assert not np.delete(Y[:, joint], used, axis=1).any()


def test_rounding_is_no_column(er3a, rows):
    """Columns of rounding errors are set to zero: a joint on a vertical axis has some."""
    scaled = rows.joints[0].Y
    size = np.sqrt(np.mean(scaled**2, axis=0))
    np.testing.assert_allclose(size[size > 0], 1.0, rtol=1e-9)
    body = rigid_body(er3a).regressor(rows.q, rows.dq, rows.ddq)[:, 0, rows.joints[0].used]
    silent = np.abs(body).max(axis=0) < 1e-10
    assert silent.any()
    assert not scaled[:, : len(silent)][:, silent].any()


@pytest.mark.slow
def test_the_whole_fit_leaves_out_each_fold(er3a, rows):
    """Errors on held-out sixths equal those of dense ridge regression, row by row."""
    n, p = er3a.n, rows.bodies
    wide = np.zeros((len(rows.q), n, p + OWN * n))
    for joint, own in enumerate(rows.joints):
        wide[:, joint, own.used] = own.Y[:, :-OWN] * own.scale[:-OWN]
        wide[:, joint, p + OWN * joint : p + OWN * (joint + 1)] = own.Y[:, -OWN:] * own.scale[-OWN:]
    tau = np.column_stack([rows.torque(joint) for joint in range(n)])
    spread, ridge = np.array([rows.spread(joint) for joint in range(n)]), 1e-4
    # A row in which a joint stands counts neither by its columns nor by its torque.
    wide[rows.rest] = tau[rows.rest] = 0.0
    acts = wide.any(axis=(0, 1))
    wide = wide[:, :, acts] / np.sqrt((wide[:, :, acts] ** 2).sum(axis=1).mean(axis=0))

    def solve(keep, weights):
        root = np.sqrt(weights)
        Y = (wide[keep] * root[:, None]).reshape(-1, wide.shape[2])
        length = np.linalg.norm(Y, axis=0)
        stacked = np.vstack([Y / length, np.sqrt(ridge) * np.eye(len(length))])
        right = np.concatenate([(tau[keep] * root).reshape(-1), np.zeros(len(length))])
        return np.linalg.lstsq(stacked, right, rcond=None)[0] / length

    bounds = np.linspace(0, len(tau), 7).astype(int)
    everything = np.arange(len(tau))
    weights = 1.0 / spread**2
    for _ in range(3):
        # The fit computes weights with a ridge of 1e-6. The difference to 1e-4 is far below the tolerance.
        weights = 1.0 / np.mean((tau - wide @ solve(everything, weights)) ** 2, axis=0) * (~rows.rest).mean(axis=0)
    error = np.zeros(n)
    for first, stop in pairwise(bounds):
        values = solve(np.r_[0:first, stop : len(tau)], weights)
        error += ((tau[first:stop] - wide[first:stop] @ values) ** 2).sum(axis=0)
    found = fit_all(rows.moments(np.arange(n)), spread, (ridge,)).unexplained
    np.testing.assert_allclose(found, np.sqrt(error / (~rows.rest).sum(axis=0)) / spread, rtol=0.01)


def test_linear_interpolation_is_near_the_spline(rows):
    """Linear interpolation between samples is that of the spline, to 1 % of the torque's spread."""
    shifts = np.array([-0.0301, -0.002, 0.0, 0.0033])
    for joint in range(2):
        near = rows.near_torques(shifts, joint, 3)
        for found, shift in zip(near, shifts, strict=True):
            exact = rows.torques(float(shift))[rows.thinned(3), joint]
            np.testing.assert_allclose(found, exact, atol=0.01 * exact.std())


@pytest.mark.parametrize("delay", [0.0, 0.007, -0.013])
def test_the_search_finds_the_best_of_all_shifts(er3a, good, delay):
    """The search on some rows, then near the best on all rows, ends at the best of all shifts on all rows."""
    log = good()
    shifted = np.column_stack([np.interp(log.t - delay, log.t, column) for column in log.tau.T])
    (part,) = excerpts_of([stretch(log, shifted, slice(50, 4950), 0.004)], 0.004, 12.0)
    rows = Rows.of(er3a, [part])
    fits = {joint: rows.fit(joint) for joint in range(er3a.n)}
    shifts = np.linspace(-0.04, 0.04, 25)
    search = _Search(rows, fits, shifts)
    for joint, fit in fits.items():
        errors = [_remaining(fit, rows.torques(float(shift))[fit.counted, joint]) for shift in shifts]
        assert search.best(joint) == int(np.argmin(errors))
    found = estimate_delays(rows, fits, 0.004, 12.0, np.zeros(er3a.n))
    # An inner joint's delay is known to a fraction of a millisecond.
    assert found[1].value == pytest.approx(delay, abs=1e-3)
