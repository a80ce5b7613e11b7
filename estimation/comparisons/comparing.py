"""The verb: compares identified models."""

from __future__ import annotations

from collections.abc import Sequence

from estimation.comparisons.common_parameters import (
    OTHER_MOTION,
    CommonParameters,
    common_parameters,
    require_comparable,
)
from estimation.comparisons.differences import find_differences
from estimation.comparisons.drift import find_drifts
from estimation.comparisons.friction_changes import friction_changes
from estimation.comparisons.friction_curves import common_speeds, friction_curves
from estimation.comparisons.merging import merge
from estimation.comparisons.result import ModelComparison
from estimation.comparisons.runs import Run, in_time_order, relabelled, run_of
from estimation.models.model import Model
from robots.common.errors import InputError

# Chance of any false alarm among all tests of a comparison.
FALSE_ALARMS = 0.01
# A converted friction curve that misses by more than this share is said.
MISFIT = 0.01


def compare(models: Sequence[Model | Run], *, alpha: float = FALSE_ALARMS) -> ModelComparison:
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
    require_comparable(given)
    runs, hours, order = in_time_order(relabelled(given))
    speeds = common_speeds(runs)
    common = common_parameters(runs, speeds)
    curves = friction_curves(runs, common, speeds)
    merged = merge(runs, common)
    return ModelComparison(
        runs=tuple(runs),
        order=order,
        hours=hours,
        alpha=alpha,
        common=common,
        differences=find_differences(common),
        curves=curves,
        friction=friction_changes(common, curves, alpha),
        drifts=find_drifts(common, curves, hours, alpha),
        merged=merged,
        warnings=(*_warnings(runs, common), *merged.notes),
    )


def _warnings(runs: Sequence[Run], common: CommonParameters) -> list[str]:
    found, misfit = [], common.misfit
    if not common.same_motion:
        found.append(
            f"The runs recorded different motions, which model errors bias differently. All standard errors are "
            f"multiplied by {OTHER_MOTION:g}. Record the same motion in every run to find smaller differences."
        )
    if misfit > MISFIT:
        found.append(
            f"The friction curves have different shapes; converted to that of {runs[0].label} they miss by up to "
            f"{100 * misfit:.2g} % of the friction. Compare the logs (oed compare --robot) for one common shape."
        )
    extended = [run.label for run in runs if run.model.extensions]
    if extended:
        found.append(
            f"Effects beside the base model are not compared, and not in the merged model: {', '.join(extended)}."
        )
    if len({run.model.provenance.get("method") for run in runs}) > 1:
        found.append("The models come from different estimators, whose biases may differ.")
    return found
