"""Parameters of several models in one basis, and errors for models that cannot be compared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimation.comparisons.runs import Run
from estimation.logs.provenance import are_same_log
from estimation.models.model import Model
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.terms import Column, FrictionTerm

# What a model lacks biases the parameters alike where the motion is the same, and otherwise where it is not. Standard
# errors do not hold that bias. Between other motions they are this many times larger (`benchmarks/comparison.py`).
OTHER_MOTION_FACTOR = 3.0
# Speeds at which friction curves are fitted to each other, as shares of the largest.
SHARES = np.linspace(0.02, 1.0, 60)


@dataclass(frozen=True, kw_only=True)
class CommonParameters:
    """All runs' parameters by the columns of the first model.

    Attributes:
        columns: descriptions of the parameters (b,).
        values: (k, b).
        covariances: (k, b, b).
        determined: (b,), where all runs determine the parameter.
        same_motion: whether all runs recorded one motion.
        unlike: joints whose friction has another width of the sign in some run. Single coefficients of such curves do
            not compare: near standstill they make up for the width.
        misfit: largest difference of a friction curve that was converted to the first model's basis, as a share of the
            friction level; 0 where all have the same basis.
    """

    columns: tuple[Column, ...]
    values: Array
    covariances: Array
    determined: NDArray[np.bool_]
    same_motion: bool
    misfit: float
    unlike: frozenset[int] = frozenset()


def common_parameters(runs: Sequence[Run], speeds: Array) -> CommonParameters:
    """Brings the parameters of all runs into the basis of the first.

    Friction terms whose curves bend at other speeds are converted by least squares over the common speeds; that is
    linear in the coefficients.

    Args:
        runs: checked by `require_comparable`.
        speeds: largest speed of each joint (n,) [rad/s or m/s].
    """
    first = runs[0].model
    position = {name: i for i, name in enumerate(first.names)}
    values, covariances, misfit = [], [], 0.0
    for run in runs:
        model = run.model
        order = np.argsort([position[name] for name in model.names])
        pi, covariance = model.values[order], model.covariance[np.ix_(order, order)]
        if _friction_basis(model) != _friction_basis(first):
            change, error = _conversion(model, first, speeds, pi)
            pi, covariance, misfit = change @ pi, change @ covariance @ change.T, max(misfit, error)
        values.append(pi)
        covariances.append((covariance + covariance.T) / 2)
    known = [dict(zip(run.model.names, run.model.determined.tolist(), strict=True)) for run in runs]
    determined = np.array([all(run[name] for run in known) for name in first.names])
    # A parameter without variance was not estimated.
    determined &= (np.einsum("kii->ki", np.array(covariances)) > 0).all(axis=0)
    same = is_same_motion(runs)
    return CommonParameters(
        columns=first.parameters,
        values=np.array(values),
        covariances=np.array(covariances) * (1.0 if same else OTHER_MOTION_FACTOR**2),
        same_motion=same,
        determined=determined,
        misfit=misfit,
        unlike=_unlike_signs(runs),
    )


def is_same_motion(runs: Sequence[Run]) -> bool:
    """Whether all runs recorded one motion, by the ranges of positions and speeds."""
    recorded = [run.model.provenance.get("recorded") for run in runs]
    if not all(recorded):
        return False
    ranges = [np.concatenate([np.ravel(known[key]) for key in ("position", "velocity")]) for known in recorded if known]
    # Ranges of positions and speeds that agree within 5 % are of one motion, and so are all below a floor [rad, m,
    # rad/s, m/s]. Filtered speeds of one motion differ by a few per cent with the noise and the control loop.
    scale = np.maximum(np.abs(ranges[0]), 0.1)
    return all(bool((np.abs(other - ranges[0]) <= 0.05 * scale).all()) for other in ranges[1:])


def require_comparable(runs: Sequence[Run]) -> None:
    """Refuses models that have nothing to compare, and says what differs.

    Raises:
        InputError: fewer than two models; other robots, parameters or units; a model given twice; two of one log; no
            covariance.
    """
    if len(runs) < 2:
        raise InputError(f"{len(runs)} model to compare", allowed="two or more")
    first = runs[0]
    for run in runs:
        if not (np.diag(run.model.covariance) > 0).any():
            raise InputError(
                "the model has no covariance, so its differences from others cannot be tested",
                file=run.file or run.label,
                remedy="identify the robot again with oed identify",
            )
    for run in runs[1:]:
        problem, remedy = _robot_difference(first.model, run.model)
        if problem is None:
            problem, remedy = _column_difference(first, run)
        if problem is not None:
            raise InputError(f"{run.label} and {first.label} cannot be compared: {problem}", remedy=remedy)
    for i, run in enumerate(runs):
        for other in runs[:i]:
            _require_independent(run, other)


def _robot_difference(one: Model, other: Model) -> tuple[str | None, str]:
    remedy = "compare robots of one type"
    a, b = one.robot, other.robot
    if a.n != b.n:
        return f"{b.name} has {b.n} joints, {a.name} has {a.n}", remedy
    for j, (p, q) in enumerate(zip(a.chain.joints, b.chain.joints, strict=True), start=1):
        if p.kind != q.kind:
            return f"joint {j} is {q.kind} in {b.name} and {p.kind} in {a.name}", remedy
        pairs = ((p.translation, q.translation, "m"), (p.rotation, q.rotation, "rad"), (p.axis, q.axis, "rad"))
        for u, v, unit in pairs:
            off = float(np.abs(np.asarray(u) - np.asarray(v)).max())
            # Places and directions of joints that differ by more than this [m, rad] make another robot.
            if off > 1e-3:
                what = "stands" if unit == "m" else "points"
                return f"joint {j} of {b.name} {what} otherwise than that of {a.name}, by {off:.3g} {unit}", remedy
    return None, ""


def _column_difference(first: Run, run: Run) -> tuple[str | None, str]:
    remedy = "identify both with the same --friction, --position, --rotor and --offset"
    if len({run.model.provenance.get("method") == "diagnosis" for run in (first, run)}) > 1:
        # A diagnosis has finer friction than an identification.
        remedy = "compare models of one command: identify both logs, or diagnose both"
    for one, other in ((first, run), (run, first)):
        missing = [name for name in one.model.names if name not in set(other.model.names)]
        if missing:
            listed = ", ".join(missing[:6]) + (f" and {len(missing) - 6} more" if len(missing) > 6 else "")
            return f"{other.label} lacks the parameters {listed}", remedy
    units = {column.name: column.unit for column in first.model.parameters}
    for column in run.model.parameters:
        if column.unit != units[column.name]:
            return (
                f"{column.name} is in {column.unit} in {run.label} and in {units[column.name]} in {first.label}",
                remedy,
            )
    return None, ""


def _require_independent(run: Run, other: Run) -> None:
    a, b = run.model, other.model
    if a.names == b.names and np.array_equal(a.values, b.values):
        raise InputError(f"{run.label} and {other.label} are the same model", allowed="models of different logs")
    for log in a.provenance.get("logs", ()):
        if log.get("sha256") and any(
            are_same_log(log, known) for known in b.provenance.get("logs", ()) if known.get("sha256")
        ):
            raise InputError(
                f"{run.label} and {other.label} were identified from the same log {log.get('name')}: their errors are "
                "not independent",
                allowed="models of different logs",
            )


def friction_term_of(model: Model) -> FrictionTerm | None:
    """Finds the friction term of a model; None without one."""
    return next((term for term in model.torque_model.terms if isinstance(term, FrictionTerm)), None)


def _friction_basis(model: Model) -> object:
    """What the friction's coefficients mean, but for the width of the sign, which matters near standstill only."""
    term = friction_term_of(model)
    return None if term is None else replace(term, velocity_scale=0.0)


def friction_table(model: Model, names: Sequence[str], speeds: Array, shares: Array) -> Array:
    """Evaluates friction columns (m, c), each on its own joint at shares (m,) of that joint's speed; others are zero.

    Args:
        model: whose friction.
        names: of the parameters (c,).
        speeds: of each joint (n,) [rad/s or m/s].
        shares: of the speeds (m,).
    """
    terms, n, m = model.torque_model, model.robot.n, len(shares)
    index = [terms.names.index(name) for name in names]
    friction = [place for place, i in enumerate(index) if terms.columns[i].friction]
    found = np.zeros((m, len(names)))
    if friction:
        chosen = [index[place] for place in friction]
        rest = np.zeros((n, m))
        Y = terms.symbolic(chosen).map(m)(rest, np.outer(speeds, shares), rest).full().reshape(n, m, len(chosen))
        joints = [terms.columns[i].joint - 1 for i in chosen]
        found[:, friction] = Y[joints, :, range(len(chosen))].T
    return found


def _unlike_signs(runs: Sequence[Run]) -> frozenset[int]:
    terms = [friction_term_of(run.model) for run in runs]
    n = runs[0].model.robot.n
    widths = np.array([np.broadcast_to(0.0 if term is None else term.velocity_scale, n) for term in terms])
    return frozenset((np.flatnonzero(np.ptp(widths, axis=0) > 0) + 1).tolist())


def _conversion(model: Model, first: Model, speeds: Array, pi: Array) -> tuple[Array, float]:
    """Matrix (b, b) from a model's parameters to those of the first model's friction, and the largest misfit."""
    change, misfit = np.eye(len(first.names)), 0.0
    source, target = (friction_table(m, first.names, speeds, SHARES) for m in (model, first))
    for joint in range(1, model.robot.n + 1):
        own = [i for i, column in enumerate(first.parameters) if column.friction and column.joint == joint]
        if not own:
            continue
        # Collinear shapes: the smallest coefficients that give the curve.
        block = np.linalg.lstsq(target[:, own], source[:, own], rcond=1e-10)[0]
        change[np.ix_(own, own)] = block
        curve = source[:, own] @ pi[own]
        error = target[:, own] @ (block @ pi[own]) - curve
        misfit = max(misfit, float(np.abs(error).max() / max(np.abs(curve).max(), np.finfo(float).tiny)))
    return change, misfit
