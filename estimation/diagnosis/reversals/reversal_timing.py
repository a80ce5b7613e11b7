"""How late torque is against each joint's reversals, by the balance of impulses there: position and torque together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

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

Array = NDArray[np.float64]

ROUNDS = 3
# Least number of kinds of reversals that determines their scatter.
FEWEST_KINDS = 3
# A mean differs from what each reversal did by more than its own scatter says: its edges, its moments.
LARGER = 1.15
# A kick is one from so many errors on.
SURE = 2.0
# When within the gap an impulse acts is not known.
ANYWHERE = 12**-0.5
# What is left beside reversals is no more than noise by these factors, of positions and of torque.
QUIET = (1.25, 1.4)
# Reversals count whose moment is known to this [s], and lags within this share of the gap: no torque turns later then.
KNOWN, WITHIN = 1e-3, 0.75
# A joint whose rows at reversals count is timed by impulses where those tell it so much better than its rows may.
BETTER = 0.5
# Directions of the fit below this share of a usual one are not determined; forces beside the gap are those from here on
# [s].
FAINT, BESIDE = 1e-9, 1e-3
# Times about reversals [s] that are fitted, and must be understood.
ABOUT = 0.2
# A signal counts as usual up to so many medians.
USUAL = 5.0


@dataclass(frozen=True, eq=False)
class ReversalTiming:
    """What reversals tell of how late torque is.

    Attributes:
        lags: of torque behind motion (n,) [s], by each joint.
        errors: their standard deviations (n,); infinite for joints that tell nothing.
        kicks: velocities (n,) [rad/s or m/s] that motion as it is known lacks at reversals, where they surely do.
    """

    lags: Array
    errors: Array
    kicks: Array

    @property
    def residual(self) -> Array:
        """The lags over their errors (n,)."""
        return np.asarray(self.lags / self.errors)

    def column(self, joints: Sequence[int]) -> Array:
        """What some joints (from 0) tell of a lag of all torque (n, 1), over their errors."""
        return np.where(np.isin(np.arange(len(self.errors)), joints), 1.0 / self.errors, 0.0)[:, None]

    def beside(self, recording: Recording) -> ReversalTiming | None:
        """Keeps what is not told by rows at reversals that count, or far better than by those; None for nothing."""
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
    """Measures how late torque is against each joint's reversals.

    Friction that turns round is late in the torque by as much as the torque is. An encoder tells a reversal of
    low-passed motion to some milliseconds only: Coulomb friction kicks the joint there, with much the same force each
    time, the loop undoes it, and all of it hides in the encoder's noise. Torque tells the kick's force (beyond the base
    model), but just about the reversal, where friction that turns round late would look the same; positions tell, in
    the mean of all reversals, what velocity the kick brought in all. What impulse torque had beyond that is friction's:
    twice the Coulomb friction times the lag.

    Args:
        recording: the data.
        baseline: the base model on it.
        values: its parameters (b,).
        residual: torque less base model and effects that are known (N, n) [N m or N].
        extra: torque of those (N, n); None for none.

    Returns:
        The timing; None where no joint tells any.
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
    for j, i in coulomb.items():
        turns = find_reversals(recording, j, base, values)
        if turns is None:
            continue
        found = _joint(recording, j, turns, residual[:, j], float(abs(values[i])), signs[:, j])
        if found is not None:
            lags[j], errors[j], kicks[j] = found
    return ReversalTiming(lags, errors, kicks)


@dataclass(frozen=True, eq=False)
class _Impulse:
    """The mean force of a joint's kicks.

    Attributes:
        at: moments (R,) of the reversals, in rows.
        force: of the kicks at all rows (N,) [N m or N].
        gap: rows to either side of a reversal in which torque tells nothing of it.
        velocity: what a kick does to the velocity at the reversal, times the inertia [N m s or N s], and its error.
        impulse: beyond that of the forces beside the gap, in it [N m s or N s].
        error: of the whole impulse in the gap [N m s or N s].
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
    """Lag of torque behind a joint's reversals, its error [s], and the kicks; None where those are not understood."""
    kick = _fit_impulse(recording, j, turns, force) if friction > 0 else None
    if kick is None:
        return None
    rate = np.abs(np.interp(kick.at, np.arange(len(force)), recording.ddq[:, j]))
    usual = float(np.mean(turns.inertia))
    # A velocity that is wrong changes its sign late by that over the acceleration.
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
    """Fits the mean force of a joint's kicks to its positions and, but for the gaps, its torque; None where that fails.

    A low-pass leaves nothing of it in the motion that stands out of the encoder's noise at any one reversal.
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
    # Each kind of reversal by its own sums: what it says beyond noise that comes anew at each sample counts, too.
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
    """Gives the root mean square of a signal (N,) where it is not far larger than usual."""
    usual = np.abs(x) < USUAL * np.median(np.abs(x))
    return float(np.sqrt(np.mean(x[usual] ** 2))) if usual.any() else 0.0
