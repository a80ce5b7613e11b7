"""Instrumental variables: the inverse dynamic model, without the bias by noise in the motion."""

from __future__ import annotations

import numpy as np

from estimation.estimators.base import Array, Solution
from estimation.estimators.simulated import SETTLED_TORQUE_SHARE, Instruments, SimulatingEstimator, instrumented_moments
from estimation.regressions.regression_data import RegressionData
from estimation.regressions.regularisation import regularisation, solve_scaled, torque_change
from robots.common.errors import SolverError
from robots.signals import Motion


class InstrumentalVariables(SimulatingEstimator):
    """pi = (Z'W Y)^-1 Z'W tau, Z the regressor of the identified model's own simulated motion (IDIM-IV, Janot 2014).

    Y holds the measured motion, Z that of the closed loop simulated along the same reference with the last estimate:
    what they share is the motion, not the measurement's noise, so the estimate has no bias from noise in the positions.
    Iterated from weighted least squares; a few rounds settle. Without a recorded reference the measured motion,
    smoothed further, stands in for it; noise within that narrow band then stays shared, and some of the bias with it.

    Source: A. Janot, P.-O. Vandanjon, M. Gautier, "A generic instrumental variable approach for industrial robot
    identification", IEEE Transactions on Control Systems Technology 22, 2014, 10.1109/TCST.2013.2246163.

    The solution's extras: ``simulated``, the motions behind Z, ``rounds``, and whether it ``settled``.
    """

    name = "iv"

    def refine(self, data: RegressionData, values: Array, weights: Array) -> Solution:
        """Iterates simulation and instrumental-variable estimate until the parameters settle.

        Raises:
            InputError: references that do not suit the logs.
            SolverError: the simulation is not stable, or the instruments are not correlated with some parameters.
        """
        instruments = Instruments(data, self.loop)
        level = data.moments.level(values)
        motions: list[Motion] = []
        rounds, settled = 0, False
        while not settled and rounds < 10:
            rounds += 1
            motions = instruments.simulate(values)
            gram, cross = np.zeros_like(data.moments.gram), np.zeros_like(data.moments.cross)
            for part, motion, mask in zip(data.parts, motions, instruments.masks(motions), strict=True):
                of_gram, of_cross = instrumented_moments(data, part, motion, mask)
                gram, cross = gram + of_gram, cross + of_cross
            total = np.tensordot(weights, gram, axes=1)
            extra, right = regularisation(data.moments, weights, np.abs(total), data.ridge)
            before, values = values, _solve(total + extra, weights @ cross + right)
            settled = bool((torque_change(data.moments, values - before) <= SETTLED_TORQUE_SHARE * level).all())
        return Solution(
            values=values,
            weights=weights,
            covariance=instruments.covariance(motions, weights, values, measured=True),
            extras={"simulated": motions, "rounds": rounds, "settled": settled},
        )


def _solve(matrix: Array, right: Array) -> Array:
    try:
        return solve_scaled(matrix, right)
    except np.linalg.LinAlgError as error:
        raise SolverError("instrumental variables: the instruments are not correlated with some parameters") from error
