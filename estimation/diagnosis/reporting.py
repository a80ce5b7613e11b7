"""From numbers to a diagnosis: the extended model, its gain on unseen data, findings in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.borne_out import bear_out
from estimation.diagnosis.carried import situation_on, unloaded
from estimation.diagnosis.diagnosis import Diagnosis, Trace
from estimation.diagnosis.extending import fit_extended
from estimation.diagnosis.findings import Finding
from estimation.diagnosis.forms import alike_forms
from estimation.diagnosis.free_functions import strongest_pattern
from estimation.diagnosis.gain import Unseen
from estimation.diagnosis.hidden_springs import hidden_springs
from estimation.diagnosis.hypotheses import all_hypotheses
from estimation.diagnosis.limits import STILL, Limit
from estimation.diagnosis.next_experiment import NextExperiment, plan_next
from estimation.diagnosis.patterns import all_patterns
from estimation.diagnosis.problem import Problem
from estimation.diagnosis.recording import cut
from estimation.diagnosis.refinement import Member
from estimation.diagnosis.scan import measure
from estimation.diagnosis.selection import LEAST, Found, Selection
from estimation.diagnosis.unseen import Measured, measure_unseen, simulate_unseen
from estimation.diagnosis.verdict import CLOSE, Judgement, is_open
from estimation.diagnosis.windup import EFFECT as ELASTICITY
from estimation.diagnosis.windup import Windup, measure_windups
from estimation.diagnosis.wording import no_part, word_finding
from estimation.provenance import describe_logs
from robots.robot import Robot
from robots.signals import Log
from robots.terms.effects import EFFECTS, Effect
from robots.terms.effects.current_clipping import CERTAIN, CurrentClipping
from robots.version import VERSION

Array = NDArray[np.float64]

# Error on unseen data that is worth a word: so many times that of the fit and more than this share of the torque, or
# more than the second share, whatever the fit's.
STRANGE, FAR, ODD = 3.0, 0.05, 0.2
# Unseen speeds beyond the fitted ones by this factor are worth one, too.
FASTER = 1.3
SHOWN = 4000  # rows of the curves kept for pictures
CLIPPING = CurrentClipping()


@dataclass(frozen=True, eq=False)
class Told:
    """All that a diagnosis is made of."""

    problem: Problem
    selection: Selection
    judgement: Judgement
    limits: tuple[Limit, ...]
    excess: Array
    logs: tuple[Log, ...]
    held_out: tuple[Log, ...]
    false_alarm: float
    seed: int
    dated: bool = True
    notes: tuple[str, ...] = ()


def assemble(robot: Robot, told: Told) -> Diagnosis:
    """Fits the extended model, measures it on unseen data, and puts the findings into words."""
    problem, judgement = told.problem, told.judgement
    held = bear_out(
        judgement,
        lambda members: measure_unseen(robot, problem, members, told.held_out, told.seed + 3),
        partial(_is_beyond, told),
        partial(alike_forms, problem),
        lambda member: member.worth(problem.rows) <= LEAST,
        partial(_unnamed, robot, told),
    )
    members, founds, seen = held.members, held.founds, held.seen
    twisted = _windups(told, seen)
    # Where nothing else is left, a name that unseen data refuted shows at least where something is unexplained.
    spoiling = held.spoiling or (() if members or twisted else held.refuted)
    verdict = judgement.verdict
    if len(members) > len(founds) or spoiling:
        verdict = "unexplained"
    elif held.notes:
        # Something did stand out of the noise clearly, if a name that did does not hold.
        verdict = "ambiguous" if any(map(is_open, founds)) else "named"
        verdict = verdict if members else "unexplained" if held.refuted else "none"
    fitted = fit_extended(problem, members, _provenance(told))
    findings = tuple(
        word_finding(
            robot,
            problem,
            member,
            fitted,
            i,
            held.p_values[i],
            founds[i] if i < len(founds) else None,
            seen.gains[i],
        )
        for i, member in enumerate(members)
    )
    if spoiling:
        fit = fit_extended(problem, [*members, *(member for member, _, _ in spoiling)], {})
        findings += tuple(
            no_part(word_finding(robot, problem, member, fit, i, p_value, None, gain))
            for i, (member, p_value, gain) in enumerate(spoiling, start=len(members))
        )
    unseen, apart = seen.unseen, findings[len(members) :]
    if twisted and not members and not spoiling:
        verdict = "named"
    findings += tuple(windup.finding for windup in twisted)
    known = {extension.joint for extension in fitted.model.extensions if extension.effect == ELASTICITY}
    added = [windup.extension for windup in twisted if windup.extension.joint not in known]
    simulation = simulate_unseen(problem, members, seen, bool(told.held_out)) if members else None
    lost = (_LOST,) if members and simulation is None else ()
    # Of a joint that rests in all of them unseen data say nothing: that is no error of zero.
    shown = unseen.counts.any(axis=0)
    before, after = (np.where(shown, unseen.nrmse(model), np.nan) for model in (0, len(unseen.errors) - 1))
    return Diagnosis(
        verdict=verdict,
        findings=findings,
        baseline=before,
        extended=after,
        explained=judgement.explained,
        excess=told.excess,
        limits=told.limits,
        next_experiment=_next(problem, founds) if verdict == "ambiguous" else None,
        model=replace(fitted.model, extensions=(*fitted.model.extensions, *added)),
        how_unseen=unseen.how,
        notes=(*told.notes, *_notes(told, findings, apart, after), *_faster(problem, seen), *held.notes, *lost),
        trace=_trace(unseen, seen.coordinates, twisted),
        simulation=simulation,
    )


def _is_beyond(told: Told, effect: Effect) -> bool:
    """Whether unseen logs say nothing of an effect that belongs to the logs of the fit: a contact, a drift.

    Where it is not known when they were recorded, they say nothing of what comes with time.
    """
    if not told.held_out:
        return False
    return effect.passing or (not told.dated and effect.depends_on == "time")


def _unnamed(robot: Robot, told: Told, member: Member, beside: Sequence[Member]) -> tuple[Member, float] | None:
    """Finds a free function on the joint of a name that unseen data refuted, or on all where it was the robot's."""
    own = member.hypothesis.joint
    wanted = [h for h in all_hypotheses(robot, list(all_patterns(robot))) if own is None or h.joint == own]
    entries = measure(told.problem, wanted)
    rng = np.random.default_rng(told.seed + 4)
    return strongest_pattern(told.problem, entries, beside, told.false_alarm, rng)


_LOST = "Simulated forward, the fitted robot ran away from the position loop: its fit suits no simulation."


def _windups(told: Told, seen: Measured) -> tuple[Windup, ...]:
    """Gears whose wind-up was logged; on held-out logs their gain is measured where those have it too."""
    if all(log.qlink is None for log in told.logs):
        return ()
    now, unseen = told.problem.situation, None
    if any(log.qlink is not None for log in told.held_out):
        other = cut(seen.whole, slice(seen.first, len(seen.whole)))
        there = situation_on(other, now.model, unloaded(told.problem))
        unseen = (there, other, told.held_out)
    return measure_windups(now, told.problem.recording, told.logs, false_alarm=told.false_alarm, unseen=unseen)


def _next(problem: Problem, founds: Sequence[Found]) -> NextExperiment | None:
    """Plans the experiment that tells the causes that are left apart."""
    for found in founds:
        close = [rival for rival, worse in found.rivals if worse < CLOSE]
        if close:
            return plan_next(problem, [found.member, *close])
    return None


_AT_LIMIT = (
    "The torque of joint {} is at its largest, {:.4g}, in samples in a row, several times: its drive is at its limit "
    "there. What that cuts off is too little to show."
)


def _notes(told: Told, findings: Sequence[Finding], apart: Sequence[Finding], after: Array) -> tuple[str, ...]:
    recording = told.problem.recording
    notes = []
    still = [j + 1 for j in range(recording.n) if np.ptp(recording.q[:, j]) < STILL]
    if still:
        names = ", ".join(map(str, still))
        whose = f"Joints {names} hardly moved: their" if len(still) > 1 else f"Joint {names} hardly moved: its"
        notes.append(
            f"{whose} friction, gears and rotors cannot be judged; what gravity and the other joints ask of them can."
        )
    told_of = {finding.joint for finding in findings if finding.effect == CLIPPING.name}
    for j in sorted({*range(1, recording.n + 1)} - told_of):
        if CLIPPING.chance(told.problem.sees(CLIPPING), j, recording.tau) < CERTAIN:
            notes.append(_AT_LIMIT.format(j, float(np.abs(recording.tau[:, j - 1]).max())))
    strange = _strange(told.problem, after)
    notes += strange.values()
    notes += [
        f"Joint {j + 1}: {100 * after[j]:.0f} % of the torque that no fit has seen is left. What cannot be told from "
        "noise counts as noise, and an effect has to stand out of it: look at the logs one by one."
        for j in np.flatnonzero(after > ODD)
        if j not in strange
    ]
    for finding in findings:
        shapes = EFFECTS[finding.effect].shapes if finding.effect in EFFECTS else ()
        assumed = {(shape.name, shape.default) for shape in shapes}
        lost = [p for p in finding.parameters if not p.determined and p.unit == "s" and np.isnan(p.standard_error)]
        for parameter in (p for p in lost if (p.name, p.value) not in assumed):
            notes.append(
                f"{parameter.name} of {finding.effect} is not determined by {recording.duration:.0f} s of logs: the "
                f"value {parameter.value:.3g} s is one of many that fit."
            )
        # What is no part of the model says so itself.
        if finding.gain.ci95[0] <= 0 and finding not in apart:
            where = f"{finding.effect} of joint {finding.joint}" if finding.joint else finding.effect
            notes.append(f"The gain of {where} on unseen data is not sure: its interval begins below zero.")
    part = [finding for finding in findings if finding not in apart]
    open_ = sorted({finding.joint for finding in part if finding.effect == "unexplained" and finding.joint})
    if open_:
        names = ", ".join(map(str, open_))
        notes.append(
            f"No effect of the catalogue explains what stands out of the noise on joint{'s' if len(open_) > 1 else ''} "
            f"{names}: a free function of the inputs named above was fitted there instead. It predicts where the robot "
            "has been, and says nothing elsewhere."
        )
    sprung = {finding.joint for finding in findings if finding.effect == "spring"}
    notes += [text for joint, text in hidden_springs(told.problem, told.false_alarm) if joint not in sprung]
    return tuple(notes)


def _strange(problem: Problem, after: Array) -> dict[int, str]:
    """Says where the model predicts logs far worse than it fits them: there is more in them than was found."""
    counts = ~problem.recording.unsure
    number = np.maximum(counts.sum(axis=0), 1)
    torque = np.sqrt((problem.recording.tau**2 * counts).sum(axis=0) / number)
    fitted = np.sqrt((problem.remainder**2 * counts).sum(axis=0) / number) / np.maximum(torque, 1e-12)
    far = np.flatnonzero(after > np.maximum(STRANGE * fitted, FAR))
    return {int(j): _STRANGE.format(j + 1, 100 * after[j], 100 * fitted[j]) for j in far}


_STRANGE = (
    "Joint {}: {:.3g} % of the torque that no fit has seen is left, where the base model leaves {:.2g} % of what it "
    "was fitted to. The logs differ in something that was not found, or some of them do not tell its parameters."
)


def _faster(problem: Problem, seen: Measured) -> list[str]:
    """Says which joints are faster on unseen data than their friction's polynomial was fitted for."""
    if seen.whole is problem.recording or not any(column.symbol == "f4" for column in problem.baseline.base.columns):
        return []
    known, there = (np.abs(r.dq).max(axis=0) for r in (problem.recording, cut(seen.whole, slice(seen.first, None))))
    ratio = there / np.maximum(known, 1e-9)
    fast = np.flatnonzero(ratio > FASTER)
    names = ", ".join(str(j + 1) for j in fast)
    return [_FASTER.format("s" if len(fast) > 1 else "", names, ratio[fast].max())] if len(fast) else []


_FASTER = (
    "Joint{} {}: up to {:.1f} times as fast on the unseen data as in the logs of the fit. What a polynomial fitted to "
    "slower motion says of friction there may be far off, and with it error and gain; coulomb-viscous errs less."
)


def _trace(unseen: Unseen, seen_as: Sequence[Array], windups: Sequence[Windup]) -> Trace:
    rows = slice(None, None, max(1, len(unseen.t) // SHOWN))
    hidden = ~unseen.counts
    before, after = (np.where(hidden, np.nan, unseen.errors[k]) for k in (0, -1))
    coordinates = tuple(values[rows] for values in seen_as)
    curves = tuple(
        tuple(values[:: max(1, len(values) // SHOWN)] for values in (w.coordinate, w.before, w.after)) for w in windups
    )
    return Trace(unseen.t[rows], unseen.measured[rows], before[rows], after[rows], coordinates, curves)


def _provenance(told: Told) -> dict[str, object]:
    problem = told.problem
    torque = np.sqrt(np.mean(problem.recording.tau**2, axis=0))
    return {
        "logs": describe_logs(told.logs),
        "method": "diagnosis",
        "tool_version": VERSION,
        "cutoff_hz": float(max(problem.recording.cutoff, *(band.cutoff for band in problem.whitening.bands))),
        "velocity_scales": [float(v) for v in problem.situation.velocity_scale],
        "seed": told.seed,
        "false_alarm": told.false_alarm,
        "residual_rms": np.sqrt(np.mean(problem.remainder**2, axis=0)).tolist(),
        "torque_rms": torque.tolist(),
        "gravities": [list(gravity) for gravity in problem.baseline.base.gravities],
    }
