"""A base model fitted by least squares on filtered rows, as it is done without special software."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.linalg import lstsq
from scipy.ndimage import maximum_filter1d
from scipy.signal import butter, sosfiltfilt

from robots.common.arrays import Array

FIT_BAND = 5.0  # of the low-pass of torque and columns before the fit [Hz]: above it, accelerations are poorly known
LOW_PASS_ORDER = 4  # of the low-passes


@dataclass(frozen=True, kw_only=True)
class Motion:
    """A motion by low-passed positions: t (N,) [s], q, v, a (N, n)."""

    t: Array
    q: Array
    v: Array
    a: Array

    @property
    def period(self) -> float:
        """The sample period [s]."""
        return float(np.median(np.diff(self.t)))


@dataclass(frozen=True, kw_only=True)
class BaseFit:
    """A fit of the base model, and of further columns beside it.

    Attributes:
        columns: of the base model, filtered (M, n, p).
        parameters: of base model and further columns.
        residual: filtered torque minus the model's (M, n) [N m].
        counted: rows (M, n) of the fit.
    """

    columns: Array
    parameters: Array
    residual: Array
    counted: NDArray[np.bool_]


def motion_of(t: Array, q: Array) -> Motion:
    """Filters positions without lag and differentiates them.

    Args:
        t: uniform times (N,) [s].
        q: positions (N, n) [rad].
    """
    period = float(np.median(np.diff(t)))
    # Low-pass of positions [Hz].
    smooth = sosfiltfilt(butter(LOW_PASS_ORDER, 2 * period * 30.0, output="sos"), q, axis=0)
    v = np.gradient(smooth, period, axis=0, edge_order=2)
    return Motion(t=t, q=smooth, v=v, a=np.gradient(v, period, axis=0, edge_order=2))


def base_columns(model: pin.Model, motion: Motion) -> Array:
    """Builds the regressor (N, n, 16 n): links, four friction terms, rotor inertia and offset of each joint."""
    n, data = model.nv, model.createData()
    columns = np.zeros((len(motion.t), n, 16 * n))
    for k in range(len(motion.t)):
        columns[k, :, : 10 * n] = pin.computeJointTorqueRegressor(model, data, motion.q[k], motion.v[k], motion.a[k])
    for j in range(n):
        v, first = motion.v[:, j], 10 * n + 6 * j
        # Below 0.005 rad/s filtered positions show no direction: the sign of Coulomb friction is smooth there.
        own = (np.tanh(v / 0.005), v, v * np.abs(v), v**3, motion.a[:, j], np.ones(len(v)))
        columns[:, j, first : first + 6] = np.column_stack(own)
    return columns


def filtered(values: Array, period: float) -> Array:
    """Filters values (N, ...) by the same low-pass as the torque, and keeps the rows (M, ...) that are needed.

    Args:
        values: any rows of a log.
        period: sample period [s].
    """
    slow = sosfiltfilt(butter(LOW_PASS_ORDER, 2 * period * FIT_BAND, output="sos"), values, axis=0)
    return np.asarray(slow[_kept(len(slow), period)])


def away_from_reversals(motion: Motion) -> NDArray[np.bool_]:
    """Flags rows (M, n), of those that `filtered` keeps, that are more than 0.25 s from a reversal of the joint."""
    turned = np.zeros(motion.v.shape, dtype=bool)
    turned[1:] = np.sign(motion.v[1:]) != np.sign(motion.v[:-1])
    # Near a reversal filtered positions do not show the friction's jump.
    near = maximum_filter1d(turned, 2 * round(0.25 / motion.period) + 1, axis=0)
    return ~np.asarray(near)[_kept(len(turned), motion.period)]


def _kept(rows: int, period: float) -> slice:
    # Filters err at both ends of a log [s].
    ends = round(0.5 / period)
    # So many samples per period of the band's edge are left.
    return slice(ends, rows - ends, max(round(1 / (2.5 * FIT_BAND * period)), 1))


def fit(columns: Array, tau: Array, counted: NDArray[np.bool_], extra: Array | None = None) -> BaseFit:
    """Fits the base model by least squares, each joint weighted by the inverse of its torque RMS.

    Args:
        columns: of the base model, filtered (M, n, p).
        tau: filtered torque (M, n) [N m].
        counted: rows (M, n) that the fit uses.
        extra: further filtered columns (M, n, k), or None.
    """
    Y = columns if extra is None else np.concatenate([columns, extra], axis=2)
    level = np.sqrt((tau**2).mean(axis=0))
    chosen = counted.reshape(-1)
    rows = (Y / level[:, None]).reshape(-1, Y.shape[2])[chosen]
    scale = np.sqrt((rows**2).sum(axis=0))
    scale[scale == 0] = 1.0
    # Smaller singular values extrapolate badly and are left out.
    found = lstsq(rows / scale, (tau / level).reshape(-1)[chosen], cond=1e-3)[0] / scale
    return BaseFit(columns=columns, parameters=found, residual=tau - Y @ found, counted=counted)
