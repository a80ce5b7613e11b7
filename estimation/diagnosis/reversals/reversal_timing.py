"""Lag of torque behind motion at each joint's reversals, by the balance of impulses in position and torque."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimation.diagnosis.base_models.baseline import Baseline
from estimation.diagnosis.base_models.payload_and_gravity import base_torque
from estimation.diagnosis.recordings.recording import Recording
from estimation.diagnosis.reversals.reversal_impulses import (
    FEWEST,
    ImpulseResponse,
    Reversals,
    edges_of,
    find_reversals,
    impulse_columns,
    shift_reversals,
)
from robots.common.arrays import Array
from robots.common.forks import forked

ROUNDS = 3
# Fewest distinct reversals for an estimate of their scatter.
FEWEST_KINDS = 3
# Factor on standard errors of the mean pulse: its edges and the times of reversals are approximate.
LARGER = 1.15
# Standard errors from which a velocity error at reversals is significant.
SURE = 2.0
# Standard deviation of a uniform distribution of unit width: when an impulse acts within the gap is unknown.
ANYWHERE = 12**-0.5
# Mean squares of the residuals of position and torque, over their noise, up to which the fit is valid.
QUIET = (1.25, 1.4)
# Largest error of a reversal's time [s], and largest lag as a share of the gap: beyond the gap no friction jump is
# seen.
KNOWN, WITHIN = 1e-3, 0.75
# If rows near a joint's reversals count, the impulses are used only if their error is below this share of that of the
# rows.
BETTER = 0.5
# Regularisation of the fit, as a share of the mean eigenvalue. Distance [s] from the gap at which the force beside it
# is evaluated.
FAINT, BESIDE = 1e-9, 1e-3
# Time [s] about reversals in which the fit is made, and its residuals are checked.
ABOUT = 0.2
# Multiple of the median up to which values count in a signal's level.
USUAL = 5.0


@dataclass(frozen=True, eq=False)
class ReversalTiming:
    """Lag of torque behind motion, as measured at reversals.

    Attributes:
        lags: lag of torque (n,) [s], by each joint.
        errors: their standard errors (n,) [s]; infinite for joints without a measurement.
        kicks: significant velocity errors of the low-passed motion at reversals (n,) [rad/s or m/s]; zero for others.
    """

    lags: Array
    errors: Array
    kicks: Array

    @property
    def residual(self) -> Array:
        """Lags over their standard errors (n,)."""
        return np.asarray(self.lags / self.errors)

    def column(self, joints: Sequence[int]) -> Array:
        """Returns the column of a lag of all torques (n, 1), as some joints (from 0) measure it, over their errors."""
        return np.where(np.isin(np.arange(len(self.errors)), joints), 1.0 / self.errors, 0.0)[:, None]

    def beside(self, recording: Recording) -> ReversalTiming | None:
        """Drops joints whose rows at reversals count, unless impulses are far more accurate than these rows.

        Args:
            recording: the data.

        Returns:
            The timing of the remaining joints; None if there are none.
        """
        errors = self.errors.copy()
        for j in np.flatnonzero(recording.counted_rows):
            assert recording.reversal_time_error is not None
            turns = recording.dq[1:, j] * recording.dq[:-1, j] < 0
            late = np.sqrt(np.mean(recording.reversal_time_error[:-1, j][turns] ** 2)) if turns.any() else 0.0
            if errors[j] > BETTER * late:
                errors[j] = np.inf
        return replace(self, errors=errors) if np.isfinite(errors).any() else None


def measure_reversal_timing(
    recording: Recording, baseline: Baseline, values: Array, residual: Array, extra: Array | None = None
) -> ReversalTiming | None:
    """Measures the lag of torque behind motion at each joint's reversals.

    If torque is logged late, its friction jump is late by the same time. Low-passed positions show a reversal only to
    some milliseconds. Coulomb friction excites the joint there with nearly the same force each time. The position loop
    compensates it, and encoder noise hides the response. Torque shows that force beyond the base model, except close to
    the reversal, where late friction would look the same. The mean of positions over all reversals shows the total
    velocity change due to the force. The rest of the torque's impulse is due to friction: twice the Coulomb friction
    times the lag.

    Args:
        recording: the data.
        baseline: the base model on it.
        values: its parameters (b,).
        residual: torque minus base model and known effects (N, n) [N m or N].
        extra: torque of the known effects (N, n) [N m or N]; None for none.

    Returns:
        The timing; None if the positions were not logged at the rows of the grid.
    """
    base = baseline.base
    if recording.full_rate is not None:
        own = recording.full_rate
        residual = own.tau - base_torque(base, own, values)
        if extra is not None:
            residual -= np.column_stack([np.interp(own.t, recording.t, column) for column in extra.T])
        recording = own
    if recording.position_residual is None or recording.cutoffs is None:
        return None
    lags, errors, kicks = np.zeros(recording.n), np.full(recording.n, np.inf), np.zeros(recording.n)
    coulomb = {column.joint - 1: i for i, column in enumerate(base.columns) if column.symbol == "f1"}
    signs = base_torque(base, recording, np.isin(np.arange(base.size), list(coulomb.values())).astype(float))

    def measured(j: int) -> tuple[float, float, float] | None:
        turns = find_reversals(recording, j, base, values)
        if turns is None:
            return None
        return _joint(recording, j, turns, residual[:, j], float(abs(values[coulomb[j]])), signs[:, j])

    for j, found in zip(coulomb, forked(measured, coulomb), strict=True):
        if found is not None:
            lags[j], errors[j], kicks[j] = found
    return ReversalTiming(lags, errors, kicks)


@dataclass(frozen=True, eq=False)
class _Impulse:
    """Mean force pulse at a joint's reversals.

    Attributes:
        at: times (R,) of the reversals, in rows.
        force: pulses at all rows (N,) [N m or N].
        gap: rows on either side of a reversal in which torque is not used.
        velocity: velocity change due to the pulse at the reversal, times the inertia, and its error [N m s or N s].
        impulse: impulse in the gap beyond that of the forces beside it [N m s or N s].
        error: error of the whole impulse in the gap [N m s or N s].
    """

    at: Array
    force: Array
    gap: float
    velocity: tuple[float, float]
    impulse: float
    error: float


def _joint(
    recording: Recording, j: int, turns: Reversals, force: Array, friction: float, sign: Array
) -> tuple[float, float, float] | None:
    """Measures a joint's lag [s], its error [s], and its velocity error [rad/s or m/s]; None if the fit is invalid."""
    kick = _fit_impulse(recording, j, turns, force) if friction > 0 else None
    if kick is None:
        return None
    rate = np.abs(np.interp(kick.at, np.arange(len(force)), recording.ddq[:, j]))
    usual = float(np.mean(turns.inertia))
    # A velocity error delays the sign change by the error over the acceleration.
    wrong = float(np.hypot(kick.velocity[1], ANYWHERE * kick.impulse)) / usual
    velocity = abs(kick.velocity[0]) / usual if abs(kick.velocity[0]) > SURE * kick.velocity[1] else 0.0
    torque, lags = force - kick.force + friction * sign, np.full(len(kick.at), np.nan)
    for r in np.flatnonzero(rate > wrong / KNOWN):
        rows, moment = recording.runs[turns.run[r]], kick.at[r]
        start, stop = int(np.ceil(moment - kick.gap)), int(moment + kick.gap) + 1
        if start >= rows.start and stop <= rows.stop:
            x = np.arange(start, stop) - moment
            impulse = np.sum(np.sign(x) * friction - turns.way[r] * torque[start:stop]) * recording.step
            lags[r] = impulse / (2 * friction)
    used = np.isfinite(lags)
    kinds, which = np.unique(turns.kind[used], return_inverse=True)
    if used.sum() < FEWEST or len(kinds) < FEWEST_KINDS:
        return 0.0, np.inf, velocity
    lag, counts = float(np.mean(lags[used])), np.bincount(which)
    apart = np.bincount(which, lags[used]) - counts * lag
    scatter = float(np.sqrt(np.sum(apart**2) * len(kinds) / (len(kinds) - 1)) / counts.sum())
    error = float(np.hypot(np.hypot(scatter, wrong * np.mean(1.0 / rate[used])), kick.error / (2 * friction)))
    if abs(lag) > WITHIN * kick.gap * recording.step:
        return 0.0, np.inf, velocity
    return lag, error, velocity


def _fit_impulse(recording: Recording, j: int, turns: Reversals, force: Array) -> _Impulse | None:
    """Fits the mean pulse to a joint's positions and, outside the gaps, its torque; None if the fit is invalid.

    The low-passed motion contains too little of it to exceed the encoder noise at a single reversal.
    """
    assert recording.position_residual is not None
    assert recording.cutoffs is not None
    rest, step, cutoffs = recording.position_residual[:, j], recording.step, recording.cutoffs[:, j]
    loud, noise = _level(rest), _level(force)
    if min(loud, noise, float(cutoffs.min())) <= 0:
        return None
    edges = edges_of(float(cutoffs.min()), step)
    tables, gap = [ImpulseResponse.of(float(f), step, edges) for f in cutoffs], edges[1]
    at = turns.at
    for _ in range(ROUNDS):
        columns, nearest, away = impulse_columns(recording, turns, at, tables)
        counted = away * step <= ABOUT
        beyond_gap = counted & (away * step > gap)
        design = np.concatenate([columns[0][counted] / loud, columns[2][beyond_gap] / noise])
        data = np.concatenate([rest[counted] / loud, force[beyond_gap] / noise])
        gram = design.T @ design
        inverse = np.linalg.inv(gram + FAINT * np.trace(gram) / len(gram) * np.eye(len(gram)))
        coefficients = inverse @ (design.T @ data)
        at = shift_reversals(recording, turns, at, recording.dq[:, j] + columns[1] @ coefficients)
    left = data - design @ coefficients
    position, torque = np.split(left, [int(counted.sum())])
    if np.mean(position**2) > QUIET[0] or np.mean(torque**2) > QUIET[1]:
        return None
    # The covariance adds the scatter between distinct reversals (cluster-robust) to that of independent samples.
    sums = np.zeros((turns.kind.max() + 1, len(gram)))
    np.add.at(sums, turns.kind[np.concatenate([nearest[counted], nearest[beyond_gap]])], design * left[:, None])
    kinds = len(np.unique(turns.kind))
    covariance = inverse + inverse @ (sums.T @ sums) @ inverse * kinds / max(kinds - 1, 1)
    _, speed, acceleration = tables[0].at(np.array([-gap - BESIDE, -gap, 0.0, gap, gap + BESIDE]))
    through = speed[3] - speed[1]

    def error(x: Array) -> float:
        return LARGER * float(np.sqrt(x @ covariance @ x))

    return _Impulse(
        at=at,
        force=columns[2] @ coefficients,
        gap=gap / step,
        velocity=(float(speed[2] @ coefficients), error(speed[2])),
        impulse=float((through - gap * (acceleration[0] + acceleration[4])) @ coefficients),
        error=error(through),
    )


def _level(x: Array) -> float:
    """Returns the root mean square of a signal (N,) without outliers."""
    usual = np.abs(x) < USUAL * np.median(np.abs(x))
    return float(np.sqrt(np.mean(x[usual] ** 2))) if usual.any() else 0.0
