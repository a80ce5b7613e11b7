"""Whitened regression in which all hypotheses are tested: the base model is fitted and projected out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.base_models.baseline import FAINT, Baseline, base_model_prior
from estimation.diagnosis.calibration import MIN_COUNTED_ENERGY, MIN_DISTANT_ENERGY
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.noise_models.high_frequency_band import HighBand
from estimation.diagnosis.noise_models.whitening import Whitening
from estimation.diagnosis.recordings.recording import Recording
from estimation.diagnosis.reversals.reversal_timing import ReversalTiming
from estimation.linear_algebra.orthonormal import orthonormal
from estimation.regressions.parameter_priors import GaussianPrior, inflate_conflicting_prior
from robots.common.arrays import Array
from robots.terms.effect_bases.capabilities import AboveBand, AtReversals, Reading
from robots.terms.effect_bases.gear_load import ExtraGearLoad, with_gear_load
from robots.terms.effects import Effect, Situation
from robots.terms.situations.flange_body import with_body

Small = NDArray[np.float32]

ROUNDED = 1e-5  # share of a column's energy below which its unmasked part is only rounding


@dataclass(frozen=True, eq=False)
class Problem:
    """Whitened data and base model.

    Inner products are <A, B> = sum_jk P_jk A_j' B_k over joints j, k. P is the inverse correlation of their
    innovations.

    Attributes:
        recording: the data.
        baseline: the base model.
        whitening: filters that whiten the noise.
        situation: inputs of the effects.
        weighted_base_columns: P times the base model's orthonormal columns (n, N, b).
        residual: P times the whitened residual of the base model (N, n).
        white: whitened residual of the base model (N, n).
        energy: <r, r> of the residual.
        base_residual: torque minus base model (N0, n) [N m or N], at the recording's own rows.
        prior: prior of base parameters and nuisance, for rows weighted by the inverse noise scale.
        high_band: regression above the bands; None without it.
        total_torque_state: inputs of effects that act on the total torque; None if no log shows such an effect.
        timing: delay of torque measured at reversals; None if unknown.
        delayed_torque_state: inputs of effects that delay the torque, with the torque of the other selected effects;
            None without any.
        extra_load: gear load of the selected effects, already part of `situation`; None for none.
    """

    recording: Recording
    baseline: Baseline
    whitening: Whitening
    situation: Situation
    weighted_base_columns: Small
    residual: Array
    white: Array
    energy: float
    base_residual: Array
    prior: GaussianPrior
    high_band: HighBand | None = None
    timing: ReversalTiming | None = None
    total_torque_state: Situation | None = None
    delayed_torque_state: Situation | None = None
    extra_load: ExtraGearLoad | None = None

    def state_for(self, effect: Effect) -> Situation:
        """Returns the situation on which an effect depends."""
        if effect.reading is Reading.CUTS and self.total_torque_state is not None:
            return self.total_torque_state
        return (
            self.delayed_torque_state
            if effect.at_reversals is AtReversals.LATE and self.delayed_torque_state is not None
            else self.situation
        )

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.recording.n

    @cached_property
    def rms(self) -> Array:
        """Root mean square torque (n,) [N m or N]."""
        return np.asarray(np.sqrt(np.mean(self.recording.tau**2, axis=0)))

    @property
    def parameters_without_payload(self) -> Array:
        """Parameters of the base model (p,) without the known payload of the first log."""
        return with_body(self.situation.model, self.situation.parameters, -self.recording.bodies[0])

    @cached_property
    def rows(self) -> int:
        """Number of white rows N."""
        return len(self.residual)

    @cached_property
    def score_gradient(self) -> Array:
        """Gradient (N0, n) of half the explained chi-square with respect to torque in each row [1/(N m) or 1/N].

        Its inner product with an effect's torque is that effect's <X, r>. It is zero where a joint rests.
        """
        rows = len(self.recording)
        return np.column_stack([self.whitening.adjoint(self.residual[:, j], j, rows) for j in range(self.n)])

    @cached_property
    def score_gradient_with_high_band(self) -> Array:
        """Gradient (N0, n) for effects that are searched `above_band`: includes the high band."""
        return self._with_high_band(bare=False)

    @cached_property
    def score_gradient_exogenous(self) -> Array:
        """Gradient (N0, n) for such effects that are also exogenous: no base model is fitted in the high band."""
        return self._with_high_band(bare=True)

    def _with_high_band(self, *, bare: bool) -> Array:
        if self.high_band is None:
            return self.score_gradient
        rows = len(self.recording)
        return self.score_gradient + np.column_stack(
            [self.high_band.score_gradient(j, rows, bare=bare) for j in range(self.n)]
        )

    def score_gradient_for(self, effect: Effect) -> Array:
        """Returns the gradient (N0, n) by which the points of an effect's grid are ranked."""
        return (
            self.score_gradient_exogenous
            if effect.above_band is AboveBand.EXOGENOUS
            else self.score_gradient_with_high_band
            if effect.above_band is not AboveBand.NO
            else self.score_gradient
        )

    def columns_of(self, hypothesis: Hypothesis, shape: tuple[float, ...]) -> tuple[tuple[int, ...], tuple[Array, ...]]:
        """Evaluates a hypothesis: the joints on which it acts, from 0, and its columns (N0, k) on each."""
        return hypothesis.columns(self.state_for(hypothesis.effect), shape)

    def dense(self, hypothesis: Hypothesis, shape: tuple[float, ...]) -> Array:
        """Evaluates a hypothesis on all joints (N0, n, k), zero where it does not act."""
        return hypothesis.dense(self.state_for(hypothesis.effect), shape)

    def measured(self, hypothesis: Hypothesis, shape: tuple[float, ...]) -> Group:
        """Evaluates a hypothesis at one shape and returns its group."""
        return self.group(*self.columns_of(hypothesis, shape), effect=hypothesis.effect)

    def group(self, joints: tuple[int, ...], columns: tuple[Array, ...], *, effect: Effect | None = None) -> Group:
        """Whitens columns (N0, k) of some joints and projects the base model out, as `groups` does."""
        return self.groups(joints, columns, 1, effect=effect)[0]

    def groups(
        self, joints: tuple[int, ...], columns: tuple[Array, ...], count: int, *, effect: Effect | None = None
    ) -> list[Group]:
        """Whitens columns of several groups on the same joints at once and projects the base model out.

        Columns that are nearly all in masked rows get infinite `raw`. Columns of an effect that delays all torque
        do not, if most of their unmasked energy is away from rows of unknown friction sign. Effects
        searched `above_band` include the high band.

        Args:
            joints: joints on which the columns act, from 0.
            columns: (N0, count k) on each joint, k columns per group.
            count: number of groups.
            effect: the effect of the columns; None for other columns.

        Returns:
            One group per k columns.
        """
        whole, white = zip(
            *(self.whitening.both(part, j, single=True) for j, part in zip(joints, columns, strict=True)), strict=True
        )
        total = white[0].shape[1]
        k = total // count
        P = self.whitening.precision
        power = [sum(P[j, j] * _squares(part) for j, part in zip(joints, kind, strict=True)) for kind in (white, whole)]
        above: list[Array] = []
        if self.high_band is not None and effect is not None and effect.above_band is not AboveBand.NO:
            how = {"calm": effect.at_reversals is AtReversals.IMPACT, "bare": effect.above_band is AboveBand.EXOGENOUS}
            above = [self.high_band.columns(part, j, **how) for j, part in zip(joints, columns, strict=True)]
            above = above if any(map(len, above)) else []
        # A column may have little energy in the band and still be visible in the high band.
        power = [own + sum(map(_squares, above)) for own in power]
        raw = np.where(power[0] > MIN_COUNTED_ENERGY * power[1], power[0], np.inf)
        doubtful = np.flatnonzero(np.isinf(raw) & (power[0] > ROUNDED * power[1]))
        if effect is not None and effect.delays_all_torque and len(doubtful):
            known = self._known(joints, [part[:, doubtful] for part in columns])
            raw[doubtful] = np.where(known > MIN_DISTANT_ENERGY * power[0][doubtful], power[0][doubtful], np.inf)
        against, cross, gram = self._products(joints, white, count)
        for j, part in zip(joints, above, strict=False):
            assert self.high_band is not None
            assert effect is not None
            cross += self.high_band.cross(part, j, bare=effect.above_band is AboveBand.EXOGENOUS)
            apart = part.T.reshape(count, k, -1)
            gram += apart @ apart.transpose(0, 2, 1)
        timed = None
        if self.timing is not None and effect is not None and effect.delays_all_torque:
            timed = self.timing.column(joints)
            energy = float(np.sum(timed**2))
            raw, gram = np.where(np.isfinite(raw), raw + energy, raw), gram + energy
            cross += float(timed[:, 0] @ self.timing.residual)
        high = [np.asfortranarray(part, dtype=np.float32) for part in above]
        small = [np.asfortranarray(part) for part in white]
        return [
            Group(
                joints=joints,
                columns=tuple(part[:, own] for part in small),
                against=against[own],
                gram=gram[i] - against[own] @ against[own].T,
                raw=np.asarray(raw[own]),
                cross=cross[own],
                high_band_columns=tuple(part[:, own] for part in high),
                reversal_columns=timed,
            )
            for i, own in enumerate(slice(i * k, (i + 1) * k) for i in range(count))
        ]

    @cached_property
    def _residual(self) -> Small:
        return np.asfortranarray(self.residual, dtype=np.float32)

    def _products(self, joints: tuple[int, ...], white: Sequence[Small], count: int) -> tuple[Array, Array, Array]:
        """Multiplies white columns (N, count k) by base model (count k, b), residual, each other (count, k, k)."""
        total = white[0].shape[1]
        against, cross = np.zeros((total, self.weighted_base_columns.shape[2])), np.zeros(total)
        gram = np.zeros((count, total // count, total // count))
        split = [part.T.reshape(count, total // count, -1) for part in white]
        for a, j in enumerate(joints):
            against += white[a].T @ self.weighted_base_columns[j]
            cross += white[a].T @ self._residual[:, j]
            gram += self.whitening.precision[j, j] * (split[a] @ split[a].transpose(0, 2, 1)).astype(float)
            for b in range(a):
                part = self.whitening.precision[j, joints[b]] * (split[a] @ split[b].transpose(0, 2, 1)).astype(float)
                gram += part + part.transpose(0, 2, 1)
        return against, cross, gram

    def split(self, group: Group, coefficients: Array, rows: NDArray[np.bool_]) -> Group:
        """Splits a group's torque into two white columns: its part in the given white rows (N,), and the rest."""
        torques = [part.astype(np.float64) @ coefficients for part in group.columns]
        white = [np.column_stack([np.where(rows, x, 0.0), np.where(rows, 0.0, x)]) for x in torques]
        return self.white_group(group.joints, white)

    def white_group(self, joints: tuple[int, ...], white: Sequence[Array]) -> Group:
        """Builds a group of columns (N, k) of some joints that are already white."""
        small = tuple(np.asfortranarray(part, dtype=np.float32) for part in white)
        against, cross, (gram,) = self._products(joints, small, 1)
        return Group(joints, small, against, gram - against @ against.T, np.diag(gram).copy(), cross)

    @cached_property
    def far_from_reversals(self) -> NDArray[np.bool_]:
        """White rows (N,) in which no joint is near a reversal, or near the start or end of a rest."""
        return self.recording.far_from_reversals(self.whitening.stride)

    def reversal_time_error(self, joint: int) -> Array:
        """Returns the error [s] of a joint's reversal times due to its velocity error, in white rows (N,)."""
        return self.recording.reversal_time_error_near(joint, self.whitening.stride)

    def _known(self, joints: tuple[int, ...], columns: Sequence[Array]) -> Array:
        """Returns the whitened energy (k,) of columns (N0, k) away from rows of unknown friction sign."""
        total = np.zeros(columns[0].shape[1])
        for j, X in zip(joints, columns, strict=True):
            apart = self.whitening.apply(X * self._distant_from[:, j, None], j)
            total += self.whitening.precision[j, j] * _squares(apart)
        return total

    @cached_property
    def _distant_from(self) -> NDArray[np.bool_]:
        """Rows (N0, n) away from rows of unknown friction sign."""
        return self.recording.distant_from(self.recording.sign_unknown)

    def product(self, first: Group, second: Group) -> Array:
        """Returns the inner products (k1, k2) of two groups, with the base model projected out."""
        P = self.whitening.precision
        total = -(first.against @ second.against.T)
        for a, left in zip(first.joints, first.columns, strict=True):
            for b, right in zip(second.joints, second.columns, strict=True):
                if P[a, b]:
                    total = total + P[a, b] * (left.T @ right).astype(float)
        for a, left in zip(first.joints, first.high_band_columns, strict=False):
            for b, right in zip(second.joints, second.high_band_columns, strict=False):
                if a == b:
                    total = total + (left.T @ right).astype(float)
        if first.reversal_columns is not None and second.reversal_columns is not None:
            total = total + first.reversal_columns.T @ second.reversal_columns
        return total


def _squares(columns: Array | Small) -> Array:
    return np.asarray((columns.T[:, None] @ columns.T[:, :, None])[:, 0, 0], dtype=float)


@dataclass(frozen=True, eq=False)
class Group:
    """A hypothesis at one shape, whitened, with the base model projected out of its inner products.

    Attributes:
        joints: joints on which it acts, from 0.
        columns: whitened columns (N, k) of each of the joints.
        against: <X, Q> (k, b), Q the base model's orthonormal columns.
        gram: Gram matrix of the columns (k, k), base model projected out.
        raw: squared norms (k,) before the projection; infinite for columns that are nearly all in masked rows.
        cross: inner products with the residual (k,).
        high_band_columns: white columns (N', k) of each joint above its band; none for effects that are not
            searched `above_band`.
        reversal_columns: column of each joint's reversal timing over its error (n, k); None if the effect does not
            delay all torque.
    """

    joints: tuple[int, ...]
    columns: tuple[Small, ...]
    against: Array
    gram: Array
    raw: Array
    cross: Array
    high_band_columns: tuple[Small, ...] = ()
    reversal_columns: Array | None = None

    @property
    def size(self) -> int:
        """Number of columns k."""
        return len(self.raw)

    @property
    def by_reversals(self) -> bool:
        """Whether most of its information is from reversal timing, which held-out errors do not contain."""
        return self.reversal_columns is not None and 2.0 * float(np.sum(self.reversal_columns**2)) > float(
            self.gram[0, 0]
        )


def build_problem(
    recording: Recording,
    baseline: Baseline,
    whitening: Whitening,
    *,
    extra: Array | None = None,
    pull: GaussianPrior | None = None,
    upper: HighBand | None = None,
    followed: Array | None = None,
    bearing: ExtraGearLoad | None = None,
) -> Problem:
    """Builds the whitened regression and fits the base model in it.

    Args:
        recording: the data.
        baseline: the base model.
        whitening: filters that whiten the noise.
        extra: torque (N, n) of known effects [N m or N], subtracted before the base parameters are fitted.
        pull: prior of base parameters and nuisance; by default `base_model_prior`, inflated where the data contradict
            it.
        upper: regression above the bands.
        followed: the part (N, n) of the known effects' torque that effects of time delay also delay [N m or N].
        bearing: gear load of the known effects; None for none.
    """
    n = recording.n
    root = np.linalg.cholesky(whitening.precision)  # P = L L'
    columns = baseline.columns
    norms = np.sqrt((columns**2).sum(axis=(0, 1)))
    white = whitening.all(columns[:, :, norms > 0])
    # A column that acts only in rows of unknown friction sign is rounding after whitening.
    left = np.sqrt((white**2).sum(axis=(0, 1))) * whitening.scale.max() / norms[norms > 0]
    white = white[:, :, left > FAINT]
    N = len(white)
    mixed = np.einsum("jk,njb->nkb", root, white, optimize=True)
    Q = orthonormal(mixed.reshape(N * n, -1), FAINT).reshape(N, n, -1)
    tau = whitening.all(recording.tau)
    tilted = tau @ root
    tilted = tilted - np.einsum("nkb,b->nk", Q, np.einsum("nkb,nk->b", Q, tilted, optimize=True), optimize=True)
    scales = whitening.scales(len(recording))
    own = recording.tau if extra is None else recording.tau - extra
    weights = ~recording.sign_unknown / scales
    moments = baseline.moments(weights, own).joined()
    if pull is None:
        strength = whitening.row_weight
        pull = inflate_conflicting_prior(
            base_model_prior(baseline, recording, strength), moments.gram[0], moments.cross[0], strength
        )
    values = moments.pulled(pull).posterior()[: baseline.base.size]
    alone = values if extra is None else baseline.fitted(weights, recording.tau, pull)
    remainder = recording.tau - baseline.regressor @ alone
    now = with_gear_load(baseline.situation(recording, values), bearing)
    return Problem(
        recording=recording,
        baseline=baseline,
        whitening=whitening,
        situation=now,
        weighted_base_columns=np.ascontiguousarray(np.einsum("jk,nkb->jnb", root, Q, optimize=True), dtype=np.float32),
        residual=tilted @ root.T,
        white=np.linalg.solve(root.T, tilted.T).T,
        energy=float(np.sum(tilted**2)),
        base_residual=remainder,
        prior=pull,
        high_band=upper,
        delayed_torque_state=None if followed is None else now.beside(followed),
        extra_load=bearing,
    )
