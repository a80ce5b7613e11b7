"""An estimator of one's own: the same relative error counts alike on a shoulder and on a wrist.

Run it with ``python estimator.py``.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from estimation import identify
from estimation.estimators import ESTIMATORS, Estimator
from robots import load_robot, nominal_plant, simulate


@ESTIMATORS.register
class LoadWeighted(Estimator):
    """Least squares in which the rows of joint j count by one over its mean square torque."""

    name: ClassVar[str] = "load-weighted"

    def weights(self, moments, ridge: float) -> np.ndarray:
        """Gives one over the mean square torque of each joint (n,)."""
        return moments.count / np.maximum(moments.square, np.finfo(float).tiny)


if __name__ == "__main__":
    import oed

    robot = load_robot("er3a")
    search = oed.SearchOptions(effort=oed.Effort(islands=1, starts=1, hops=0, finish_samples=100), workers=1)
    design = oed.design(robot, trajectory=oed.TrajectoryOptions(periods=1, strokes=False), search=search)
    log = simulate(nominal_plant(robot), design.motion, seed=1)
    for method in ("load-weighted", "wls"):
        estimate = identify(robot, log, method=method)
        shares = [100 * joint.residual_rms / joint.torque_rms for joint in estimate.joints]
        print(f"{method}: residual {', '.join(f'{share:.2f}' for share in shares)} % of each joint's torque")
