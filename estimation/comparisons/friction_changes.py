"""Changes of friction split into what all joints share, as by heat, and what one joint has alone, as by damage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from estimation.comparisons.common_parameters import CommonParameters
from estimation.comparisons.friction_curves import FrictionCurves
from estimation.uncertainty.quantiles import NORMAL_95, normal_limit
from robots.common.arrays import Array
from robots.common.records import Record

Kind = Literal["unchanged", "common", "own", "unequal", "changed"]


@dataclass(frozen=True, kw_only=True)
class CurveDifference:
    """Where a friction curve differs most from that of the first run, for its errors.

    Attributes:
        speed: [rad/s or m/s].
        unit: of the speed.
        percent: difference of the friction there, in per cent of the first run's.
        low: of its 95 % interval, simultaneous for the whole curve.
        high: of that interval.
    """

    speed: float
    unit: str
    percent: float
    low: float
    high: float

    def text(self) -> str:
        """Says how much the curve differs, and where."""
        return (
            f"the curve differs, most at {self.speed:.2g} {self.unit}: {self.percent:+.1f} % "
            f"({self.low:+.1f} to {self.high:+.1f} %)"
        )


def curve_difference(curve: FrictionCurves, run: int, unit: str) -> CurveDifference:
    """Finds the speed at which the friction of a run differs most from that of the first, for its errors.

    Args:
        curve: friction of a joint.
        run: index of the run.
        unit: of the speed.
    """
    tiny = np.finfo(float).tiny
    place = int(np.argmax(np.abs(curve.difference[run]) / np.maximum(curve.difference_error[run], tiny)))
    base = 100 / max(abs(float(curve.torque[0, place])), tiny)
    middle = float(curve.difference[run, place]) * base
    half = float(curve.simultaneous[run] * curve.difference_error[run, place]) * base
    return CurveDifference(
        speed=float(curve.speed[place]), unit=unit, percent=middle, low=middle - half, high=middle + half
    )


@dataclass(frozen=True, kw_only=True)
class FrictionChange(Record):
    """Change of one joint's friction between two runs, mean over the speeds.

    Attributes:
        joint: counted from 1.
        run: index of the run that is compared with the first.
        total: log of the ratio of mean frictions.
        total_error: its standard error.
        common: log ratio that the other joints share; NaN where they do not show it.
        own: what this joint has beyond it.
        own_error: standard error of `own` by the noise.
        own_scatter: the same with the scatter that unequal heating makes.
        curve: where the curve of friction over speed differs most for its errors, if its difference is significant.
        kind: unchanged; common to all joints; own; unequal: beyond the noise, but not beyond unequal heating; changed:
            too few joints to decide.
    """

    ENTRIES = (
        "joint",
        "run=labels[run]",
        "reference=labels[0]",
        "kind",
        "total=total_percent",
        "common=common_percent",
        "own=own_percent",
        "curve",
        "sentence",
    )

    joint: int
    run: int
    total: float
    total_error: float
    common: float
    own: float
    own_error: float
    own_scatter: float
    kind: Kind
    curve: CurveDifference | None = None

    @property
    def total_percent(self) -> dict[str, Any]:
        """The change with its 95 % interval, in per cent."""
        return _with_interval(self.total, self.total_error)

    @property
    def common_percent(self) -> float:
        """What the other joints share, in per cent."""
        return _percent(self.common)

    @property
    def own_percent(self) -> dict[str, Any]:
        """What this joint has alone, with its 95 % interval, in per cent."""
        return _with_interval(self.own, self.own_scatter)

    @property
    def differs(self) -> bool:
        """Whether the mean or the curve differs significantly."""
        return self.kind != "unchanged" or self.curve is not None

    def sentence(self) -> str:
        """Says how much changed, how much of it all joints share, and how much this joint has alone."""
        head = f"Joint {self.joint}: friction {percent_of(self.total)} ({interval_of(self.total, self.total_error)})"
        if self.kind == "unchanged":
            text = f"{head}, not significant"
            return f"{text}." if self.curve is None else f"{text} in the mean; {self.curve.text()}."
        if self.kind == "changed":
            return f"{head}, significant; too few joints to separate heat from damage."
        others = f"the other joints {percent_of(self.common)}"
        own = f"{percent_of(self.own)} ({interval_of(self.own, self.own_scatter)})"
        if self.kind == "own":
            return f"{head}; {others}; this joint alone {own}, significant: inspect this joint."
        if self.kind == "unequal":
            return f"{head}; {others}. Unequal heating may explain the difference, {own}."
        return f"{head}; {others}: no difference beyond the errors."


def friction_changes(
    common: CommonParameters, curves: Sequence[FrictionCurves], alpha: float
) -> tuple[FrictionChange, ...]:
    """Splits the friction change of each run against the first.

    The relative change of a joint is the log ratio of its mean friction over the common speeds; its covariance follows
    from those of both runs (delta method), with correlations between joints. Joints whose change departs from that of
    the others are set aside one by one; a majority remains and gives the common change.

    Args:
        common: parameters in one basis.
        curves: friction of the joints.
        alpha: family-wise false-alarm rate over all joints and runs.
    """
    rows = np.array([curve.mean_row for curve in curves]).reshape(len(curves), -1)
    found: list[FrictionChange] = []
    tests = max(1, len(curves) * (len(common.values) - 1))
    limit = normal_limit(alpha, tests)
    first, slope = _log_level(rows, common.values[0])
    for run in range(1, len(common.values)):
        last, other = _log_level(rows, common.values[run])
        used = np.flatnonzero(np.isfinite(first + last))
        if not len(used):
            continue
        covariance = slope[used] @ common.covariances[0] @ slope[used].T
        covariance = covariance + other[used] @ common.covariances[run] @ other[used].T
        joints = [curves[i].joint for i in used.tolist()]
        found += _split((last - first)[used], covariance, joints, run, limit)
    return tuple(found)


def _log_level(rows: Array, values: Array) -> tuple[Array, Array]:
    """Logs of mean frictions (j,), NaN where one is not positive, and their gradients (j, b)."""
    level = rows @ values
    good = level > 0
    safe = np.where(good, level, 1.0)
    return np.where(good, np.log(safe), np.nan), rows / safe[:, None]


def _split(change: Array, S: Array, joints: Sequence[int], run: int, limit: float) -> list[FrictionChange]:
    n, aside = len(change), [False] * len(change)
    # A split needs a majority of joints that share a change.
    fewest = 3
    for _ in range((n - 1) // 2 if n >= fewest else 0):
        rest = [j for j in range(n) if not aside[j]]
        z = np.zeros(n)
        for j in rest:
            own, noise, scatter, _ = _against(change, S, j, [i for i in rest if i != j])
            # A joint that departs pulls the common change of the others along: they depart by less than it does.
            z[j] = abs(own) / noise if abs(own) > limit * scatter else 0.0
        worst = int(np.argmax(z))
        if z[worst] == 0:
            break
        aside[worst] = True
    found = []
    for j in range(n):
        error = float(np.sqrt(S[j, j]))
        significant = abs(change[j]) > limit * error
        shared, own, noise, scatter = np.nan, np.nan, np.nan, np.nan
        kind: Kind = "changed" if significant else "unchanged"
        if n >= fewest:
            own, noise, scatter, shared = _against(change, S, j, [i for i in range(n) if i != j and not aside[i]])
            if abs(own) > limit * scatter:
                kind = "own"
            elif significant:
                kind = "unequal" if abs(own) > limit * noise else "common"
        found.append(
            FrictionChange(
                joint=joints[j],
                run=run,
                total=float(change[j]),
                total_error=error,
                common=shared,
                own=own,
                own_error=noise,
                own_scatter=scatter,
                kind=kind,
            )
        )
    return found


def _against(change: Array, S: Array, j: int, rest: Sequence[int]) -> tuple[float, float, float, float]:
    """What a joint has beyond the others: own change, its error by noise, the same with unequal heating, the common."""
    among = list(rest)
    shared = float(np.median(change[among]))
    weights = np.full(len(among), 1 / len(among))
    # Joints warm unequally: their relative changes scatter about the common one by this share of it (one sigma).
    heat_scatter = 0.3
    for _ in range(20):
        V = S[np.ix_(among, among)] + (heat_scatter * shared) ** 2 * np.eye(len(among))
        solved = np.linalg.solve(V, np.ones(len(among)))
        weights, before = solved / solved.sum(), shared
        shared = float(weights @ change[among])
        if abs(shared - before) < 1e-9:
            break
    row = np.zeros(len(change))
    row[j], row[among] = 1.0, -weights
    noise = float(row @ S @ row)
    heat = (heat_scatter * shared) ** 2 * (1 + float(weights @ weights))
    own = float(change[j] - shared)
    return own, float(np.sqrt(max(noise, np.finfo(float).tiny))), float(np.sqrt(max(noise + heat, 1e-300))), shared


def percent_of(log_ratio: float) -> str:
    """Writes a log ratio as a signed percentage, such as ``+12.3 %``."""
    return "unknown" if not np.isfinite(log_ratio) else f"{_percent(log_ratio):+.1f} %"


def interval_of(log_ratio: float, error: float) -> str:
    """Writes the 95 % interval of a log ratio in per cent, such as ``10.2 to 14.4 %``."""
    low, high = (_percent(log_ratio + sign * NORMAL_95 * error) for sign in (-1, 1))
    return f"{low:+.1f} to {high:+.1f} %"


def _percent(log_ratio: float) -> float:
    return float(100 * np.expm1(min(log_ratio, 50.0)))


def _with_interval(value: float, error: float) -> dict[str, Any]:
    return {"percent": _percent(value), "ci95": [_percent(value + sign * NORMAL_95 * error) for sign in (-1, 1)]}
