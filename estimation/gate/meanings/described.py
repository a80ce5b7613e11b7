"""How likely the torque of each joint is, if it is a multiple of the described one, or something else."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp
from scipy.stats import norm

from estimation.gate.quick_fits.cutoff_choice import CHOICE_ROWS
from estimation.gate.quick_fits.fitted import Fitted
from estimation.gate.quick_fits.joint_columns import OWN
from estimation.gate.quick_fits.joint_fit import OWN_RIDGE
from estimation.gate.quick_fits.rigid_body import HEAVY, LINK, gravity_rows
from estimation.linear_algebra.scaled import solve_ridge
from estimation.regressions.parameter_priors import link_spreads
from robots.common.arrays import Array

# Relative errors of a description that are tried, with equal weight, at each joint: of a measured model to a guess.
# Joint torques may be described much worse. A multiple of such a description would be anything.
ERRORS, ANY_ERROR = np.array([0.1, 0.2, 0.4, 0.8]), np.array([0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 6.4])
# Relative error (log) that all links of a description share, such as a density.
COMMON = 0.25
# Error of the gravity that a controller subtracts, over that of the description.
SUBTRACTED = 0.4
# Scatter of external torques, over that by a link that is described wrong by its own size.
EXTERNAL = (0.01, 1.0)
# Factors on the described torque that are tried, and their step (log). A current in A is 1/300 to 1 of the torque,
# N mm are 1000 times it.
FACTORS, STEP = (1e-3, 3e3), 0.05
# Independent errors of a fit in a log: what a regressor lacks repeats itself from row to row.
INDEPENDENT = 20
# Folds and ridges, over the trace of the Gram matrix, of the fit that gives the noise.
FOLDS, RIDGES = 6, (1e-9, 1e-7, 1e-5, 1e-3, 1e-1)
# Least noise, over the torque that friction does not explain.
LEAST_NOISE = 0.01
# Standard errors from which a delay is corrected: a late torque would seem to have another inertia.
SURE = 3.0


@dataclass(frozen=True, eq=False)
class JointEvidence:
    """Log evidence of one joint's torque, over that of friction, offset and noise alone.

    Attributes:
        joint: counted from 0.
        factors: log of the factors on the described torque (F,).
        described: that it is the joint torque, and the description wrong by each factor (F,), and as much otherwise.
        inverted: that it is the joint torque with the opposite sign.
        multiple: that the torque is the described one times each factor (F,).
        weightless: that it is the described one without gravity, with no other factor than the description's error.
        external: that it is what a wrong model leaves.
        size: standard deviation of the measured torque over that of the described one.
        friction: RMS of the fitted friction that links and offset do not explain, over that of the torque.
    """

    joint: int
    factors: Array
    described: Array
    inverted: float
    multiple: Array
    weightless: float
    external: float
    size: float
    friction: float

    def at(self, factor: float) -> float:
        """Gives the log evidence of the described torque times a factor, known as well as the description."""
        return _mean(self.multiple, norm.logpdf(self.factors, np.log(factor), COMMON))

    def right(self) -> float:
        """Gives the log evidence of the joint torque."""
        return _mean(self.described, norm.logpdf(self.factors, 0.0, COMMON))

    def between(self, low: float, high: float) -> float:
        """Gives the log evidence of the described torque times an unknown factor between two."""
        inside = (self.factors >= np.log(low)) & (self.factors <= np.log(high))
        return _mean(self.multiple[inside], np.zeros(int(inside.sum())))


def joint_evidence(fitted: Fitted) -> list[JointEvidence]:
    """Computes the evidence of each joint's torque.

    The torque is ``c Y pi + friction + noise``. The links' parameters pi scatter about the description by a share of
    each link's mass, first moment and inertia (`link_spreads`). Friction, offset, and a rotor without description are
    free. Held-out errors give the variance of the noise, with what the regressor lacks. The evidence of a linear model
    has a closed form.

    Args:
        fitted: of a robot with described links.
    """
    rows, robot = fitted.rows, fitted.robot
    kept = rows.thinned(max(1, len(rows.q) // CHOICE_ROWS))
    heavy = np.einsum("jmkp,k->jmp", gravity_rows(robot, rows.q[kept]), np.asarray(robot.chain.gravity))
    moves = ~rows.rest[kept]
    sure = [d is not None and abs(d.value) > d.sticks + SURE * d.error for d in fitted.delays]
    late = np.where(sure, fitted.delay_values, 0.0)
    return [
        _evidence_of(fitted, joint, kept[moves[:, joint]], heavy[joint][moves[:, joint]], float(late[joint]))
        for joint, fit in enumerate(fitted.fits)
        if fit is not None
    ]


def _evidence_of(fitted: Fitted, joint: int, kept: NDArray[np.intp], heavy: Array, late: float) -> JointEvidence:
    robot, fit = fitted.robot, fitted.fits[joint]
    assert fit is not None
    inertia = np.asarray(robot.inertia, dtype=float)
    described, sizes = inertia.ravel(), link_spreads(inertia).ravel()
    light = np.tile(np.arange(LINK) < HEAVY, robot.n)
    whole, Y = np.zeros_like(heavy), fitted.rows.joints[joint].Y[kept]
    whole[:, fit.used] = Y[:, :-OWN] * fit.scale[:-OWN]
    own, drive, rotor = Y[:, -OWN:], np.zeros((len(kept), 1)), float(robot.rotor_inertia[joint])
    if rotor:
        drive[:, 0], own = rotor * fitted.rows.ddq[kept, joint], own[:, 1:]
    tau = fitted.rows.torques(late)[kept, joint]
    mean = np.column_stack([whole @ described + drive[:, 0], (whole - heavy) @ described + drive[:, 0], tau])
    size = float(tau.std() / max(float(mean[:, 0].std()), 1e-12))
    columns = np.hstack([(whole - heavy) * sizes, drive, (heavy * sizes)[:, light]])
    # Friction is free in all hypotheses: what it explains is taken out of all.
    free = np.linalg.qr(own)[0]
    columns, mean = (values - free @ (free.T @ values) for values in (columns, mean))
    shared = columns[:, : LINK * robot.n + 1].copy()
    shared[:, : LINK * robot.n][:, light] += columns[:, LINK * robot.n + 1 :]
    root = np.sqrt(_precision(shared, mean[:, 2]))
    # The gravity that a controller subtracts is that of its own model.
    columns[:, LINK * robot.n + 1 :] *= SUBTRACTED
    columns, shared, (torque, weightless, measured) = root * columns, root * shared, root * mean.T
    factors, scatters = (np.arange(np.log(low), np.log(high), STEP) for low, high in (FACTORS, EXTERNAL))
    near = np.arange(-3 * COMMON, 3 * COMMON + STEP, STEP)
    friction = Y[:, -OWN + 1 : -1] @ fit.values[-OWN + 1 : -1]
    others = np.delete(Y, np.s_[-OWN + 1 : -1], axis=1)
    friction = friction - others @ solve_ridge(others.T @ others, others.T @ friction, OWN_RIDGE)
    return JointEvidence(
        joint=joint,
        factors=factors,
        described=_evidence(shared, torque, measured, factors, ANY_ERROR),
        inverted=_mean(_evidence(shared, -torque, measured, near), norm.logpdf(near, 0.0, COMMON)),
        multiple=_evidence(shared, torque, measured, factors),
        weightless=_mean(_evidence(columns, weightless, measured, near), norm.logpdf(near, 0.0, COMMON)),
        external=_mean(_evidence(shared, 0.0 * torque, measured, scatters), np.zeros(len(scatters))),
        size=size,
        friction=float(np.sqrt(np.mean(friction**2)) / max(float(tau.std()), 1e-300)),
    )


def _evidence(columns: Array, mean: Array, tau: Array, factors: Array, errors: Array = ERRORS) -> Array:
    """Integrates over the parameters and their relative error.

    Args:
        columns: of parameters with unit scatter (M, k), over the noise.
        mean: the expected torque (M,), over the noise.
        tau: the measured torque (M,), over the noise.
        factors: log of the factors on columns and mean (F,).
        errors: relative errors of the parameters (E,).

    Returns:
        Log evidence (F,), relative to noise alone.
    """
    values, ways = np.linalg.eigh(columns.T @ columns)
    values = np.maximum(values, 0.0)
    measured, expected = (ways.T @ (columns.T @ np.column_stack([tau, mean]))).T
    c = np.exp(factors)[:, None, None]
    # (F, E, k): the scatter of each direction.
    scatter = (c * errors[None, :, None]) ** 2
    gain = scatter * (measured - c * expected) ** 2 / (1 + scatter * values) - np.log1p(scatter * values)
    c = c[:, :, 0]
    log = 0.5 * gain.sum(axis=2) + c * float(mean @ tau) - 0.5 * c**2 * float(mean @ mean)
    return np.asarray(logsumexp(log, axis=1) - np.log(len(errors)))


def _precision(columns: Array, tau: Array) -> float:
    """Gives one over the variance of held-out errors, times the number of rows that count as one.

    A fit to all rows would explain with absurd parameters what the regressor lacks.
    """
    parts = np.array_split(np.arange(len(tau)), FOLDS)
    grams = np.array([columns[part].T @ columns[part] for part in parts])
    crosses = np.array([columns[part].T @ tau[part] for part in parts])
    gram, cross = grams.sum(axis=0), crosses.sum(axis=0)
    size = float(np.trace(gram)) + 1e-300
    variance = float(tau @ tau) / len(tau)
    for ridge in RIDGES:
        error = 0.0
        for part, own, its in zip(parts, grams, crosses, strict=True):
            values = np.linalg.solve(gram - own + ridge * size * np.eye(len(gram)), cross - its)
            error += float(np.sum((tau[part] - columns[part] @ values) ** 2))
        variance = min(variance, error / len(tau))
    variance = max(variance, LEAST_NOISE**2 * float(tau @ tau) / len(tau)) * max(len(tau) / INDEPENDENT, 1.0)
    return 1.0 / (variance + 1e-300)


def _mean(evidence: Array, weights: Array) -> float:
    """Averages evidence with weights; both are logarithms."""
    return float(logsumexp(evidence + weights) - logsumexp(weights)) if len(evidence) else -np.inf
