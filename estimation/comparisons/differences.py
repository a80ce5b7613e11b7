"""Differences between runs: of the whole model, of each joint's parts, and of each parameter."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from estimation.comparisons.common_parameters import CommonParameters
from estimation.comparisons.friction_curves import FrictionCurves
from estimation.comparisons.hypothesis_tests import adjust_holm, agreement_test
from robots.common.arrays import Array
from robots.common.records import Record
from robots.terms import Column

Level = Literal["whole", "part", "parameter"]

PARTS = {"rigid_body": "rigid body", "rotor_inertia": "rotor inertia", "torque_offset": "torque offset"}
FRICTION = "friction"


@dataclass(frozen=True, kw_only=True)
class Difference(Record):
    """One test of agreement.

    Attributes:
        level: whole model, one part of a joint, or one parameter.
        name: what is compared.
        joint: counted from 1; None for the whole model.
        run: index of the run that is compared with the first; None for all runs together.
        statistic: chi-square.
        dof: its degrees of freedom.
        p_value: of this test alone.
        adjusted: p-value that allows for all tests of the comparison.
        change: difference of a parameter from the first run; NaN otherwise.
        error: its standard error.
        percent: change in per cent of the first run's value.
        unit: of the change.
        friction: whether it is of a friction curve or one of its coefficients.
    """

    ENTRIES = (
        "level",
        "name",
        "joint",
        "run=labels[run]",
        "reference",
        "chi_square=statistic",
        "dof",
        "p_value",
        "adjusted_p_value=adjusted",
        "significant",
        "change",
        "standard_error=error",
        "percent",
        "unit=unit?",
    )

    level: Level
    name: str
    joint: int | None
    run: int | None
    statistic: float
    dof: int
    p_value: float
    adjusted: float = 1.0
    change: float = np.nan
    error: float = np.nan
    percent: float = np.nan
    unit: str = ""
    friction: bool = False

    def reference(self, labels: Sequence[str]) -> str | None:
        """Label of the first run; None where all runs are compared with each other."""
        return None if self.run is None else labels[0]

    def significant(self, alpha: float) -> bool:
        """Whether the difference is real at a chance alpha of any false alarm."""
        return self.adjusted < alpha


def part_of(column: Column) -> str:
    """Names the part of a joint that a parameter belongs to."""
    return FRICTION if column.friction else PARTS.get(column.term, column.term.replace("_", " "))


def parts_of(common: CommonParameters) -> dict[tuple[str, int], list[int]]:
    """Groups the parameters by part and joint.

    Of a friction curve all coefficients count: together they are determined where one alone is not. Of other parts
    those that all runs determine.
    """
    groups: dict[tuple[str, int], list[int]] = {}
    for i, column in enumerate(common.columns):
        groups.setdefault((part_of(column), column.joint), []).append(i)
    found = {}
    for (part, joint), members in groups.items():
        known = [i for i in members if common.determined[i]]
        if known:
            found[part, joint] = members if part == FRICTION else known
    return dict(sorted(found.items(), key=lambda item: (item[0][1], item[0][0])))


def find_differences(common: CommonParameters, curves: Sequence[FrictionCurves] = ()) -> tuple[Difference, ...]:
    """Tests each run against the first, and more than two runs together.

    Of a joint whose friction has another width of the sign in some run, only the mean of the curve is tested.

    Each of the three levels is a family with a third of the family-wise rate (Bonferroni); within a family Holm's
    method adjusts. The chance of any false alarm is thus at most the rate that adjusted p-values are compared with.

    The covariances hold the scatter of the prior. Runs share the prior, whose pull is alike in all of them: their
    estimates then differ by less than the covariances say. Tests become conservative by this, never too eager.

    Args:
        common: parameters in one basis.
        curves: friction of the joints, for the means.
    """
    means = {curve.joint: curve.mean_row for curve in curves if curve.joint in common.unlike}
    families: list[list[Difference]] = [list(_tests(common, means, level)) for level in ("whole", "part", "parameter")]
    found: list[Difference] = []
    for family in families:
        # Each of the three families of tests has a third of the family-wise rate.
        adjusted = np.minimum(3 * adjust_holm([item.p_value for item in family]), 1.0)
        found += [replace(item, adjusted=float(p)) for item, p in zip(family, adjusted, strict=True)]
    return tuple(found)


def _tests(common: CommonParameters, means: Mapping[int, Array], level: Level) -> Iterator[Difference]:
    unit, count = np.eye(len(common.columns)), len(common.values)
    # What is compared, as rows (r, b) by which the parameters are multiplied.
    parts = {
        (part, joint): means[joint][None] if part == FRICTION and joint in means else unit[members]
        for (part, joint), members in parts_of(common).items()
    }
    runs: list[int | None] = [*range(1, count), *([None] if count > 2 else [])]
    items: list[tuple[str, int | None, Array]]
    if level == "whole":
        items = [("whole model", None, np.concatenate(list(parts.values())))] if parts else []
    elif level == "part":
        items = [(f"{part} of joint {joint}", joint, rows) for (part, joint), rows in parts.items()]
    else:
        items = [
            (c.name, c.joint, unit[[i]])
            for i, c in enumerate(common.columns)
            if common.determined[i] and not (c.friction and c.joint in means)
        ]
    for name, joint, rows in items:
        for run in runs:
            chosen = [0, run] if run is not None else list(range(count))
            test = agreement_test(common.values[chosen] @ rows.T, rows @ common.covariances[chosen] @ rows.T)
            single: dict[str, Any] = {}
            if level == "parameter" and run is not None:
                i = int(np.argmax(rows[0]))
                change = float(common.values[run, i] - common.values[0, i])
                base = abs(float(common.values[0, i]))
                variance = common.covariances[run, i, i] + common.covariances[0, i, i]
                single = {
                    "change": change,
                    "error": float(np.sqrt(variance)),
                    "percent": 100 * change / base if base else np.nan,
                    "unit": common.columns[i].unit,
                }
            yield Difference(
                level=level,
                name=name,
                joint=joint,
                run=run,
                statistic=test.statistic,
                dof=test.dof,
                p_value=test.p_value,
                friction=joint is not None and all(common.columns[i].friction for i in np.flatnonzero(rows[0])),
                **single,
            )
