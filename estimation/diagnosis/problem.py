"""The whitened regression that every hypothesis is measured in, the base model projected out once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from estimation.diagnosis.baseline import FAINT, Baseline
from estimation.diagnosis.hypotheses import Hypothesis
from estimation.diagnosis.orthonormal import orthonormal
from estimation.diagnosis.regularisation import held, pull_of
from estimation.diagnosis.states import Recording
from estimation.diagnosis.whitening import Whitening
from estimation.pulls import Pull
from robots.terms.effects import Situation

Array = NDArray[np.float64]
Small = NDArray[np.float32]

# A direction of a hypothesis shows only where this share of its energy is left beside the base model.
VISIBLE = 1e-3
# A column must have this share of its energy in rows whose direction of motion is known: what leaks from the others is
# mostly the error of the motion there.
COUNTED = 0.02


@dataclass(frozen=True, eq=False)
class Group:
    """A hypothesis at one shape, measured against the data.

    Attributes:
        joints: those it acts on, from 0.
        columns: whitened (N, k) of each of the joints.
        against: <X, Q> (k, b), Q the base model's orthonormal columns.
        gram: of what the base model leaves of the columns (k, k).
        raw: squared norms (k,) before that; infinite for columns that are nearly all in rows that do not count.
        cross: with the residual (k,).
    """

    joints: tuple[int, ...]
    columns: tuple[Small, ...]
    against: Array
    gram: Array
    raw: Array
    cross: Array

    @property
    def size(self) -> int:
        """The number of columns k."""
        return len(self.raw)


@dataclass(frozen=True, eq=False)
class Problem:
    """Data and base model, white.

    Inner products are <A, B> = sum_jk P_jk A_j'B_k over joints, P the inverse correlation of their innovations.

    Attributes:
        recording: the data.
        baseline: the base model.
        whitening: makes the noise white.
        situation: what effects depend on.
        mixed: P times the base model's orthonormal columns, (n, N, b).
        residual: P times the white residual of the base model (N, n).
        white: the white residual of the base model (N, n).
        energy: <r, r> of the residual.
        nulls: P times white noise (n, N, draws), and its products with Q (b, draws).
        remainder: torque less base model (N0, n) [N m or N], at the recording's own rows.
        pull: what holds base parameters that the data leave open, in units of rows over the noise's scale.
    """

    recording: Recording
    baseline: Baseline
    whitening: Whitening
    situation: Situation
    mixed: Array
    residual: Array
    white: Array
    energy: float
    nulls: tuple[Small, Array]
    remainder: Array
    pull: Pull

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.recording.n

    @cached_property
    def rms(self) -> Array:
        """Root mean square torque (n,) [N m or N]."""
        return np.asarray(np.sqrt(np.mean(self.recording.tau**2, axis=0)))

    @cached_property
    def rows(self) -> int:
        """Number of white rows N."""
        return len(self.residual)

    def columns_of(self, hypothesis: Hypothesis, shape: tuple[float, ...]) -> tuple[tuple[int, ...], tuple[Array, ...]]:
        """Evaluates a hypothesis: the joints it acts on, and its columns (N, k) on each."""
        return hypothesis.columns(self.situation, shape)

    def group(self, joints: tuple[int, ...], columns: tuple[Array, ...]) -> Group:
        """Whitens columns (N, k) of some joints and projects the base model out of them."""
        return self.groups(joints, columns, 1)[0]

    def groups(self, joints: tuple[int, ...], columns: tuple[Array, ...], count: int) -> list[Group]:
        """Does what `group` does for several groups on the same joints at once: columns (N, count k), k of each."""
        whole = [self.whitening.filtered(part, j) for j, part in zip(joints, columns, strict=True)]
        white = [self.whitening.counted(part, j) for j, part in zip(joints, whole, strict=True)]
        total = white[0].shape[1]
        k = total // count
        P = self.whitening.precision
        power = [sum(P[j, j] * _squares(part) for j, part in zip(joints, kind, strict=True)) for kind in (white, whole)]
        raw = np.where(power[0] > COUNTED * power[1], power[0], np.inf)
        against, cross = np.zeros((total, self.mixed.shape[2])), np.zeros(total)
        gram = np.zeros((count, k, k))
        split = [part.T.reshape(count, k, -1) for part in white]
        for a, j in enumerate(joints):
            against += white[a].T @ self.mixed[j]
            cross += white[a].T @ self.residual[:, j]
            gram += P[j, j] * (split[a] @ split[a].transpose(0, 2, 1))
            for b in range(a):
                part = P[j, joints[b]] * (split[a] @ split[b].transpose(0, 2, 1))
                gram += part + part.transpose(0, 2, 1)
        small = [np.asfortranarray(part, dtype=np.float32) for part in white]
        return [
            Group(
                joints=joints,
                columns=tuple(part[:, own] for part in small),
                against=against[own],
                gram=gram[i] - against[own] @ against[own].T,
                raw=np.asarray(raw[own]),
                cross=cross[own],
            )
            for i, own in enumerate(slice(i * k, (i + 1) * k) for i in range(count))
        ]

    def null_cross(self, group: Group) -> Array:
        """Products (k, draws) of a group with noise that the base model was fitted to."""
        return self.null_crosses([group])[0]

    def null_crosses(self, groups: Sequence[Group]) -> Array:
        """Does what `null_cross` does for groups of one size on the same joints: (count, k, draws)."""
        noise, projected = self.nulls
        total = -(np.concatenate([group.against for group in groups]) @ projected)
        for a, j in enumerate(groups[0].joints):
            total += np.concatenate([group.columns[a] for group in groups], axis=1).T @ noise[j]
        return np.asarray(total.reshape(len(groups), -1, projected.shape[1]))

    def product(self, first: Group, second: Group) -> Array:
        """Inner products (k1, k2) of what the base model leaves of two groups."""
        P = self.whitening.precision
        total = -(first.against @ second.against.T)
        for a, left in zip(first.joints, first.columns, strict=True):
            for b, right in zip(second.joints, second.columns, strict=True):
                if P[a, b]:
                    total = total + P[a, b] * (left.T @ right).astype(float)
        return total


@dataclass(frozen=True, eq=False)
class Accepted:
    """Groups that are part of the model already, their columns orthonormal beside the base model.

    Attributes:
        groups: the groups.
        root: L^-1 with L L' their joint Gram matrix (a, a): makes their columns orthonormal.
        cross: orthonormal columns with the residual (a,).
        nulls: with the noise (a, draws).
    """

    groups: tuple[Group, ...]
    root: Array
    cross: Array
    nulls: Array

    @property
    def gain(self) -> float:
        """Squared residual that the groups explain together."""
        return float(self.cross @ self.cross)


def accept(problem: Problem, groups: tuple[Group, ...]) -> Accepted:
    """Joins groups into one set of orthonormal columns."""
    draws = problem.nulls[1].shape[1]
    if not groups:
        return Accepted((), np.zeros((0, 0)), np.zeros(0), np.zeros((0, draws)))
    gram = np.block([[problem.product(a, b) for b in groups] for a in groups])
    raw = np.concatenate([group.raw for group in groups])
    root = visible_root(gram, raw)
    cross = np.concatenate([group.cross for group in groups])
    nulls = np.concatenate([problem.null_cross(group) for group in groups])
    return Accepted(groups, root, root @ cross, root @ nulls)


@dataclass(frozen=True, eq=False)
class Score:
    """What a group explains beyond base model and accepted groups.

    Attributes:
        gram: (k, k).
        cross: (k,).
        raw: (k,).
        root: (k', k): makes the visible directions orthonormal.
        onto: orthonormal accepted columns times the group's (a, k).
    """

    gram: Array
    cross: Array
    raw: Array
    root: Array
    onto: Array

    @property
    def degrees(self) -> int:
        """Directions that show."""
        return len(self.root)

    @property
    def gain(self) -> float:
        """Squared residual explained, unbounded coefficients."""
        return float(np.sum((self.root @ self.cross) ** 2))

    @property
    def visible(self) -> float:
        """Largest share of a column's energy that is left beside the base model."""
        return float(np.max(np.diag(self.gram) / np.maximum(self.raw, 1e-300), initial=0.0))

    def coefficients(self) -> Array:
        """Least squares in the visible directions (k,)."""
        return np.asarray(self.root.T @ (self.root @ self.cross))

    def bounded(self, lower: Array, upper: Array) -> tuple[float, Array]:
        """Squared residual explained, and coefficients (k,), within bounds (k,)."""
        c = self.coefficients()
        if not self.degrees:
            return 0.0, c
        if np.all((c >= lower) & (c <= upper)):
            return self.gain, c
        # min |A c - y|^2 with A'A the Gram matrix in its visible directions.
        A = np.linalg.pinv(self.root.T)
        y = self.root @ self.cross
        c = np.asarray(lsq_linear(A, y, bounds=(lower, upper), method="bvls").x)
        return max(float(y @ y - np.sum((A @ c - y) ** 2)), 0.0), c


def _squares(columns: Array) -> Array:
    return np.asarray(np.einsum("ij,ij->j", columns, columns))


def score(problem: Problem, group: Group, accepted: Accepted) -> Score:
    """Projects the accepted groups out of a group."""
    if not accepted.groups:
        onto = np.zeros((0, group.size))
    else:
        onto = accepted.root @ np.concatenate([problem.product(other, group) for other in accepted.groups])
    gram = group.gram - onto.T @ onto
    cross = group.cross - onto.T @ accepted.cross
    return Score(gram, cross, group.raw, visible_root(gram, group.raw), onto)


def visible_root(gram: Array, raw: Array) -> Array:
    """Gives R (k', k) with R gram R' the identity on the directions that show beside what was projected out."""
    scale = np.sqrt(np.maximum(raw, 1e-300))
    values, vectors = np.linalg.eigh(gram / scale[:, None] / scale)
    kept = values > VISIBLE
    return np.asarray((vectors[:, kept] / np.sqrt(values[kept])).T / scale)


def pose(
    recording: Recording,
    baseline: Baseline,
    whitening: Whitening,
    *,
    draws: int,
    rng: np.random.Generator,
    extra: Array | None = None,
    pull: Pull | None = None,
) -> Problem:
    """Fits the base model to white data and prepares the null.

    Args:
        recording: the data.
        baseline: the base model.
        whitening: makes the noise white.
        draws: noise drawn for the null; 0 for none.
        rng: draws it.
        extra: torque (N, n) of effects that are known already, taken off before the base model's situation is computed.
        pull: what holds base parameters that the data leave open; by default `pull_of`.
    """
    n = recording.n
    root = np.linalg.cholesky(whitening.precision)  # P = L L'
    columns = np.concatenate([baseline.regressor, baseline.nuisance], axis=2)
    norms = np.sqrt((columns**2).sum(axis=(0, 1)))
    white = whitening.all(columns[:, :, norms > 0])
    N = len(white)
    mixed = np.einsum("jk,njb->nkb", root, white, optimize=True)
    Q = orthonormal(mixed.reshape(N * n, -1), FAINT).reshape(N, n, -1)
    tau = whitening.all(recording.tau)
    tilted = tau @ root
    tilted = tilted - np.einsum("nkb,b->nk", Q, np.einsum("nkb,nk->b", Q, tilted, optimize=True), optimize=True)
    noise = whitening.draw(N, draws, rng) if draws else np.zeros((N, n, 0), np.float32)
    projected = np.zeros((Q.shape[2], draws))
    pressed = np.empty((n, N, draws), np.float32)
    P, L = whitening.precision.astype(np.float32), root.astype(np.float32)
    for k in range(n):
        part = sum(L[j, k] * noise[:, j] for j in range(n) if L[j, k])
        if draws:
            projected += (Q[:, k].astype(np.float32).T @ part).astype(float)
        pressed[k] = sum(P[j, k] * noise[:, j] for j in range(n) if P[j, k])
    pull = pull or pull_of(baseline, recording, whitening)
    values = fit_values(baseline, whitening.scales(len(recording)), recording.unsure, recording.tau, pull)
    remainder = recording.tau - baseline.regressor @ values
    if extra is not None:
        values = fit_values(baseline, whitening.scales(len(recording)), recording.unsure, recording.tau - extra, pull)
    return Problem(
        recording=recording,
        baseline=baseline,
        whitening=whitening,
        situation=baseline.situation(recording, values),
        mixed=np.ascontiguousarray(np.einsum("jk,nkb->jnb", root, Q, optimize=True)),
        residual=tilted @ root.T,
        white=np.linalg.solve(root.T, tilted.T).T,
        energy=float(np.sum(tilted**2)),
        nulls=(pressed, projected),
        remainder=remainder,
        pull=pull,
    )


def fit_values(baseline: Baseline, scale: Array, unsure: NDArray[np.bool_], tau: Array, pull: Pull) -> Array:
    """Fits base parameters (b,) to torque (N, n), weighed by the noise of each joint (n,) or of each row too (N, n).

    Directions that the log does not determine go where the pull has them.
    """
    weights = 1.0 / scale
    counts = weights * ~unsure
    Y = np.concatenate([baseline.regressor, baseline.nuisance], axis=2) * counts[:, :, None]
    flat = Y.reshape(-1, Y.shape[2])
    return held(flat.T @ flat, flat.T @ (tau * counts).reshape(-1), pull)[: baseline.base.size]
