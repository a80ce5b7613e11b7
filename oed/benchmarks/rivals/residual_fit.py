"""A free fit of the residual by generic columns: the group that explains most of it gives the effect's name."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin
import yaml
from scipy.linalg import lstsq, qr, solve_toeplitz
from scipy.signal import lfilter
from scipy.stats import f as f_distribution

from oed.benchmarks.answers.answer import CaseAnswer, NamedEffect
from oed.benchmarks.folders import BlindCase
from oed.benchmarks.rivals.base_model import (
    BaseFit,
    Motion,
    away_from_reversals,
    base_columns,
    filtered,
    fit,
    motion_of,
)
from oed.benchmarks.rivals.logs import read_motion
from robots.common.arrays import Array

LEAST_RESIDUAL_SHARE = 0.02
"""Share of the torque RMS that an effect explains at least; chosen on a dozen cases without an effect."""

DEPENDENT_SHARE, TINY = 1e-6, 1e-300

WHOLE = ("delay",)
"""Groups that stand for an effect of the whole robot."""


@dataclass(frozen=True, kw_only=True)
class Pick:
    """A group of columns at a joint.

    Attributes:
        name: of the group.
        j: the joint, from 0.
        explained: share of the whitened residual's sum of squares that the group explains.
        of_possible: the same over what all groups together explain.
        p_value: of the F test, without correction.
        size: RMS of the filtered torque that it explains, over the RMS of the joint's filtered torque.
    """

    name: str
    j: int
    explained: float
    of_possible: float
    p_value: float
    size: float


def by_residual_fit(case: BlindCase) -> CaseAnswer:
    """Answers a case by a stepwise fit of the base model's residual.

    At each joint the residual, whitened by an autoregressive model, is fitted by each group of columns. The group that
    explains the largest share enters the model, which is fitted again, until no group is significant. A group is
    significant by an F test with Bonferroni's correction for all groups and joints, if it explains at least
    `LEAST_RESIDUAL_SHARE`.

    Args:
        case: the public part of the case.
    """
    model = pin.buildModelFromUrdf(str(case.urdf))
    gears = gear_ratios(case.yaml, case.joints)
    t, q, tau = read_motion(case.log, case.joints, torque=True)
    motion = motion_of(t, q)
    log_columns = base_columns(model, motion)
    slow = filtered(log_columns, motion.period), filtered(tau, motion.period), away_from_reversals(motion)
    base = fit(*slow)
    level = np.sqrt((slow[1] ** 2).mean(axis=0))
    torque = log_columns @ base.parameters
    listed = [
        [(name, filtered(group, motion.period)) for name, group in groups(motion, torque, j, gear)]
        for j, gear in enumerate(gears)
    ]
    picks: list[Pick] = []
    found = base
    # Largest number of effects.
    while len(picks) < 3:
        best = _best(found, level, listed, picks)
        if best is None:
            break
        picks.append(best)
        found = fit(*slow, _chosen(picks, [dict(names) for names in listed]))
    t, q, _ = read_motion(case.unseen, case.joints, torque=False)
    unseen = motion_of(t, q)
    columns = base_columns(model, unseen)
    if picks:
        other = columns @ base.parameters
        named_groups = [dict(groups(unseen, other, j, gear)) for j, gear in enumerate(gears)]
        columns = np.concatenate([columns, _chosen(picks, named_groups)], axis=2)
    # Share of what all groups together explain that one must explain to give the name.
    named = [pick for pick in picks if pick.of_possible >= 0.5]
    return CaseAnswer(
        verdict="nothing" if not picks else "effects" if named else "unexplained",
        effects=tuple(
            NamedEffect(effect=pick.name, joints=() if pick.name in WHOLE else (pick.j + 1,)) for pick in named
        ),
        torque=columns @ found.parameters,
    )


def _best(found: BaseFit, level: Array, listed: list[list[tuple[str, Array]]], picks: list[Pick]) -> Pick | None:
    """Finds the significant group that explains the largest share of a joint's residual; None if there is none."""
    used = {pick.name if pick.name in WHOLE else (pick.name, pick.j) for pick in picks}
    tried = [
        pick
        for j, candidates in enumerate(listed)
        for pick in _explained(found, level[j], j, candidates)
        if used.isdisjoint({pick.name, (pick.name, pick.j)})
    ]
    # Probability of any significant group if the base model is right.
    significant = [pick for pick in tried if pick.p_value * len(tried) < 0.01 and pick.size >= LEAST_RESIDUAL_SHARE]
    return max(significant, key=lambda pick: pick.explained, default=None)


def _explained(found: BaseFit, level: float, j: int, listed: list[tuple[str, Array]]) -> list[Pick]:
    residual = found.residual[:, j]
    scaled = [(name, group / np.sqrt((group**2).mean(axis=0) + TINY)) for name, group in listed]
    together = np.concatenate([group for _, group in scaled], axis=1)
    rows = found.counted[:, j]
    rest = residual - together @ lstsq(together[rows], residual[rows], cond=DEPENDENT_SHARE)[0]
    whitener = whitening_filter(np.where(rows, rest, 0.0))
    base = found.columns[:, j]
    base = base[:, np.any(base != 0, axis=0)]

    def white(values: Array) -> Array:
        return np.asarray(lfilter(whitener, [1.0], values, axis=0)[rows])

    # What the joint's own base model absorbs is no evidence for a group.
    own = _span(white(base / np.sqrt((base**2).mean(axis=0))))

    def left(values: Array) -> Array:
        return np.asarray(white(values) - _projected(own, white(values)))

    target = left(residual)
    whole = float(target @ target)

    slow_own, slow_residual = _span(base[rows]), residual[rows]

    def size(columns: Array) -> float:
        beyond = columns[rows] - _projected(slow_own, columns[rows])
        return float(np.sqrt((_projected(_span(beyond), slow_residual) ** 2).mean()) / level)

    def gain(columns: Array) -> float:
        along = _span(left(columns)).T @ target
        return float(along @ along)

    possible, free = gain(together), len(target) - own.shape[1]
    picks = []
    for name, group in scaled:
        k, explained = group.shape[1], gain(group)
        statistic = explained / k / ((whole - explained) / (free - k))
        picks.append(
            Pick(
                name=name,
                j=j,
                explained=explained / whole,
                of_possible=explained / max(possible, TINY),
                size=size(group),
                p_value=float(f_distribution.sf(statistic, k, free - k)),
            )
        )
    return picks


def _chosen(picks: list[Pick], named: list[dict[str, Array]]) -> Array:
    """Collects the columns (N, n, k) of the groups that entered the model, from the groups of each joint."""
    parts = []
    for pick in picks:
        group = named[pick.j][pick.name]
        columns = np.zeros((len(group), len(named), group.shape[1]))
        columns[:, pick.j] = group
        parts.append(columns)
    return np.concatenate(parts, axis=2)


def _span(columns: Array) -> Array:
    """Computes an orthonormal basis of columns, without directions that are hardly there."""
    basis, triangle, _ = qr(columns, mode="economic", pivoting=True)
    sizes = np.abs(np.diag(triangle))
    return np.asarray(basis[:, sizes > DEPENDENT_SHARE * max(float(sizes.max(initial=0.0)), TINY)])


def _projected(basis: Array, values: Array) -> Array:
    return np.asarray(basis @ (basis.T @ values))


Gears = tuple[float | None, ...]


def gear_ratios(file: Path, joints: int) -> Gears:
    """Reads the gear ratio of each joint; None where the description states none.

    Args:
        file: the robot's YAML file.
        joints: number of joints.
    """
    described = yaml.safe_load(file.read_text(encoding="utf-8"))
    drives = (described.get("dynamics") or {}).get("drives") or {}
    values = (drives.get("gear_ratio") or {}).get("values")
    return tuple(map(float, values)) if values else (None,) * joints


SLOW = (0.02, 0.06)
"""Velocities of exponentials that fade with speed, as fractions of the largest speed."""

HARMONICS = (1.0, 2.0)
"""Periods of a ripple per turn of the motor."""


def groups(motion: Motion, torque: Array, j: int, gear: float | None) -> Iterator[tuple[str, Array]]:
    """Lists groups of columns (N, k) for one joint's residual, each with the name of the effect that it stands for.

    Args:
        motion: the motion.
        torque: the base model's torque (N, n) [N m].
        j: the joint, from 0.
        gear: gear ratio of the joint, or None if unknown.
    """
    t, q, v = motion.t, motion.q[:, j], motion.v[:, j]
    tau, sign = torque[:, j], np.sign(v)
    period = float(np.median(np.diff(motion.t)))
    rate = np.gradient(tau, period)
    top = max(float(np.abs(v).max()), 1e-9)
    size = max(float(np.sqrt((tau**2).mean())), 1e-9)
    yield "stribeck", np.column_stack([np.exp(-np.abs(v) / (share * top)) * sign for share in SLOW])
    yield "asymmetric_friction", np.column_stack([np.abs(v), v**2])
    yield "load_dependent_friction", np.column_stack([np.abs(tau) * sign, np.abs(tau) * v])
    yield "position_dependent_friction", np.column_stack([np.sin(q) * sign, np.cos(q) * sign])
    yield "friction_change", np.column_stack([t * sign, t * v])
    yield "spring", np.column_stack([q, q**2, q**3, np.sin(2 * q), np.cos(2 * q)])
    yield "torque_scale", np.column_stack([tau * np.abs(tau), tau**3 / size])
    yield "offset", np.column_stack([t, t**2])
    yield "delay", rate[:, None]
    yield "elasticity", np.gradient(rate, period)[:, None]
    if gear is not None:
        angles = [k * gear * q for k in HARMONICS]
        yield "torque_ripple", np.column_stack([f(angle) for angle in angles for f in (np.sin, np.cos)])
    near = [k for k in (j - 1, j + 1) if 0 <= k < motion.q.shape[1]]
    coupled = [(motion.q[:, k], np.sign(motion.v[:, k]), motion.v[:, k], motion.a[:, k]) for k in near]
    yield "coupling", np.column_stack([column for columns in coupled for column in columns])


def autocorrelation(x: Array, lags: int) -> Array:
    """Estimates the autocorrelation at the lags 0 to ``lags``, which is 1 at lag 0."""
    centred = x - x.mean()
    size = 1 << (2 * len(x) - 1).bit_length()
    spectrum = np.fft.rfft(centred, size)
    found = np.fft.irfft(spectrum * spectrum.conj(), size)[: lags + 1]
    return np.asarray(found / found[0])


def whitening_filter(x: Array) -> Array:
    """Fits an autoregressive model by the Yule-Walker equations; returns the filter's coefficients (13,)."""
    rho = autocorrelation(x, 12)
    return np.concatenate([[1.0], -solve_toeplitz(rho[:-1], rho[1:])])
