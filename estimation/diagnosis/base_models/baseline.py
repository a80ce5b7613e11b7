"""The base model on a recording: its columns, the width of the friction sign of each joint, and its prior."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from estimation.diagnosis.base_models.payload_and_gravity import base_regressor, build_situation, friction_signs
from estimation.diagnosis.recordings.directions import SHARP, sharpest_sign_velocity
from estimation.diagnosis.recordings.recording import Recording
from estimation.diagnosis.recordings.thinning import evaluate_at_full_rate
from estimation.linear_algebra.orthonormal import orthonormal
from estimation.regressions.moments import Moments
from estimation.regressions.parameter_priors import (
    OWN_TORQUE_RATIO,
    SILENT_COLUMN,
    GaussianPrior,
    friction_levels,
    prior_from_description,
    usual_share,
)
from estimation.regressions.standard_parameters import mass_from_torque, reference_bodies
from robots.base_parameters import BaseParameters, find_base_parameters
from robots.common.arrays import Array
from robots.regressor import default_model
from robots.robot import Robot
from robots.terms import FrictionTerm
from robots.terms.effects import Situation

# Widths v0 [rad/s or m/s] of the Coulomb friction tanh(dq / v0) that are tried. They reach up to `WIDEST`, or for a
# fast joint up to the share `SHARE` of its largest speed.
SCALES = tuple(float(v0) for v0 in SHARP * 2.0 ** np.arange(-6.0, 9.5, 0.5))
WIDEST, SHARE = 0.065, 0.05
ROUNDS = 3
# Directions of the scaled regressor below this share of the largest are not determined by the log.
FAINT = 1e-7
# A width is fitted if the rows that count contain this share of the squared derivative with respect to it.
SHOWN = 1e-3


@dataclass(frozen=True, eq=False)
class Baseline:
    """The base model on a recording, ready for a fit with any weights.

    Attributes:
        base: base parameters of the model.
        columns: columns (N, n, b + m): those of the base parameters, then others that are fitted too but belong to no
            finding: errors of the sign widths.
    """

    base: BaseParameters
    columns: Array

    @property
    def regressor(self) -> Array:
        """Columns of the base parameters (N, n, b)."""
        return self.columns[:, :, : self.base.size]

    def moments(self, weights: Array, tau: Array) -> Moments:
        """Sums the normal equations of base parameters and nuisance for torque (N, n), rows weighted by (N, n)."""
        return Moments.of(self.columns, tau, weights)

    def fitted(self, weights: Array, tau: Array, pull: GaussianPrior) -> Array:
        """Fits the base parameters (b,) to torque (N, n) by their posterior maximum, rows weighted by (N, n)."""
        return self.moments(weights, tau).pulled(pull).posterior()[: self.base.size]

    def situation(self, recording: Recording, values: Array) -> Situation:
        """Returns the quantities on which effects may depend, with base parameters (b,)."""
        return replace(
            build_situation(recording, self.base.model, values, self.base.independent), measured=recording.tau
        )


def base_parameters(
    robot: Robot, friction: str | FrictionTerm, scales: tuple[float, ...], gravities: Iterable[Array] = ()
) -> BaseParameters:
    """Finds the base parameters of rigid body, friction, rotors and offsets, for given widths of the friction signs.

    Args:
        robot: the robot.
        friction: name of a friction model, or its term.
        scales: width of each joint's friction sign [rad/s or m/s].
        gravities: further gravity vectors (3,) [m/s2] under which the parameters must describe the torque.

    Returns:
        The base parameters.
    """
    return find_base_parameters(default_model(robot, friction=friction, velocity_scale=scales), gravities=gravities)


def build_baseline(
    base: BaseParameters,
    recording: Recording,
    residual_scale: Array | None = None,
    known: Recording | None = None,
) -> Baseline:
    """Selects the width of each joint's friction sign by a fit, and evaluates the columns.

    Args:
        base: base parameters with any widths.
        recording: the data.
        residual_scale: standard deviation of the noise (n,) [N m or N]; by default that of the torque.
        known: the same rows, corrected for known effects in torque and motion; None for none. Friction that is logged
            late would otherwise select a sign that is too wide.

    Returns:
        The base model with its columns.
    """
    seen = recording if known is None else known
    scale = seen.tau.std(axis=0) if residual_scale is None else residual_scale
    least = 1e-9 * max(1.0, float(np.abs(seen.tau).max()))
    Y = base_regressor(base, recording)
    signs = [i for i, column in enumerate(base.columns) if column.symbol == "f1"]
    chosen = None
    if signs:
        trial = Y if np.array_equal(seen.dq, recording.dq) else base_regressor(base, seen)
        fit = _Signs(trial, signs, base, seen, 1.0 / np.maximum(scale, least))
        narrow = np.full(recording.n, WIDEST)
        chosen = fit.sharpness(narrow)
        fast = np.maximum(narrow, SHARE * np.abs(recording.dq).max(axis=0))
        if np.any((fast > narrow) & (np.array(chosen) == max(v0 for v0 in SCALES if v0 <= WIDEST))):
            # Wider signs are tried with each joint weighted by its residual in each log. Otherwise a log that the base
            # model does not describe at all could select any width.
            left = np.maximum(fit.left(chosen), least)
            chosen = _Signs(trial, signs, base, seen, 1.0 / left).sharpness(fast)
        model = default_model(
            base.model.robot,
            friction=next(term for term in base.model.terms if isinstance(term, FrictionTerm)),
            velocity_scale=chosen,
        )
        base = replace(base, model=model)
        for i in signs:
            joint = base.columns[i].joint - 1
            Y[:, joint, i] = friction_signs(recording, joint, np.array([chosen[joint]]))[:, 0]
    return Baseline(base, np.concatenate([Y, _nuisance(recording, chosen)], axis=2))


def _nuisance(recording: Recording, chosen: tuple[float, ...] | None) -> Array:
    """Differentiates each joint's friction sign with respect to log(v0), (N, n, n).

    The derivative is zero if the rows that count hardly contain it. Its coefficient would be arbitrary, and so would
    the torque in the other rows.
    """
    if chosen is None:
        return np.zeros((len(recording), recording.n, 0))
    result = np.zeros((len(recording), recording.n, recording.n))
    for j, v0 in enumerate(chosen):
        change = evaluate_at_full_rate(recording, partial(_change, joint=j, v0=v0))
        if np.sum(change[~recording.sign_unknown[:, j]] ** 2) > SHOWN * np.sum(change**2):
            result[:, j, j] = change
    return result


def _change(recording: Recording, joint: int, v0: float) -> Array:
    x = recording.dq[:, joint] / v0
    return np.asarray(x / np.cosh(np.clip(x, -300, 300)) ** 2)


class _Signs:
    """Weighted fit of the base model with friction signs of all widths as candidates.

    Args:
        Y: columns (N, n, b).
        signs: indices of the columns that are friction signs.
        base: base parameters.
        recording: the data.
        weights: weights of the joints (n,), or of each of their rows (N, n).
    """

    def __init__(self, Y: Array, signs: list[int], base: BaseParameters, recording: Recording, weights: Array) -> None:
        self.recording, self.stride = recording, max(1, len(recording) // 20_000)
        self.joints = [base.columns[i].joint - 1 for i in signs]
        # Index of the sharpest width for each joint.
        self.first = [
            sum(v0 < 0.999 * sharpest_sign_velocity(recording.dq[:, joint]) for v0 in SCALES) for joint in self.joints
        ]
        rows = slice(None, None, self.stride)
        self.weights = np.broadcast_to(weights, recording.tau.shape)[rows]
        self.counts = ~recording.sign_unknown[rows] * self.weights
        rest = np.delete(Y[rows], signs, axis=2) * self.counts[:, :, None]
        self.Q = orthonormal(rest.reshape(-1, rest.shape[2]), FAINT).reshape(len(rest), recording.n, -1)
        self.tau = recording.tau[rows] * self.counts
        self.along = np.einsum("njb,nj->b", self.Q, self.tau)
        size = len(self.joints) * len(SCALES)
        gram, cross, against = np.zeros((size, size)), np.zeros(size), np.zeros((size, self.Q.shape[2]))
        for a, joint in enumerate(self.joints):
            # A sign acts on rows of its own joint only.
            own = slice(a * len(SCALES), (a + 1) * len(SCALES))
            columns = friction_signs(recording, joint, np.array(SCALES))[rows] * self.counts[:, joint, None]
            gram[own, own] = columns.T @ columns
            cross[own] = columns.T @ self.tau[:, joint]
            against[own] = columns.T @ self.Q[:, joint]
        self.gram, self.cross, self.against = gram - against @ against.T, cross - against @ self.along, against

    def sharpness(self, widest: Array) -> tuple[float, ...]:
        """Selects the widths [rad/s or m/s] of all joints up to the widest (n,), by coordinate search."""
        picked = [k + 1 for k in self.first]
        for _ in range(ROUNDS):
            for a, joint in enumerate(self.joints):
                gains = []
                for k in range(self.first[a], sum(v0 <= widest[joint] for v0 in SCALES)):
                    trial = [len(SCALES) * b + (k if b == a else picked[b]) for b in range(len(self.joints))]
                    gains.append(float(self.cross[trial] @ self._fitted(trial)))
                picked[a] = self.first[a] + int(np.argmax(gains))
        scales = [SCALES[0]] * self.recording.n
        for a, joint in enumerate(self.joints):
            scales[joint] = SCALES[picked[a]]
        return tuple(scales)

    def left(self, scales: tuple[float, ...]) -> Array:
        """Computes the RMS residual of each joint and log with given widths, for each row (N, n) [N m or N]."""
        trial = [len(SCALES) * a + SCALES.index(scales[joint]) for a, joint in enumerate(self.joints)]
        values = self._fitted(trial)
        residual = self.tau - self.Q @ (self.along - self.against[trial].T @ values)
        for joint, value in zip(self.joints, values, strict=True):
            sign = friction_signs(self.recording, joint, np.array([scales[joint]]))[:: self.stride, 0]
            residual[:, joint] -= value * sign * self.counts[:, joint]
        result = np.zeros(self.recording.tau.shape)
        for run in self.recording.runs:
            rows = slice(-(-run.start // self.stride), -(-run.stop // self.stride))
            counted = np.maximum((self.counts[rows] > 0).sum(axis=0), 1)
            squares = np.sum((residual[rows] / self.weights[rows]) ** 2, axis=0) / counted
            result[run] = np.sqrt(squares)
        return result

    def _fitted(self, trial: list[int]) -> Array:
        return np.asarray(np.linalg.pinv(self.gram[np.ix_(trial, trial)], 1e-9) @ self.cross[trial])


def inertia_matrix(baseline: Baseline, recording: Recording, values: Array) -> Array:
    """Computes the torque on each joint per acceleration of each (n, n) [kg m2], with base parameters (b,).

    It is the root mean square over some states, rotors included.
    """
    rows = np.linspace(0, len(recording) - 1, 50).astype(int)
    q, zero = recording.q[rows], np.zeros((len(rows), recording.n))
    still = baseline.base.torque(q, zero, zero, values)
    result = np.empty((recording.n, recording.n))
    for k in range(recording.n):
        unit = zero.copy()
        unit[:, k] = 1.0
        result[:, k] = np.sqrt(np.mean((baseline.base.torque(q, zero, unit, values) - still) ** 2, axis=0))
    return result


# Quantile of a joint's speed that counts as its largest.
FASTEST = 0.999


def base_model_prior(baseline: Baseline, recording: Recording, strength: float = 1.0) -> GaussianPrior:
    """Builds the prior of the base parameters from the robot's description, as `identify` does, scaled to the noise.

    Parameters scatter about the description by their own size (`prior_from_description`). Rows are weighted by the
    inverse variance of their noise. The prior then enters with its precision, and the fit maximises the posterior
    density. In coloured noise, rows are less informative than their number suggests. The prior is therefore multiplied
    by the noise density at zero frequency over that of white noise.

    If the description lacks inertial parameters, the prior limits the torque of each parameter to some times that of
    the joints.

    Args:
        baseline: the base model on the data.
        recording: the data.
        strength: number of rows that inform as much on a slow torque as one row of white noise
            (`Whitening.row_weight`).

    Returns:
        Prior of base parameters and nuisance (b + m), in units of rows weighted by the noise.
    """
    counts = ~recording.sign_unknown
    number = np.maximum(counts.sum(axis=0), 1)
    torque = np.sqrt((recording.tau**2 * counts).sum(axis=0) / number)
    torque = np.maximum(torque, 1e-3 * max(float(torque.max()), 1e-12))
    levels = np.sqrt(np.einsum("njb,nj->jb", baseline.regressor**2, counts.astype(float)) / number[:, None])
    own = np.array([column.joint - 1 for column in baseline.base.columns])
    raised = friction_levels(
        baseline.base, levels[own, np.arange(len(own))], np.quantile(np.abs(recording.dq), FASTEST, axis=0)
    )
    robot = baseline.base.model.robot
    bodies, _ = reference_bodies(robot, mass_from_torque(robot, float(torque.max())))
    pull = prior_from_description(baseline.base, bodies, torque, raised)
    if pull is None:
        levels[own, np.arange(len(own))] = raised
        usual = np.array([usual_share(column) for column in baseline.base.columns])
        share = (levels / torque[:, None]).max(axis=0) / usual
        pull = GaussianPrior(np.diag(np.maximum(share, SILENT_COLUMN) ** 2), np.zeros(len(own)))
    b, size = len(pull.target), baseline.columns.shape[2]
    m = size - b
    precision = np.zeros((size, size))
    precision[:b, :b] = pull.precision
    # Errors of the sign widths need a bound, too: rows that hardly contain them would allow any value.
    precision[range(b, size), range(b, size)] = 1.0 / (OWN_TORQUE_RATIO * torque[:m]) ** 2
    return GaussianPrior(strength * precision, np.concatenate([pull.target, np.zeros(m)]))
