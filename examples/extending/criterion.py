"""A criterion of one's own: the geometric mean of the two smallest singular values of the regressor.

Run it with ``python criterion.py``.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

import oed


class TwoSmallest(oed.Criterion):
    """sqrt(sigma_1 sigma_2) of Y, to be large: less nervous than the smallest singular value alone."""

    name: ClassVar[str] = "two-smallest"
    label: ClassVar[str] = "geometric mean of the two smallest singular values of Y"
    larger_is_better: ClassVar[bool] = True

    def value(self, eigenvalues: np.ndarray) -> float:
        """Gives the mean, from the eigenvalues (m,) of Y'Y in ascending order."""
        return float((eigenvalues[0] * eigenvalues[1]) ** 0.25)

    def surrogate(self, eigenvalues: np.ndarray, sharpness: float) -> tuple[float, np.ndarray]:
        """Gives what is minimised, minus the logarithm of the mean, and its slope by each eigenvalue (m,)."""
        smallest = np.maximum(eigenvalues[:2], 1e-15 * eigenvalues[-1])
        slope = np.zeros_like(eigenvalues)
        slope[:2] = -0.25 / smallest
        return float(-0.25 * np.log(smallest).sum()), slope


if __name__ == "__main__":
    quick = oed.SearchOptions(effort=oed.Effort(islands=1, starts=2, hops=0, finish_samples=100), workers=1)
    model = oed.ModelOptions(friction="coulomb-viscous")
    own = oed.design("er3a", criterion=TwoSmallest(), model=model, search=quick)
    usual = oed.design("er3a", criterion="cond", model=model, search=quick)
    for design in (own, usual):
        print(f"{design.criterion.name}: {design.optimised.value(TwoSmallest()):.4g}")
