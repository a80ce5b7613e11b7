"""BIC score by which models are compared: chi-square minus the cost of the parameters."""

from __future__ import annotations

import math
from dataclasses import dataclass

from estimation.diagnosis.calibration import CLOSE_RIVAL_BIC, RARE_ODDS


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
