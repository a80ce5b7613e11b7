"""The whitened regression that every hypothesis is measured in, the base model projected out once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.base_models.baseline import Baseline
from estimation.diagnosis.calibration import MIN_COUNTED_ENERGY, MIN_DISTANT_ENERGY
from estimation.diagnosis.hypothesis_tests.groups import Group
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis, acting
from estimation.diagnosis.noise_models.high_frequency_band import HighBand
from estimation.diagnosis.noise_models.whitening import Whitening
from estimation.diagnosis.recordings.recording import Recording
from estimation.diagnosis.reversals.reversal_timing import ReversalTiming
from estimation.regressions.parameter_priors import GaussianPrior
from robots.terms.effect_bases.gear_load import ExtraGearLoad
from robots.terms.effects import Effect, Situation
from robots.terms.situations.flange_body import with_body

Array = NDArray[np.float64]
Small = NDArray[np.float32]

FAINT = 1e-5


@dataclass(frozen=True, eq=False)
class Problem:
    """Data and base model, white.

    Inner products are <A, B> = sum_jk P_jk A_j'B_k over joints, P the inverse correlation of their innovations.

    Attributes:
        recording: the data.
        baseline: the base model.
        whitening: makes the noise white.
        situation: what effects depend on.
        weighted_base_columns: P times the base model's orthonormal columns, (n, N, b).
        residual: P times the white residual of the base model (N, n).
        white: the white residual of the base model (N, n).
        energy: <r, r> of the residual.
        base_residual: torque less base model (N0, n) [N m or N], at the recording's own rows.
        prior: what holds base parameters that the data leave open, in units of rows over the noise's scale.
        high_band: the frequencies above the bands; None where nothing is asked of them.
        total_torque_state: what effects depend on that act on all of the torque, as far as that is known; None where
            none is seen.
        timing: how late torque is against reversals whose rows do not count; None where that is not known.
        delayed_torque_state: what those depend on that make all of it late, with the other effects found before; None
            without any.
        extra_load: what of the effects found before the gears bear, in `situation`; None for nothing.
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
        """Gives what an effect depends on."""
        if effect.acts_on_total_torque and self.total_torque_state is not None:
            return self.total_torque_state
        return (
            self.delayed_torque_state
            if effect.smooths_friction_sign and self.delayed_torque_state is not None
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
        """The base model's parameters (p,) without the payload that the first log may carry."""
        return with_body(self.situation.model, self.situation.parameters, -self.recording.bodies[0])

    @cached_property
    def rows(self) -> int:
        """Number of white rows N."""
        return len(self.residual)

    @cached_property
    def score_gradient(self) -> Array:
        """What torque in each of the recording's rows (N0, n) explains, per unit: half the slope of <r, r>.

        The sum of its products with an effect's torque is that effect's product with the residual, as far as the base
        model has no part in it; zero where a joint rests.
        """
        rows = len(self.recording)
        return np.column_stack([self.whitening.adjoint(self.residual[:, j], j, rows) for j in range(self.n)])

    @cached_property
    def score_gradient_with_high_band(self) -> Array:
        """The slope (N0, n) for what is `independent_of_acceleration`: with the frequencies above the bands."""
        return self._with_high_band(bare=False)

    @cached_property
    def score_gradient_exogenous(self) -> Array:
        """The slope (N0, n) for what is `exogenous` besides."""
        return self._with_high_band(bare=True)

    def _with_high_band(self, *, bare: bool) -> Array:
        if self.high_band is None:
            return self.score_gradient
        rows = len(self.recording)
        return self.score_gradient + np.column_stack(
            [self.high_band.score_gradient(j, rows, bare=bare) for j in range(self.n)]
        )

    def score_gradient_for(self, effect: Effect) -> Array:
        """Gives the slope (N0, n) by which the points of an effect's grid are ranked."""
        return (
            self.score_gradient_exogenous
            if effect.exogenous
            else self.score_gradient_with_high_band
            if effect.independent_of_acceleration
            else self.score_gradient
        )

    def columns_of(self, hypothesis: Hypothesis, shape: tuple[float, ...]) -> tuple[tuple[int, ...], tuple[Array, ...]]:
        """Evaluates a hypothesis: the joints it acts on, and its columns (N, k) on each."""
        return hypothesis.columns(self.state_for(hypothesis.effect), shape)

    def measured(self, hypothesis: Hypothesis, shape: tuple[float, ...]) -> Group:
        """Evaluates a hypothesis at a shape and measures it."""
        return self.group(*self.columns_of(hypothesis, shape), effect=hypothesis.effect)

    def group(self, joints: tuple[int, ...], columns: tuple[Array, ...], *, effect: Effect | None = None) -> Group:
        """Whitens columns (N, k) of some joints and projects the base model out of them.

        Of an `effect` on whose size all joints agree, columns count that are largest where motion is not known, if most
        of what counts is from elsewhere. One that is fast is measured above the bands too.
        """
        return self.groups(joints, columns, 1, effect=effect)[0]

    def groups(
        self, joints: tuple[int, ...], columns: tuple[Array, ...], count: int, *, effect: Effect | None = None
    ) -> list[Group]:
        """Does what `group` does for several groups on the same joints at once: columns (N, count k), k of each."""
        whole, white = zip(*(self._whitened(part, j) for j, part in zip(joints, columns, strict=True)), strict=True)
        total = white[0].shape[1]
        k = total // count
        P = self.whitening.precision
        power = [sum(P[j, j] * _squares(part) for j, part in zip(joints, kind, strict=True)) for kind in (white, whole)]
        above: list[Array] = []
        if self.high_band is not None and effect is not None and effect.independent_of_acceleration:
            how = {"calm": effect.acceleration_driven, "bare": effect.exogenous}
            above = [self.high_band.columns(part, j, **how) for j, part in zip(joints, columns, strict=True)]
            above = above if any(map(len, above)) else []
        # What acts above the bands counts there, however little of it those let through.
        power = [own + sum(map(_squares, above)) for own in power]
        raw = np.where(power[0] > MIN_COUNTED_ENERGY * power[1], power[0], np.inf)
        doubtful = np.flatnonzero(np.isinf(raw) & (power[0] > FAINT * power[1]))
        if effect is not None and effect.shared_coefficient and len(doubtful):
            known = self._known(joints, [part[:, doubtful] for part in columns])
            raw[doubtful] = np.where(known > MIN_DISTANT_ENERGY * power[0][doubtful], power[0][doubtful], np.inf)
        against, cross, gram = self._products(joints, white, count)
        for j, part in zip(joints, above, strict=False):
            assert self.high_band is not None
            assert effect is not None
            cross += self.high_band.cross(part, j, bare=effect.exogenous)
            apart = part.T.reshape(count, k, -1)
            gram += apart @ apart.transpose(0, 2, 1)
        timed = None
        if self.timing is not None and effect is not None and effect.lags and effect.whole_robot:
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

    def _whitened(self, columns: Array, joint: int) -> tuple[Small, Small]:
        """Whitens columns (N, k) of a joint: with the rows that do not count, and without."""
        acts = acting(columns)
        if acts.all():
            whole = self.whitening.filtered(columns, joint, single=True)
            return whole, self.whitening.counted(whole, joint)
        # A push has a column for each joint, zero on all others.
        whole, white = (np.zeros((self.rows, len(acts)), np.float32, order="F") for _ in range(2))
        if acts.any():
            whole[:, acts], white[:, acts] = self._whitened(columns[:, acts], joint)
        return whole, white

    @cached_property
    def _residual(self) -> Small:
        return np.asfortranarray(self.residual, dtype=np.float32)

    def _products(self, joints: tuple[int, ...], white: Sequence[Small], count: int) -> tuple[Array, Array, Array]:
        """Products of white columns (N, count k) with base model (count k, b), residual, each other (count, k, k)."""
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
        """Makes two columns of a torque: what it is in some white rows (N,) of its joints' bands, and the rest."""
        torques = [part.astype(np.float64) @ coefficients for part in group.columns]
        white = [np.column_stack([np.where(rows, x, 0.0), np.where(rows, 0.0, x)]) for x in torques]
        return self.white_group(group.joints, white)

    def white_group(self, joints: tuple[int, ...], white: Sequence[Array]) -> Group:
        """Measures columns (N, k) of some joints that are white already."""
        small = tuple(np.asfortranarray(part, dtype=np.float32) for part in white)
        against, cross, (gram,) = self._products(joints, small, 1)
        return Group(joints, small, against, gram - against @ against.T, np.diag(gram).copy(), cross)

    @cached_property
    def far_from_reversals(self) -> NDArray[np.bool_]:
        """Marks white rows (N,) in which no joint has turned round, come to rest or left it, nor is about to."""
        return self.recording.far_from_reversals(self.whitening.stride)

    def reversal_time_error(self, joint: int) -> Array:
        """How late a joint may turn round [s] by what is not known of its velocity, in white rows (N,)."""
        return self.recording.reversal_time_error_near(joint, self.whitening.stride)

    def _known(self, joints: tuple[int, ...], columns: Sequence[Array]) -> Array:
        """Energy (k,) of whitened columns (N, k) of some joints that is not from beside rows of unknown direction."""
        total = np.zeros(columns[0].shape[1])
        for j, X in zip(joints, columns, strict=True):
            apart = self.whitening.apply(X * self._distant_from[:, j, None], j)
            total += self.whitening.precision[j, j] * _squares(apart)
        return total

    @cached_property
    def _distant_from(self) -> NDArray[np.bool_]:
        """Marks rows (N, n) away from those of unknown direction."""
        return self.recording.distant_from(self.recording.sign_unknown)

    def product(self, first: Group, second: Group) -> Array:
        """Inner products (k1, k2) of what the base model leaves of two groups."""
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
    return np.asarray(np.einsum("ij,ij->j", columns, columns, dtype=float))
