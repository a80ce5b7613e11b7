"""Shared part of estimators that simulate the identified robot under its controller."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from scipy.signal import butter, sosfiltfilt

from estimation.closed_loops.closed_loop import ClosedLoop, Controller, inertia_matrices, stiff_controller
from estimation.estimators.base import Array
from estimation.estimators.consistent import PhysicallyConsistent
from estimation.estimators.wls import WeightedLeastSquares
from estimation.regressions.covariances import Equations, regressor_rows, robust_covariance
from estimation.regressions.moments import Moments
from estimation.regressions.position_noise import smoothed_noise
from estimation.regressions.preparation import SIGN_SPEED_SHARE
from estimation.regressions.regression_data import FittedRows, RegressionData
from robots.common.errors import InputError
from robots.common.stretches import chunks
from robots.signals import Motion

# Of a reference that nobody recorded: the share of the measured motion's bandwidth that it keeps, the first that takes
# no more off the velocity than 1.5 deviations of its noise. Noise in an acceleration grows with the fifth power of the
# bandwidth, so what such a reference shares with the regressor is little.
SHARES = (0.5, 0.7, 0.85)
# Parameters have settled when the torque of their change is below this share of the residual, in every joint.
SETTLED_TORQUE_SHARE = 0.01


@dataclass(frozen=True, kw_only=True)
class Loop:
    """The control loop of the logs, as far as it is known.

    Attributes:
        controller: None for a stiff one with the model's own feedforward.
        reference: the commanded motion of each log, which must reach over its rows; None takes the measured motion,
            smoothed further.
    """

    controller: Controller | None = None
    reference: Sequence[Motion] | None = None


class SimulatingEstimator(WeightedLeastSquares):
    """An estimator that starts from weighted least squares and goes by the simulated closed loop.

    Args:
        loop: what is known of the control loop.
        temper: see `WeightedLeastSquares`.
    """

    simulates = True

    def __init__(self, loop: Loop | None = None, temper: float = 1.0) -> None:
        super().__init__(temper)
        self.loop = loop or Loop()


class Instruments:
    """Simulated motion of each part, and sums over it.

    Args:
        data: the data.
        loop: what is known of the control loop.

    Raises:
        InputError: references of another number of logs or joints, or that do not cover them.
    """

    def __init__(self, data: RegressionData, loop: Loop) -> None:
        self.data, self.loop = data, loop
        self._closed_loop = ClosedLoop(data.base)
        if loop.reference is None:
            noise = np.sqrt(np.maximum(smoothed_noise(data)[:, 1, 1], 0.0))
            self._references = [_smoothed(part.motion, data, noise) for part in data.parts]
        else:
            own = _assigned(loop.reference, data.parts)
            self._references = [
                _at(reference, part.motion.t, data.robot.n) for reference, part in zip(own, data.parts, strict=True)
            ]

    def simulate(self, values: Array) -> list[Motion]:
        """Simulates all parts with these base parameters (b,).

        Parameters whose inertia matrix is not positive definite, as unconstrained fits of poor data give, move no
        robot: the physically consistent fit then takes their place.
        """
        moving = values if self._can_move(values) else self._consistent
        motions = []
        for reference in self._references:
            controller = self.loop.controller or stiff_controller(self.data.base, moving, reference)
            motions.append(self._closed_loop.simulate(moving, controller, reference))
        return motions

    def _can_move(self, values: Array) -> bool:
        for reference in self._references:
            inertia = inertia_matrices(self.data.base, values, reference)
            lengths = np.linalg.eigvalsh(inertia)
            # Smallest eigenvalue of an inertia matrix, as a share of its smallest diagonal entry, that can be
            # simulated.
            if (lengths[:, 0] <= 0.02 * np.diagonal(inertia, axis1=1, axis2=2).min(axis=1)).any():
                return False
        return True

    @cached_property
    def _consistent(self) -> Array:
        weights = self.data.moments.level(np.zeros(self.data.base.size)) ** -1
        return PhysicallyConsistent(weight=1e-3, boxes={}).refine(self.data, np.zeros(0), weights).values

    def masks(self, motions: Sequence[Motion]) -> list[Array]:
        """Finds the rows that count (N, n), by the simulated speed: by the measured one, noise would choose."""
        masks = []
        for part, motion in zip(self.data.parts, motions, strict=True):
            dq = motion.dq
            speed = np.sqrt(np.mean(dq**2, axis=0))
            doubt = (part.motion.dq - dq).std(axis=0)
            # Where the speed is three deviations of the measured from the simulated one, both have the same sign.
            # However doubtful: four fifths of the rows must stay.
            most = np.quantile(np.abs(dq), 0.2, axis=0)
            fast = (np.abs(dq) >= np.maximum(SIGN_SPEED_SHARE * speed, np.minimum(3.0 * doubt, most))) | (speed < 1e-9)
            # Time at the start [s] that a simulation from the reference's own state takes to settle.
            settled = motion.t - motion.t[0] >= min(0.3, 0.1 * motion.duration)
            # A row that does not count although its joint moves, such as a clipped one, has another reason.
            measured = np.abs(part.motion.dq)
            moving = measured > 2 * SIGN_SPEED_SHARE * np.sqrt(np.mean(measured**2, axis=0))
            masks.append((fast & settled[:, None] & ~(moving & (part.mask == 0))).astype(float))
        return masks

    def covariance(self, motions: Sequence[Motion], weights: Array, values: Array, measured: bool) -> Array:
        """Estimates the covariance (b, b) of an estimate that the simulated motions' regressor determines.

        Args:
            motions: simulated, one per part.
            weights: of the joints' rows (n,).
            values: the estimate (b,).
            measured: whether its residual is that of the measured motion (IV) or of the simulated one (DIDIM).
        """
        masks = self.masks(motions)
        total: Moments | None = None
        equations = []
        for part, motion, mask in zip(self.data.parts, motions, masks, strict=True):
            seen = part.motion if measured else motion
            residual = part.tau - self.data.base.torque(seen.q, seen.dq, seen.ddq, values)
            equations.append(Equations(len(motion), partial(regressor_rows, self.data.base, motion), mask, residual))
            moments = simulated_moments(self.data, part, motion, mask)
            total = moments if total is None else total + moments
        assert total is not None
        return robust_covariance(equations, weights, np.tensordot(weights, total.gram, axes=1))


def instrumented_moments(data: RegressionData, part: FittedRows, motion: Motion, mask: Array) -> tuple[Array, Array]:
    """Sums Z_j' Y_j (n, b, b) and Z_j' tau_j (n, b), Z the regressor of the simulated motion."""
    n, size = data.robot.n, data.base.size
    gram, cross = np.zeros((n, size, size)), np.zeros((n, size))
    for rows in chunks(len(motion)):
        Z = data.base.regressor(motion.q[rows], motion.dq[rows], motion.ddq[rows]) * mask[rows, :, None]
        Y = data.base.regressor(part.motion.q[rows], part.motion.dq[rows], part.motion.ddq[rows])
        for joint in range(n):
            gram[joint] += Z[:, joint].T @ Y[:, joint]
            cross[joint] += Z[:, joint].T @ part.tau[rows, joint]
    return gram, cross


def simulated_moments(data: RegressionData, part: FittedRows, motion: Motion, mask: Array) -> Moments:
    """Sums normal equations of the measured torque on the simulated motion's regressor."""
    total: Moments | None = None
    for rows in chunks(len(motion)):
        Z = data.base.regressor(motion.q[rows], motion.dq[rows], motion.ddq[rows])
        moments = Moments.of(Z, part.tau[rows], mask[rows])
        total = moments if total is None else total + moments
    assert total is not None
    return total


def _assigned(references: Sequence[Motion], parts: Sequence[FittedRows]) -> list[Motion]:
    """Finds each part's reference: a long log comes in several parts that follow each other."""
    found: list[Motion] = []
    index, last = 0, -np.inf
    for part in parts:
        t = part.motion.t
        if found and (t[0] <= last or t[-1] > references[min(index, len(references) - 1)].t[-1] + (t[-1] - t[0]) / 2):
            index += 1
        last = float(t[-1])
        found.append(references[min(index, len(references) - 1)])
    if index != len(references) - 1:
        raise InputError(f"{len(references)} references", allowed=f"{index + 1}, one per log")
    return found


def _at(reference: Motion, t: Array, joints: int) -> Motion:
    """A reference at the rows' times."""
    if reference.n != joints:
        raise InputError(f"a reference of {reference.n} joints", allowed=f"{joints}")
    slack = 1e-6 + float(np.median(np.diff(t)))
    if t[0] < reference.t[0] - slack or t[-1] > reference.t[-1] + slack:
        raise InputError(
            f"a reference from {reference.t[0]:g} to {reference.t[-1]:g} s",
            allowed=f"one that covers {t[0]:g} to {t[-1]:g} s",
            remedy="give it on the log's clock",
        )
    if len(reference) == len(t) and np.allclose(reference.t, t, rtol=0, atol=1e-9):
        return Motion(t=t, q=reference.q, dq=reference.dq, ddq=reference.ddq)
    columns = [
        np.column_stack([np.interp(t, reference.t, column) for column in signal.T])
        for signal in (reference.q, reference.dq, reference.ddq)
    ]
    return Motion(t=t, q=columns[0], dq=columns[1], ddq=columns[2])


def _smoothed(motion: Motion, data: RegressionData, noise: Array) -> Motion:
    """The measured motion, low-passed below its own bandwidth where that takes off nothing but noise (n,) [rad/s]."""
    if data.smoother is None or not noise.any():
        return motion
    for share in SHARES:
        smoother = _low_passed(motion, share * data.smoother.cutoff)
        if smoother is not None and ((motion.dq - smoother.dq).std(axis=0) <= 1.5 * noise).all():
            return smoother
    return motion


def _low_passed(motion: Motion, cutoff: float) -> Motion | None:
    """The motion without what is above the cut-off [Hz], on its own times; None where it is sampled too slowly."""
    t = motion.t
    period = float(np.median(np.diff(t)))
    if cutoff * period >= 0.45:
        return None
    grid = t[0] + period * np.arange(int(np.floor((t[-1] - t[0]) / period + 1e-6)) + 1)
    sections = butter(3, 2 * cutoff * period, output="sos")
    padding = int(min(len(grid) - 1, max(21, round(4 / (cutoff * period)))))

    def low_passed(signal: Array) -> Array:
        even = np.column_stack([np.interp(grid, t, column) for column in signal.T])
        smooth = sosfiltfilt(sections, even, axis=0, padtype="odd", padlen=padding)
        return np.column_stack([np.interp(t, grid, column) for column in smooth.T])

    # Smoothing and differentiation commute: each derivative is low-passed by itself.
    return Motion(t=t, q=low_passed(motion.q), dq=low_passed(motion.dq), ddq=low_passed(motion.ddq))
