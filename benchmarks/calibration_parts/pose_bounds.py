"""What poses can inform at best: the optimum over weights of all poses within the ranges (Kiefer and Wolfowitz 1960).

No N poses have less error than N times the best weighted poses. Weights follow the multiplicative algorithm (Silvey,
Titterington and Torsney 1978); poses are added where the derivative of the criterion is largest, by L-BFGS-B from many
starts. Collisions are not looked at: with them the optimum can only be worse.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize

from oed.experiments.pose_designs.information import PoseInformation
from oed.experiments.pose_designs.observability import pose_criterion
from oed.experiments.pose_designs.refinement import PoseProblem

STEPS, ROUNDS, STARTS = 150, 8, 24


def best_information(
    information: PoseInformation, q: np.ndarray, bounds: tuple[np.ndarray, np.ndarray], weight: np.ndarray | None
) -> tuple[np.ndarray, float]:
    """The information of one pose on average at the optimum, and by which factor the true optimum may be better.

    Args:
        information: of poses.
        q: poses to start from.
        bounds: ranges of the joints.
        weight: C of the criterion trace(C inv(M)); None for log det M.
    """
    problem = PoseProblem(information, pose_criterion("d"), 1)
    size = information.size
    rows = problem.rows(q)
    flat = (np.swapaxes(rows, 1, 2) @ rows).reshape(len(q), -1)
    share = np.full(len(q), 1.0 / len(q))
    slack = np.inf
    for _ in range(ROUNDS):
        for _ in range(STEPS):
            total = (share @ flat).reshape(size, size)
            derivative = _derivative(total, weight)
            gain = flat @ derivative.ravel()
            share = share * (gain if weight is None else np.sqrt(gain))
            share /= share.sum()
        total = (share @ flat).reshape(size, size)
        derivative = _derivative(total, weight)
        gain = flat @ derivative.ravel()
        rng = np.random.default_rng(len(q))
        starts = np.vstack([q[np.argsort(-gain)[:STARTS]], rng.uniform(*bounds, (STARTS, len(bounds[0])))])
        found = [_highest(problem, derivative, start, bounds) for start in starts]
        new = np.array([place for place, _ in found])
        # Derivatives are scaled so that they are 1 on average at the optimum.
        slack = max(float(gain.max()), max(value for _, value in found))
        if slack < 1.01:
            break
        keep = share > 1e-7
        own = problem.rows(new)
        q, flat = (
            np.vstack([q[keep], new]),
            np.vstack([flat[keep], (np.swapaxes(own, 1, 2) @ own).reshape(len(new), -1)]),
        )
        share = np.concatenate([0.9 * share[keep], np.full(len(new), 0.1 / len(new))])
        share /= share.sum()
    return total, slack


def _derivative(total: np.ndarray, weight: np.ndarray | None) -> np.ndarray:
    inverse = np.linalg.inv(total)
    if weight is None:
        return inverse / len(total)
    middle = inverse @ weight @ inverse
    return middle / np.trace(weight @ inverse)


def _highest(problem: PoseProblem, derivative: np.ndarray, start: np.ndarray, bounds) -> tuple[np.ndarray, float]:
    def cost(x: np.ndarray) -> tuple[float, np.ndarray]:
        own = problem.rows(x[None])
        seed = 2.0 * own @ derivative
        return -float(np.sum(own * (own @ derivative))), -problem.pulled(x[None], seed)[0]

    found = minimize(cost, start, jac=True, method="L-BFGS-B", bounds=list(zip(*bounds, strict=True)))
    return found.x, -float(found.fun)
