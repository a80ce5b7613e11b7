"""Search through the catalogue: fit of the base model, noise estimate, selection of effects, repeated if needed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from estimation.diagnosis.base_models.baseline import Baseline, base_model_prior, build_baseline, inertia_matrix
from estimation.diagnosis.calibration import MAX_HIGH_BAND_ERROR
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis, all_hypotheses
from estimation.diagnosis.hypothesis_tests.problem import Problem, build_problem
from estimation.diagnosis.hypothesis_tests.scan import Entry, measure
from estimation.diagnosis.joint_fits.total_torque import with_total_torque
from estimation.diagnosis.noise_models.high_frequency_band import build_high_band
from estimation.diagnosis.noise_models.noise_estimate import estimate_whitening, quiet_joints
from estimation.diagnosis.noise_models.noise_nuisance_basis import build_nuisance_projection, is_short
from estimation.diagnosis.recordings.recording import Recording
from estimation.diagnosis.reversals.reversal_timing import ReversalTiming, measure_reversal_timing
from estimation.diagnosis.searches.refit import RefitResult, base_torque_changed, noise_decreased, refit
from estimation.diagnosis.searches.selection import Selection, select, with_rivals
from estimation.regressions.parameter_priors import inflate_conflicting_prior
from robots.base_parameters import BaseParameters
from robots.common.progress import Progress
from robots.common.workers import give_back
from robots.terms.effect_bases.capabilities import AboveBand, AtReversals
from robots.terms.effects import Effect

SEARCHES = 2  # largest number of searches
# Largest number of fits of the base model alone. The fit is repeated while a joint's residual falls below this share of
# the previous one.
ROUNDS, SETTLED = 4, 0.9
# Least noise in these fits, as a share of the torque's standard deviation.
QUIETEST = 0.05


@dataclass(frozen=True, eq=False)
class Search:
    """One search through the catalogue with one noise model.

    Attributes:
        searched_problem: data of the search.
        problem: the same, with the total torque of base model and selected effects where effects depend on it.
        entries: hypotheses of the catalogue, measured.
        selection: selected effects.
    """

    searched_problem: Problem
    problem: Problem
    entries: list[Entry]
    selection: Selection


def search(
    base: BaseParameters,
    recording: Recording,
    effects: Sequence[Effect],
    false_alarm: float,
    bar: Progress,
) -> Search:
    """Searches the catalogue, and repeats the search if the selected effects changed noise, base model or gear load.

    Args:
        base: base parameters.
        recording: logs of the fit.
        effects: effects of the catalogue.
        false_alarm: threshold of the p-values.
        bar: progress.

    Returns:
        The last search, with the rivals of each selected effect.
    """
    hypotheses = all_hypotheses(base.model.robot, effects)
    recording, baseline, settled, timing = _with_reversal_rows(base, recording)
    last: Search | None = None
    members: list[FittedEffect] = []
    blurred = False
    known: dict[Hypothesis, tuple[float, ...]] = {}
    for attempt in range(SEARCHES):
        share = 0.1 + 0.3 * attempt
        inertia = inertia_matrix(baseline, recording, settled.values)
        fitted = baseline.base.size + settled.degrees
        spared = build_nuisance_projection(recording, baseline, settled.residual)
        whitening = estimate_whitening(recording, settled.residual, fitted, inertia, spared=spared)
        if last is not None:
            anew = settled.gear_load.improves_fit or noise_decreased(last.problem, whitening)
            if not (anew or base_torque_changed(last.problem, settled.values, members)):
                break
            # The columns of the last search take most of the memory, so they are released first.
            last = None
            give_back()
            if blurred:
                baseline = build_baseline(base, recording, known=settled.delayed_motion(recording, members))
        posed = build_problem(
            recording,
            baseline,
            whitening,
            extra=settled.extra,
            followed=settled.delayed,
            bearing=settled.gear_load.extra_load,
        )
        if any(effect.above_band is not AboveBand.NO for effect in effects):
            wide = estimate_whitening(recording, settled.residual, fitted, inertia, MAX_HIGH_BAND_ERROR, spared)
            # A base model fitted beside effects may leave a very different residual than the base model alone.
            upper = build_high_band(recording, baseline, posed.base_residual, settled.residual, whitening.bands, wide)
            posed = replace(posed, high_band=upper)
        if attempt:
            timing = measure_reversal_timing(recording, baseline, settled.values, *settled.without_delay())
        if timing is not None:
            posed = replace(posed, timing=timing.beside(recording))
        give_back()
        entries = measure(posed, hypotheses, lambda done, at=share: bar.update(at + 0.2 * done, "scan"))  # type: ignore[misc]
        give_back()
        advance = partial(bar.update, share + 0.25)
        problem, selection = select(posed, entries, false_alarm=false_alarm, advance=advance, known=known)
        members = [found.effect for found in selection.found]
        last = Search(problem, with_total_torque(problem, members, hypotheses), entries, selection)
        del entries, problem, selection
        if not members or attempt == SEARCHES - 1:
            break
        known = {member.hypothesis: member.shape for member in members}
        settled = refit(last.problem, members)
        # Such an effect, for example a delay, increased the estimated width of the friction sign.
        blurred = any(member.hypothesis.effect.at_reversals is AtReversals.LATE for member in members)
    assert last is not None
    with_alternatives = with_rivals(last.searched_problem, last.entries, last.selection)
    return replace(last, selection=with_alternatives)


def _with_reversal_rows(
    base: BaseParameters, recording: Recording
) -> tuple[Recording, Baseline, RefitResult, ReversalTiming | None]:
    """Includes rows at reversals of joints whose acceleration errors are small, as checked with the base model.

    Returns:
        The recording, the base model and its fit on it, and the timing of the torque at reversals.
    """
    baseline, settled = fit_plain(base, recording)
    timing = measure_reversal_timing(recording, baseline, settled.values, settled.residual)
    if not recording.sign_known_from_velocity.any():
        return recording, baseline, settled, timing
    trusted = quiet_joints(recording, settled.residual, inertia_matrix(baseline, recording, settled.values))
    if timing is not None and recording.reversal_time_error is not None:
        # Impulses in the torque may show a larger velocity error than the positions alone.
        trusted &= timing.kicks <= np.max(recording.reversal_time_error * np.abs(recording.ddq), axis=0)
    more = recording.with_trusted(trusted)
    if not more.counted_rows.any():
        return more, baseline, settled, timing
    return more, *fit_plain(base, more), timing


def fit_plain(base: BaseParameters, recording: Recording) -> tuple[Baseline, RefitResult]:
    """Fits the base model without effects, iteratively reweighted.

    Each joint is weighted by its residual in the previous iteration. Weights from the torque alone would let the prior
    dominate where the description lacks a rotor or a tool. The weights are bounded, because residuals also contain
    model errors, and joints with small residuals must not dominate the fit of the others.

    Args:
        base: base parameters.
        recording: logs of the fit.

    Returns:
        The base model on the recording, and its fit.
    """
    baseline, tau = build_baseline(base, recording), recording.tau
    counts, size = ~recording.sign_unknown, tau.std(axis=0) + 1e-12
    pull, moments = base_model_prior(baseline, recording), baseline.moments(counts.astype(float), tau)
    scale = size
    for _ in range(ROUNDS):
        weighted = moments.joined(scale**-2.0)
        prior = inflate_conflicting_prior(pull, weighted.gram[0], weighted.cross[0])
        values = weighted.pulled(prior).posterior()[: baseline.base.size]
        left = tau - baseline.regressor @ values
        noise = np.sqrt((left**2 * counts).sum(axis=0) / np.maximum(counts.sum(axis=0), 1))
        before, scale = scale, np.clip(noise, QUIETEST * size, scale)
        if (scale > SETTLED * before).all():
            break
    if not is_short(recording):
        # Effects are measured beside a base model without prior, so the noise is, too.
        left = tau - baseline.columns @ weighted.posterior()
    return baseline, RefitResult(left, values)
