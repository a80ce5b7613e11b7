"""Continuous refinement by IPOPT: all poses move together to where the criterion is best, within all limits."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi
import numpy as np
from numpy.typing import NDArray

from oed.criteria import Criterion
from oed.experiments.pose_designs.information import PoseInformation
from oed.experiments.pose_options import View
from oed.experiments.problems.objective import Objective
from oed.experiments.problems.trap import Trap
from robots.batch import batch_function
from robots.collision import CollisionModel
from robots.common.arrays import Array

ITERATIONS = 150  # of IPOPT, over all stages of the criterion
HALVINGS = 6  # of a pose's way, until the exact limits hold
NEAR = 0.15  # m; pairs that are farther apart at the start are only checked at the end


class PoseProblem:
    """The criterion over the positions of all poses (N n,), with exact gradients.

    Args:
        information: of the poses.
        criterion: a function of the eigenvalues of the information.
        count: N.
    """

    def __init__(self, information: PoseInformation, criterion: Criterion, count: int) -> None:
        rows = information.symbolic()
        q, seed = casadi.SX.sym("q", rows.size1_in(0)), casadi.SX.sym("seed", *rows.size_out(0))
        back = casadi.jtimes(casadi.vec(rows(q)), q, casadi.vec(seed), True)
        self._rows = batch_function(rows)
        self._reverse = batch_function(casadi.Function("reverse", [q, casadi.vec(seed)], [back]))
        self.criterion, self.count, self.joints = criterion, count, int(rows.size1_in(0))
        self._shape = rows.size_out(0)

    @property
    def size(self) -> int:
        """Number of variables."""
        return self.count * self.joints

    def rows(self, q: Array) -> Array:
        """Scaled rows (N, r, L)."""
        return np.asarray(self._rows(q)[0]).reshape(len(q), *self._shape)

    def cost(self, q: Array) -> float:
        """The criterion itself, smaller being better."""
        rows = self.rows(q)
        return self.criterion.cost(np.linalg.eigvalsh(np.einsum("nrl,nrk->lk", rows, rows)))

    def surrogate(self, z: Array, sharpness: float) -> tuple[float, Array]:
        """Gives the smooth stand-in and its gradient (N n,)."""
        q = z.reshape(self.count, self.joints)
        rows = self.rows(q)
        values, vectors = np.linalg.eigh(np.einsum("nrl,nrk->lk", rows, rows))
        value, by_values = self.criterion.surrogate(values, sharpness)
        # Of G = sum J'J: dL = 2 J (V diag(g) V') : dJ.
        seed = 2.0 * rows @ ((vectors * by_values) @ vectors.T)
        return value, self.pulled(q, seed).ravel()

    def pulled(self, q: Array, seed: Array) -> Array:
        """Turns derivatives by the rows (N, r, L) into those by the positions (N, n)."""
        # CasADi's vectors run down the columns.
        (gradient,) = self._reverse(q, np.swapaxes(seed, 1, 2).reshape(len(q), -1))
        return np.asarray(gradient, dtype=float).reshape(q.shape)


def refined(
    information: PoseInformation,
    q: Array,
    criterion: Criterion,
    bounds: tuple[Array, Array],
    allowed: Callable[[Array], NDArray[np.bool_]],
    *,
    model: CollisionModel | None = None,
    clearance: float = 0.0,
    view: View | None = None,
    progress: Callable[[float], None] | None = None,
) -> Array:
    """Moves all poses by IPOPT, with derivatives by CasADi, and keeps what improves the criterion and is allowed.

    Args:
        information: of the poses.
        q: poses that are allowed (N, n) [rad or m].
        criterion: a function of the eigenvalues.
        bounds: lower and upper positions (n,).
        allowed: says which of some poses keep the limits in space, exactly.
        model: bodies that must keep clear of each other; None for none.
        clearance: to keep [m].
        view: of the instrument; None for one that sees all.
        progress: hears the share that is done.

    Returns:
        (N, n) with a criterion that is no worse.
    """
    problem, trap = PoseProblem(information, criterion, len(q)), Trap()
    objective = Objective(problem, trap)
    z = casadi.MX.sym("z", problem.size)
    limits = _limits(information, model, clearance, view, q)
    rows = casadi.MX(0, 1) if limits is None else _at_poses(limits, z, len(q))
    best, value = q, problem.cost(q)
    stages = (*criterion.stages, *criterion.finish)
    options = {**_OPTIONS, "ipopt": {**_OPTIONS["ipopt"], "max_iter": ITERATIONS // len(stages)}}
    at = q
    for number, sharpness in enumerate(stages):
        objective.forget(sharpness)
        solver = casadi.nlpsol("poses", "ipopt", {"x": z, "f": objective(z), "g": rows}, options)
        lower, upper = (np.tile(bound, len(q)) for bound in bounds)
        found = solver(x0=at.ravel(), lbx=lower, ubx=upper, lbg=0.0, ubg=np.inf)
        trap.release()
        at = _kept(np.clip(np.array(found["x"]).reshape(q.shape), *bounds), at, allowed)
        new = problem.cost(at)
        if new < value:
            best, value = at, new
        if progress is not None:
            progress((number + 1) / len(stages))
    return best


_OPTIONS: dict[str, Any] = {
    "print_time": False,
    "error_on_fail": False,
    "ipopt": {
        "print_level": 0,
        "sb": "yes",
        "hessian_approximation": "limited-memory",
        "limited_memory_max_history": 20,
        "tol": 1e-5,
        "acceptable_tol": 1e-4,
        "mu_init": 1e-3,
        "bound_push": 1e-6,
        "bound_frac": 1e-6,
        "nlp_scaling_method": "none",
    },
}


def _limits(
    information: PoseInformation, model: CollisionModel | None, clearance: float, view: View | None, q: Array
) -> casadi.Function | None:
    """What must not be negative at a pose; None where nothing limits it in space."""
    own, found = casadi.SX.sym("q", q.shape[1]), []
    if model is not None and model.pairs:
        # The smooth clearance is never larger than the exact one.
        near = np.flatnonzero(model.clearance(q).min(axis=0) < NEAR)
        if near.size:
            found.append(model.symbolic()(own)[0][near.tolist()] - clearance)
    if view is not None:
        found.append(view.expression(information.symbolic_flange()(own)))
    return casadi.Function("limits", [own], [casadi.vertcat(*found)]) if found else None


def _at_poses(limits: casadi.Function, z: casadi.MX, count: int) -> casadi.MX:
    joints = z.numel() // count
    return casadi.vec(limits.map(count)(casadi.reshape(z, joints, count)))


def _kept(new: Array, before: Array, allowed: Callable[[Array], NDArray[np.bool_]]) -> Array:
    """New poses, each drawn back towards the one before until it is allowed."""
    result = new.copy()
    for k in range(HALVINGS + 1):
        wrong = ~allowed(result)
        if not wrong.any():
            return result
        result[wrong] = before[wrong] if k == HALVINGS else (result[wrong] + before[wrong]) / 2.0
    return result
