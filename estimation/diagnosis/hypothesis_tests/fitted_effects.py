"""Fitted effects with their BIC score (chi-square minus the cost of the parameters), and that of several together."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.calibration import CLOSE_RIVAL_BIC, RARE_ODDS
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Group, Problem
from estimation.diagnosis.hypothesis_tests.scoring import Accepted, accept
from robots.common.arrays import Array
from robots.terms.effect_bases.capabilities import Persistence

# An effect acts where its torque exceeds this share of its maximum.
ACTS = 0.02


@dataclass(frozen=True, eq=False)
class FittedEffect:
    """A hypothesis with its best shape, fitted beside the base model and other effects.

    Attributes:
        hypothesis: effect and joint.
        shape: one value per shape parameter.
        group: its columns at that shape.
        gain: chi-square explained beside the others, with bounded coefficients.
        coefficients: (k,), fitted beside the others.
        degrees: number of visible coefficients and fitted shape parameters.
        visible: largest share of a column's energy that the model without it does not absorb.
        birge_ratio: scatter of its estimates (per joint, or near and far from reversals) over the expected one, at
            least 1 (Birge 1932). The gain is divided by it.
        motion_error_chi2: part of that gain that errors of the motion may cause. It counts against other effects, but
            not against no effect.
    """

    hypothesis: Hypothesis
    shape: tuple[float, ...]
    group: Group
    gain: float
    coefficients: Array
    degrees: int
    visible: float
    birge_ratio: float = 1.0
    motion_error_chi2: float = 0.0

    @property
    def evidence(self) -> Evidence:
        """Evidence against other effects in its place."""
        prior = RARE_ODDS if self.hypothesis.effect.rare else 0.0
        rows = len(self.group.columns[0]) * len(self.group.joints)
        return Evidence(self.gain / self.birge_ratio, self.degrees, rows, prior)

    @cached_property
    def local_evidence(self) -> Evidence:
        """Evidence against no effect. A transient effect counts only the rows in which it acts."""
        known = self.evidence
        rows = (
            min(known.rows, self._acting_rows())
            if self.hypothesis.effect.persistence is Persistence.TRANSIENT
            else known.rows
        )
        return replace(known, chi2=known.chi2 - self.motion_error_chi2, rows=rows)

    @property
    def bic_gain(self) -> float:
        """BIC gain of `evidence`."""
        return self.evidence.bic_gain

    @property
    def local_bic_gain(self) -> float:
        """BIC gain of `local_evidence`."""
        return self.local_evidence.bic_gain

    @property
    def best_bic_gain(self) -> float:
        """The better of both BIC gains: a transient effect need not pay for rows in which it does not act."""
        return max(self.bic_gain, self.local_bic_gain)

    @property
    def excess_chi2(self) -> float:
        """Chi-square minus its mean in pure noise; not negative."""
        return max(self.gain - self.degrees, 0.0)

    def _acting_rows(self) -> float:
        """Returns the effective number of rows (sum x^2)^2 / sum x^4, mean over columns, at least two."""
        whole = np.concatenate(self.group.columns).astype(float) ** 2
        square, fourth = whole.sum(axis=0), (whole**2).sum(axis=0)
        counts = square[fourth > 0] ** 2 / fourth[fourth > 0]
        return max(float(counts.mean()), 2.0) if len(counts) else np.inf

    def torque(self, problem: Problem) -> Array:
        """Evaluates its torque (N0, n) [N m or N]."""
        return problem.dense(self.hypothesis, self.shape) @ self.coefficients

    def gain_on(self, joints: Collection[int]) -> float:
        """Returns the part of the gain on some joints, from 0, in proportion to the torque's energy there."""
        energies = [float(np.sum((X @ self.coefficients) ** 2)) for X in self.group.columns]
        there = sum(e for j, e in zip(self.group.joints, energies, strict=True) if j in joints)
        return self.gain * there / max(sum(energies), 1e-300)

    def acts(self, share: float = ACTS) -> NDArray[np.bool_]:
        """Returns the white rows (N,) in which its torque exceeds a share of its maximum on any joint."""
        torques = [np.abs(part @ self.coefficients) for part in self.group.columns]
        return np.asarray(np.max([torque > share * torque.max(initial=0.0) for torque in torques], axis=0))

    def share_beside(self, other: FittedEffect, joint: int) -> float:
        """Returns the share of its torque energy on a joint, from 0, in rows where another effect acts."""
        if joint not in self.group.joints or joint not in other.group.joints:
            return 0.0
        own, size = (np.abs(m.group.columns[m.group.joints.index(joint)] @ m.coefficients) for m in (self, other))
        acts = size > ACTS * size.max(initial=0.0)
        return float(np.sum(own[acts] ** 2) / max(np.sum(own**2), 1e-300))


def set_bic_gain(problem: Problem, members: Sequence[FittedEffect]) -> float:
    """Returns the BIC gain of several effects together."""
    cost = sum(member.gain - member.bic_gain for member in members)
    return accept(problem, tuple(m.group for m in members)).gain - cost


def accept_all_but(problem: Problem, members: Sequence[FittedEffect], i: int) -> Accepted:
    """Accepts the groups of all members except the i-th."""
    return accept(problem, tuple(m.group for k, m in enumerate(members) if k != i))


@dataclass(frozen=True)
class Evidence:
    """Evidence for a model with an effect, compared with the model without it.

    Attributes:
        chi2: decrease of the squared whitened residual.
        degrees: number of fitted parameters: visible coefficients and free shape parameters.
        rows: number of data N: white rows times the joints on which the effect acts.
        prior: twice the log of the prior odds against the effect.
    """

    chi2: float
    degrees: int
    rows: float
    prior: float = 0.0

    @property
    def bic_gain(self) -> float:
        """Decrease of the Bayesian information criterion (Schwarz 1978); larger is better."""
        return self.chi2 - self.degrees * math.log(self.rows) - self.prior


def is_close_rival(rare: bool, worse: float) -> bool:
    """Whether a rival fits about as well: by the data alone, without its prior penalty, if it is rare.

    Args:
        rare: whether robots seldom have the rival.
        worse: by how much its BIC is worse.
    """
    return worse < (RARE_ODDS if rare else CLOSE_RIVAL_BIC)
