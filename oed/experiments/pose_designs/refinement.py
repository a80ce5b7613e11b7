"""Continuous refinement: each pose in turn moves to where the criterion is best, within all limits."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from oed.criteria import Criterion
from oed.experiments.pose_designs.information import PoseInformation

Array = NDArray[np.float64]

STEP = 1e-4  # rad or m; of the differences
ITERATIONS = 12  # of a pose's search
SWEEPS = 2
HALVINGS = 6  # back towards the pose before, until all limits hold


def refined(
    information: PoseInformation,
    q: Array,
    criterion: Criterion,
    bounds: tuple[Array, Array],
    allowed: Callable[[Array], NDArray[np.bool_]],
    progress: Callable[[float], None] | None = None,
) -> Array:
    """Moves poses one by one (L-BFGS-B) and keeps what improves the criterion and is allowed.

    Args:
        information: of the poses.
        q: poses that are allowed (N, n) [rad or m].
        criterion: a function of the eigenvalues.
        bounds: lower and upper positions (n,).
        allowed: says which of some poses keep the limits in space.
        progress: hears the share that is done.

    Returns:
        (N, n) with a criterion that is no worse.
    """
    q = q.copy()
    rows = information.rows(q)
    total = np.einsum("nrl,nrk->lk", rows, rows)
    value = criterion.cost(np.linalg.eigvalsh(total))
    for sweep in range(SWEEPS):
        before = value
        for k in range(len(q)):
            without = total - rows[k].T @ rows[k]

            def cost(poses: Array, without: Array = without) -> Array:
                own = information.rows(poses)
                found = without + np.swapaxes(own, 1, 2) @ own
                return np.array([criterion.cost(values) for values in np.linalg.eigvalsh(found)])

            best = _moved(q[k], cost, bounds)
            for _ in range(HALVINGS):
                new = float(cost(best[None])[0])
                if new >= value:
                    break
                if allowed(best[None])[0]:
                    q[k], value = best, new
                    rows[k] = information.rows(best[None])[0]
                    total = without + rows[k].T @ rows[k]
                    break
                best = (best + q[k]) / 2.0
            if progress is not None:
                progress((sweep + (k + 1) / len(q)) / SWEEPS)
        if before - value <= 1e-4 * abs(before):
            break
    return q


def _moved(pose: Array, cost: Callable[[Array], Array], bounds: tuple[Array, Array]) -> Array:
    """The best pose nearby, by differences."""

    def with_gradient(x: Array) -> tuple[float, Array]:
        values = cost(np.vstack([x, x + STEP * np.eye(len(x)), x - STEP * np.eye(len(x))]))
        n = len(x)
        return float(values[0]), (values[1 : n + 1] - values[n + 1 :]) / (2.0 * STEP)

    found = minimize(
        with_gradient,
        pose,
        jac=True,
        method="L-BFGS-B",
        bounds=list(zip(*bounds, strict=True)),
        options={"maxiter": ITERATIONS},
    )
    return np.clip(found.x, *bounds)
