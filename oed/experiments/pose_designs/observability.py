"""Observability indices of a set of poses, and the criteria that they add to those of excitation."""

from __future__ import annotations

import numpy as np

from oed.criteria import CRITERIA, Criterion
from oed.criteria import criterion as choose_criterion
from oed.criteria.base import floored, soft_maximum
from robots.common.arrays import Array
from robots.common.errors import InputError

SAME = {"o1": "d", "o2": "cond", "o3": "e"}
"""Indices that order designs of one number of poses as a criterion does."""


def observability_indices(eigenvalues: Array, poses: int) -> dict[str, float]:
    """Computes the five indices of Sun and Hollerbach (ICRA 2008), from the singular values s of the scaled Jacobian.

    ``O1 = (s1 ... sL)^(1/L) / sqrt(m)``, ``O2 = sL / s1``, ``O3 = sL``, ``O4 = sL^2 / s1``,
    ``O5 = 1 / (1/s1 + ... + 1/sL)``.

    Args:
        eigenvalues: of J'J, ascending (L,).
        poses: m.
    """
    s = np.sqrt(floored(eigenvalues))
    return {
        "O1": float(np.exp(np.mean(np.log(s))) / np.sqrt(poses)),
        "O2": float(s[0] / s[-1]),
        "O3": float(s[0]),
        "O4": float(s[0] ** 2 / s[-1]),
        "O5": float(1.0 / np.sum(1.0 / s)),
    }


class _NoiseAmplification(Criterion):
    """O4, the noise amplification index (Nahvi and Hollerbach 1996), to be maximised."""

    name = "o4"
    label = "O4"
    larger_is_better = True
    stages = (16.0, 64.0)
    finish = (256.0,)

    def value(self, eigenvalues: Array) -> float:
        floor = floored(eigenvalues)
        return float(floor[0] / np.sqrt(floor[-1]))

    def surrogate(self, eigenvalues: Array, sharpness: float) -> tuple[float, Array]:
        """Bounds -log O4 from above."""
        floor = floored(eigenvalues)
        logs = np.log(floor)
        top, by_top = soft_maximum(logs, sharpness)
        bottom, by_bottom = soft_maximum(-logs, sharpness)
        return top / 2.0 + bottom, (by_top / 2.0 - by_bottom) / floor


class _InverseSum(Criterion):
    """O5, the inverse of the sum of inverse singular values (Sun and Hollerbach 2008), to be maximised."""

    name = "o5"
    label = "O5"
    larger_is_better = True

    def value(self, eigenvalues: Array) -> float:
        return float(1.0 / np.sum(1.0 / np.sqrt(floored(eigenvalues))))

    def surrogate(self, eigenvalues: Array, sharpness: float) -> tuple[float, Array]:
        """Gives -log O5."""
        floor = floored(eigenvalues)
        inverse = 1.0 / np.sqrt(floor)
        return float(np.log(inverse.sum())), -0.5 * inverse / floor / inverse.sum()


def pose_criterion(name: str) -> Criterion:
    """Gives a criterion of poses: one of those of excitation, or o1 to o5.

    Args:
        name: cond, d, a, e, or o1 to o5.

    Raises:
        InputError: another name, or a criterion that needs a task.
    """
    own = {"o4": _NoiseAmplification, "o5": _InverseSum}
    if name in own:
        return own[name]()
    chosen = SAME.get(name, name)
    if chosen not in CRITERIA or chosen == "i":
        raise InputError(f"unknown criterion {name!r} of poses", allowed="d, cond, a, e, cond-d, or o1 to o5")
    return choose_criterion(chosen)
