"""The one score by which models are compared: chi-square, less what its parameters cost."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Evidence:
    """What data say for a model with an effect against the model without it.

    Attributes:
        chi2: fall of the squared residual, in units of the noise's variance.
        degrees: parameters fitted: coefficients that show and free shape parameters.
        rows: number of data N: white rows times the joints that the effect acts on.
        prior: twice the log of the prior odds against it.
    """

    chi2: float
    degrees: int
    rows: float
    prior: float = 0.0

    @property
    def bic_gain(self) -> float:
        """Fall of Schwarz's criterion; larger is better."""
        return self.chi2 - self.degrees * math.log(self.rows) - self.prior

    @property
    def excess(self) -> float:
        """Chi-square above what as many columns of noise explain on average; not negative."""
        return max(self.chi2 - self.degrees, 0.0)
