"""A difference of inertial parameters that is a body on the flange, and what is left without it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from estimation.comparisons.common_parameters import CommonParameters
from estimation.comparisons.hypothesis_tests import VARIANCE_ROUNDING, agreement_test
from estimation.linear_algebra.scaled import inverse, inverse_root
from estimation.models.model import Model
from estimation.payloads.determination import determined
from estimation.payloads.intervals import Quantity, quantities
from estimation.payloads.physical import physical_body
from estimation.uncertainty.quantiles import normal_limit
from robots.base_parameters import find_base_parameters
from robots.common.arrays import Array
from robots.common.records import Record
from robots.geometry.inertia import BODY_PARAMETERS
from robots.terms.situations.flange_body import FLANGE, link_columns
from robots.terms.situations.sensitivities import moved_body


@dataclass(frozen=True, kw_only=True)
class PayloadDifference(Record):
    """A body that one of two runs carries on the flange and the other does not.

    Attributes:
        run: index of the run that is compared with the first.
        removed: whether the first run carries the body, and this one does not.
        found: mass, centre of mass and inertia in the flange frame, with 95 % intervals.
        determined: which of them the models determine.
        explained: share of the excess chi-square of the inertial parameters that the body explains.
        change: of the parameters by the body (b,).
        covariance: of that change (b, b).
    """

    ENTRIES = (
        "run=labels[run]",
        "reference=labels[0]",
        "carried_by=carrier",
        "quantities=stated_quantities",
        "explained_share=explained",
        "sentence",
    )

    run: int
    removed: bool
    found: tuple[Quantity, ...]
    determined: tuple[bool, ...]
    explained: float
    change: Array
    covariance: Array

    def sentence(self, labels: Sequence[str]) -> str:
        """Says who carries what, and where its centre is.

        Args:
            labels: of the runs.
        """
        who, other = (labels[0], labels[self.run]) if self.removed else (labels[self.run], labels[0])
        mass, *centre = (_interval(item) if known else "not determined" for item, known in self._shown)
        return (
            f"{who} carries a payload of {mass} kg on the flange that {other} does not; centre of mass x {centre[0]}, "
            f"y {centre[1]}, z {centre[2]} m in the flange frame."
        )

    def carrier(self, labels: Sequence[str]) -> str:
        """Label of the run that carries the body."""
        return labels[0] if self.removed else labels[self.run]

    @property
    def stated_quantities(self) -> list[dict[str, Any]]:
        """The quantities, with a value and an interval where the models determine them."""
        return [
            {
                "name": item.name,
                "value": item.value if known else None,
                "ci95": [item.lower, item.upper] if known else None,
                "unit": item.unit,
            }
            for item, known in zip(self.found, self.determined, strict=True)
        ]

    @property
    def _shown(self) -> list[tuple[Quantity, bool]]:
        return list(zip(self.found, self.determined, strict=True))[:4]


def find_payloads(common: CommonParameters, model: Model, alpha: float) -> tuple[PayloadDifference, ...]:
    """Finds the runs whose inertial parameters differ from the first run's by a body on the flange.

    The differences d of the parameters, with their covariance C, are fitted by d = G p: G are the columns of a body in
    the flange frame. A body is named if its mass is significant, if a body can have the parameters, and if it explains
    most of what d has beyond its errors.

    Args:
        common: parameters of all runs.
        model: the first run's.
        alpha: chance of a false alarm over all runs.
    """
    if FLANGE in model.robot.assumed or not link_columns(model.torque_model):
        return ()
    used = [i for i, column in enumerate(common.columns) if common.determined[i] and not column.friction]
    runs = [run for run in range(1, len(common.values)) if _differs(common, run, used, alpha)]
    if not runs:
        return ()
    columns = _flange_columns(common, model)
    found = (_payload(common, run, columns, used, alpha / len(common.values)) for run in runs)
    return tuple(item for item in found if item is not None)


def without_payloads(common: CommonParameters, payloads: Sequence[PayloadDifference]) -> CommonParameters:
    """Takes the payloads off the runs' parameters; the errors of the payloads are added to theirs."""
    values, covariances = common.values.copy(), common.covariances.copy()
    for item in payloads:
        values[item.run] -= item.change
        covariances[item.run] += item.covariance
    return replace(common, values=values, covariances=covariances)


def _differs(common: CommonParameters, run: int, used: Sequence[int], alpha: float) -> bool:
    at = np.ix_([0, run], used)
    covariances = common.covariances[[0, run]][:, used][:, :, used]
    return bool(used) and agreement_test(common.values[at], covariances).p_value < alpha


def _flange_columns(common: CommonParameters, model: Model) -> Array:
    """The change of the parameters (b, 10) by a body on the flange, in its frame."""
    terms = model.torque_model
    base = find_base_parameters(terms, gravities=model.gravities)
    rows = dict(zip((column.name for column in base.columns), base.grouping[:, list(link_columns(terms))], strict=True))
    nothing = np.zeros(BODY_PARAMETERS)
    return np.array([rows.get(column.name, nothing) for column in common.columns]) @ moved_body(terms.robot.chain.tip)


def _payload(
    common: CommonParameters, run: int, columns: Array, used: Sequence[int], alpha: float
) -> PayloadDifference | None:
    d = (common.values[run] - common.values[0])[used]
    whitening = inverse_root((common.covariances[run] + common.covariances[0])[np.ix_(used, used)], VARIANCE_ROUNDING).T
    target, G = whitening @ d, whitening @ columns[used]
    # Spread of a body's parameters before any data [kg, kg m, kg m2]: what the models leave open keeps it.
    precision = G.T @ G + np.eye(BODY_PARAMETERS) / 100.0**2
    covariance = inverse(precision)
    p = covariance @ G.T @ target
    rest, free = float(np.sum((target - G @ p) ** 2)), len(target) - np.linalg.matrix_rank(G)
    excess = float(target @ target) - len(target)
    explained = 1 - max(rest - free, 0.0) / excess if excess > 0 else 0.0
    # What the body leaves unexplained is an error of the models: it widens the intervals.
    covariance = covariance * max(rest / max(free, 1), 1.0)
    significant = abs(p[0]) > normal_limit(alpha) * np.sqrt(covariance[0, 0])
    # Share of the excess chi-square of the inertial parameters that a body on the flange must explain to be named.
    if not significant or explained < 0.9:
        return None
    removed = bool(p[0] < 0)
    own = -p if removed else p
    body = physical_body(own, covariance)
    if body.contradicted:
        return None
    found = quantities(own, covariance, body.parameters)
    return PayloadDifference(
        run=run,
        removed=removed,
        found=found,
        determined=determined(found),
        explained=explained,
        change=columns @ p,
        covariance=columns @ covariance @ columns.T,
    )


def _interval(item: Quantity) -> str:
    return f"{item.value:.3g} ({item.lower:.3g} to {item.upper:.3g})"
