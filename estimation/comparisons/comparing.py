"""The verb: compares identified models."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from estimation.comparisons.common_parameters import (
    OTHER_MOTION_FACTOR,
    CommonParameters,
    common_parameters,
    require_comparable,
)
from estimation.comparisons.differences import Difference, find_differences
from estimation.comparisons.drift import find_drifts
from estimation.comparisons.friction_changes import FrictionChange, curve_difference, friction_changes
from estimation.comparisons.friction_curves import FrictionCurves, common_speeds, friction_curves
from estimation.comparisons.merging import merge
from estimation.comparisons.payload_differences import PayloadDifference, find_payloads, without_payloads
from estimation.comparisons.result import ModelComparison
from estimation.comparisons.runs import Run, in_time_order, relabelled, run_of, with_position_torques
from estimation.models.model import Model
from robots.common.errors import InputError
from robots.common.plain import percent


def compare(models: Sequence[Model | Run], *, alpha: float = 0.01) -> ModelComparison:
    """Compares identified models: which differences are real, drift over the runs, and a merged estimate.

    Runs are put in order of time where their logs or names state dates; the first is the baseline. Differences are
    tested by chi-square with the full covariances: the whole model, each part of each joint, each parameter. The prior
    that the runs share makes these tests conservative. The rate of false alarms is kept by Holm (1979).

    Args:
        models: two or more; a `Run` states label and date as well.
        alpha: chance of any false alarm among all tests (Holm).

    Returns:
        The comparison.

    Raises:
        InputError: one model alone, models of different robots or columns, a model twice, or one without covariance;
            a rate outside 0 to 0.5.
    """
    if not 0 < alpha < 0.5:
        raise InputError(f"false-alarm rate {alpha}", allowed="between 0 and 0.5")
    given = [
        item if isinstance(item, Run) else run_of(item, f"run {number}") for number, item in enumerate(models, start=1)
    ]
    given = with_position_torques(given)
    require_comparable(given)
    runs, hours, order = in_time_order(relabelled(given))
    speeds = common_speeds(runs)
    common = common_parameters(runs, speeds)
    curves = friction_curves(runs, common, speeds)
    merged = merge(runs, common)
    payloads = find_payloads(common, runs[0].model, alpha)
    tested = without_payloads(common, payloads)
    differences = find_differences(tested, curves)
    friction = _with_curves(friction_changes(common, curves, alpha), curves, differences, runs[0].model, alpha)
    return ModelComparison(
        runs=tuple(runs),
        order=order,
        hours=hours,
        alpha=alpha,
        common=common,
        payloads=payloads,
        tested=tested,
        differences=differences,
        curves=curves,
        friction=friction,
        drifts=find_drifts(common, curves, hours, alpha),
        merged=merged,
        warnings=(*_warnings(runs, common), *_payload_warnings(payloads), *merged.notes),
    )


def _with_curves(
    changes: Sequence[FrictionChange],
    curves: Sequence[FrictionCurves],
    differences: Sequence[Difference],
    model: Model,
    alpha: float,
) -> tuple[FrictionChange, ...]:
    """Adds where the curve differs to the changes of joints whose friction differs significantly."""
    significant = {(d.run, d.joint) for d in differences if d.friction and d.level == "part" and d.adjusted < alpha}
    of_joint = {curve.joint: curve for curve in curves}
    limits = model.robot.limits
    return tuple(
        replace(item, curve=curve_difference(of_joint[item.joint], item.run, limits.unit(item.joint - 1, "velocity")))
        if (item.run, item.joint) in significant
        else item
        for item in changes
    )


def _payload_warnings(payloads: Sequence[PayloadDifference]) -> list[str]:
    return (
        ["Runs with and without a payload are merged: the merged model is of neither. Merge runs of one payload."]
        if payloads
        else []
    )


def _warnings(runs: Sequence[Run], common: CommonParameters) -> list[str]:
    found, misfit = [], common.misfit
    if not common.same_motion:
        found.append(
            f"The runs recorded different motions, which model errors bias differently. All standard errors are "
            f"multiplied by {OTHER_MOTION_FACTOR:g}. Record the same motion in every run to find smaller differences."
        )
    # A converted friction curve that misses by more than 1 % is reported.
    if misfit > 0.01:
        found.append(
            f"The friction curves have different shapes; converted to that of {runs[0].label} they miss by up to "
            f"{percent(misfit)} of the friction. Compare the logs (oed compare --robot) for one common shape."
        )
    if common.unlike:
        joints = ", ".join(map(str, sorted(common.unlike)))
        found.append(
            f"The sign of the friction has different widths in the models (joint {joints}): of these curves only the "
            "mean is tested. Compare the logs (oed compare --robot) for one common shape."
        )
    extended = [run.label for run in runs if run.model.extensions]
    if extended:
        found.append(
            f"Effects beside the base model are not compared, and not in the merged model: {', '.join(extended)}."
        )
    if len({run.model.provenance.get("method") for run in runs}) > 1:
        found.append("The models come from different estimators, whose biases may differ.")
    return found
