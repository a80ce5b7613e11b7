"""Direct and inverse identification: torque alone, against the torque of the simulated closed loop."""

from __future__ import annotations

from functools import reduce
from operator import add

from estimation.estimators.base import Array, Solution
from estimation.estimators.simulated import SETTLED_TORQUE_SHARE, Instruments, SimulatingEstimator, simulated_moments
from estimation.regressions.regression_data import RegressionData
from estimation.regressions.regularisation import torque_change
from robots.signals import Motion


class DirectAndInverse(SimulatingEstimator):
    """min ||tau - tau_s(pi)||^2, tau_s the torque of the closed loop simulated with pi along the reference (DIDIM).

    The simulated motion hardly depends on the parameters while the controller tracks, so the Jacobian of tau_s is the
    regressor of the simulated motion: each round is one linear least squares of the measured torque on it. The measured
    positions enter only where no reference was recorded, smoothed further; with one, noise in them does not matter at
    all.

    Source: M. Gautier, A. Janot, P.-O. Vandanjon, "A new closed-loop output error method for parameter identification
    of robot dynamics", IEEE Transactions on Control Systems Technology 21, 2013, 10.1109/TCST.2012.2185697.

    The solution's extras: ``simulated``, the motions, ``rounds``, and whether it ``settled``.
    """

    name = "didim"

    def refine(self, data: RegressionData, values: Array, weights: Array) -> Solution:
        """Iterates simulation and least squares until the parameters settle.

        Raises:
            InputError: references that do not suit the logs.
            SolverError: a simulation that is not stable.
        """
        instruments = Instruments(data, self.loop)
        level = data.moments.level(values)
        motions: list[Motion] = []
        rounds, settled = 0, False
        while not settled and rounds < 12:
            rounds += 1
            motions = instruments.simulate(values)
            parts = zip(data.parts, motions, instruments.masks(motions), strict=True)
            moments = reduce(add, (simulated_moments(data, part, motion, mask) for part, motion, mask in parts))
            before, values = values, moments.pulled(data.moments.pull).solve(weights, data.ridge)
            settled = bool((torque_change(moments, values - before) <= SETTLED_TORQUE_SHARE * level).all())
        return Solution(
            values=values,
            weights=weights,
            covariance=instruments.covariance(motions, weights, values, measured=False),
            extras={"simulated": motions, "rounds": rounds, "settled": settled},
        )
