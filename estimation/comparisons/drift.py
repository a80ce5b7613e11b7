"""Drift over ordered runs: trend of each quantity, and the run from which it is settled."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import t

from estimation.comparisons.common_parameters import CommonParameters
from estimation.comparisons.friction_curves import LEVEL_SPEED_SHARE, FrictionCurves
from estimation.comparisons.hypothesis_tests import adjust_holm
from estimation.uncertainty.quantiles import normal_limit
from robots.common.arrays import Array
from robots.common.records import Record


@dataclass(frozen=True, kw_only=True)
class Drift(Record):
    """Course of one quantity over the runs.

    Attributes:
        name: parameter, or friction of a joint.
        joint: counted from 1.
        unit: of the values.
        values: (k,).
        errors: standard errors (k,).
        slope: weighted least squares, per hour where the runs have a common clock, else per run.
        slope_error: its standard error, larger where the runs scatter about the line by more than their errors.
        adjusted: p-value of the slope that allows for all quantities (Holm).
        settled: index of the first run from which all stay within the noise of the last third; None where only the
            last third itself does.
        final: weighted mean of the last third.
        percent: first value minus the final one, in per cent of the final one.
    """

    ENTRIES = (
        "name",
        "joint",
        "unit",
        "values",
        "standard_errors=errors",
        "slope",
        "slope_standard_error=slope_error",
        "slope_adjusted_p_value=adjusted",
        "slope_significant=significant",
        "settled_from=labels[settled]",
        "final",
        "first_minus_final_percent=percent",
    )

    name: str
    joint: int
    unit: str
    values: Array
    errors: Array
    slope: float
    slope_error: float
    adjusted: float
    settled: int | None
    final: float
    percent: float

    def significant(self, alpha: float) -> bool:
        """Whether there is a trend at a chance alpha of any false alarm."""
        return self.adjusted < alpha


def find_drifts(
    common: CommonParameters, curves: Sequence[FrictionCurves], hours: Array | None, alpha: float
) -> tuple[Drift, ...]:
    """Follows each determined parameter, and each joint's friction at 0.6 of its largest speed.

    Args:
        common: parameters in one basis.
        curves: friction of the joints.
        hours: of each run since the first (k,); None counts the runs.
        alpha: false-alarm rate of what counts as within the noise, over all runs of a quantity.

    Returns:
        One a quantity; nothing for fewer than four runs.
    """
    count = len(common.values)
    # Fewer runs show no course.
    if count < 4:
        return ()
    x = np.arange(count, dtype=float) if hours is None else hours
    errors = np.sqrt(np.maximum(np.einsum("kii->ki", common.covariances), 0.0))
    series = [
        (f"friction of joint {c.joint} at {100 * LEVEL_SPEED_SHARE:.0f} % speed", c.joint, "", c.level, c.level_error)
        for c in curves
        if (c.level_error > 0).all()
    ]
    units = {column.joint: column.unit for column in common.columns if column.is_coulomb}
    series = [(name, joint, units.get(joint, ""), *rest) for name, joint, _, *rest in series]  # type: ignore[misc]
    series += [
        (c.name, c.joint, c.unit, common.values[:, i], errors[:, i])
        for i, c in enumerate(common.columns)
        if common.determined[i]
    ]
    found, p_values = [], []
    for name, joint, unit, values, error in series:
        slope, slope_error = weighted_slope(x, values, error)
        p_values.append(float(2 * t.sf(abs(slope) / slope_error, count - 2)))
        settled, final = settled_from(values, error, alpha)
        found.append(
            Drift(
                name=name,
                joint=joint,
                unit=unit,
                values=values,
                errors=error,
                slope=slope,
                slope_error=slope_error,
                adjusted=1.0,
                settled=settled,
                final=final,
                percent=100 * (values[0] - final) / abs(final) if final else np.nan,
            )
        )
    adjusted = adjust_holm(p_values)
    return tuple(replace(item, adjusted=float(p)) for item, p in zip(found, adjusted, strict=True))


def weighted_slope(x: Array, values: Array, errors: Array) -> tuple[float, float]:
    """Slope of a line through values with known errors, and its standard error.

    The error is multiplied by the scatter about the line over the stated errors, where that exceeds one (Birge ratio).
    """
    w = errors**-2.0
    centre = float(w @ x / w.sum())
    spread = float(w @ (x - centre) ** 2)
    slope = float(w @ ((x - centre) * values) / spread)
    mean = float(w @ values / w.sum())
    chi_square = float(w @ (values - mean - slope * (x - centre)) ** 2)
    return slope, float(np.sqrt(max(1.0, chi_square / max(len(x) - 2, 1)) / spread))


def settled_from(values: Array, errors: Array, alpha: float) -> tuple[int | None, float]:
    """First run from which all values agree with the mean of the last third; and that mean.

    A run agrees if its distance from the mean is within the (Bonferroni-corrected) quantile of its standard error.

    Args:
        values: (k,).
        errors: standard errors (k,).
        alpha: false-alarm rate over the k runs.

    Returns:
        The index of the run, None where the last third does not agree with itself, or nothing before it does.
    """
    count = len(values)
    # A quantity settles at its mean over the last third of the runs.
    last = np.arange(count) >= count - max(2, round(count / 3))
    w = np.where(last, errors**-2.0, 0.0)
    w /= w.sum()
    final = float(w @ values)
    # The mean holds the run itself where that is among the last.
    variance = errors**2 * (1 - 2 * w) + float(w**2 @ errors**2)
    limit = normal_limit(alpha, count)
    within = np.abs(values - final) <= limit * np.sqrt(np.maximum(variance, 0.0))
    if not within[last].all():
        return None, final
    outside = np.flatnonzero(~within)
    return (int(outside[-1]) + 1 if len(outside) else 0), final
