"""Notes of a diagnosis: joints at rest, large held-out errors, undetermined values, findings without support."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.calibration import (
    LARGE_HELD_OUT_ERROR,
    MIN_HELD_OUT_ERROR,
    MIN_HELD_OUT_RATIO,
    MIN_RANGE_EXCESS,
    MIN_SPEED_RATIO,
    MIN_WORSE_RATIO,
)
from estimation.diagnosis.experiment_plans.detection_limits import STILL, undetectable_springs
from estimation.diagnosis.findings import Finding
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.recordings.recording import cut_recording
from estimation.diagnosis.validations.held_out_errors import HeldOutResult
from estimation.diagnosis.validations.validated_findings import Change, ChangedFinding
from robots.common.arrays import Array
from robots.terms.base import force_unit
from robots.terms.discrepancies.patterns import PREFIX
from robots.terms.effects import EFFECTS
from robots.terms.effects.current_clipping import FLAT_TOP_CHANCE, CurrentClipping

# Findings for which positions outside the fitted range are reported.
PLACED = ("spring", "unexplained")
# Smallest increase of a joint's held-out NRMSE by the extended model that is reported.
LITTLE = 0.001
# Ratio of a joint's error in all rows to that in counted rows, and share of rows that do not count, above which both
# errors are reported as different.
MUCH_MORE, SEVERAL = 2.0, 0.01
CLIPPING = CurrentClipping()


_AT_LIMIT = (
    "Joint {}: the torque stays at its maximum, {:.3g} {}, for several consecutive samples, repeatedly. The drive "
    "probably saturates there; the effect on the model is too small to detect."
)


def notes_of(
    problem: Problem,
    false_alarm: float,
    findings: Sequence[Finding],
    apart: Sequence[Finding],
    after: Array,
    timed: Sequence[str] = (),
) -> tuple[str, ...]:
    """Lists limitations of the logs and of the findings.

    Args:
        problem: logs and base model.
        false_alarm: threshold of the p-values.
        findings: all findings.
        apart: findings that the extended model does not contain.
        after: NRMSE of the extended model on held-out data (n,).
        timed: names of effects identified from reversals, whose rows do not count.

    Returns:
        The notes.
    """
    recording, robot = problem.recording, problem.situation.robot
    notes = []
    still = [j + 1 for j in range(recording.n) if np.ptp(recording.q[:, j]) < STILL]
    if still:
        names = ", ".join(map(str, still))
        whose = f"Joints {names} hardly moved: their" if len(still) > 1 else f"Joint {names} hardly moved: its"
        notes.append(f"{whose} friction, gear and rotor effects cannot be detected. Gravity and coupling torques can.")
    clipped_joints = {finding.joint for finding in findings if finding.effect == CLIPPING.name}
    for j in sorted({*range(1, recording.n + 1)} - clipped_joints):
        if CLIPPING.chance(problem.state_for(CLIPPING), j, recording.tau) < FLAT_TOP_CHANCE:
            notes.append(_AT_LIMIT.format(j, float(np.abs(recording.tau[:, j - 1]).max()), force_unit(robot, j - 1)))
    strange = _strange(problem, after)
    notes += strange.values()
    notes += [
        f"Joint {j + 1}: the residual on held-out data is {100 * after[j]:.0f} % of the torque. Most of it "
        "is treated as noise, so effects may be missed. Diagnose each log separately."
        for j in np.flatnonzero(after > LARGE_HELD_OUT_ERROR)
        if j not in strange
    ]
    for finding in findings:
        shapes = EFFECTS[finding.effect].shapes if finding.effect in EFFECTS else ()
        assumed = {(shape.name, shape.default) for shape in shapes}
        lost = [p for p in finding.parameters if not p.determined and p.unit == "s" and np.isnan(p.standard_error)]
        for parameter in (p for p in lost if (p.name, p.value) not in assumed):
            notes.append(
                f"{finding.effect}: {recording.duration:.0f} s of logs do not determine {parameter.name}. The value "
                f"{parameter.value:.3g} s is one of many that fit."
            )
        # Findings outside the model get no gain note, because their sentence states the failed validation.
        if finding.effect in timed:
            notes.append(_TIMED.format(finding.effect))
        elif finding.gain.ci95[0] <= 0 and finding not in apart:
            notes.append(unsure_gain(finding))
    part = [finding for finding in findings if finding not in apart]
    open_ = sorted({finding.joint for finding in part if finding.effect == "unexplained" and finding.joint})
    if open_:
        names = ", ".join(map(str, open_))
        notes.append(
            f"Joint{'s' if len(open_) > 1 else ''} {names}: no effect of the catalogue explains the residual. "
            "The model contains a free function of the inputs named above instead. It is valid only where these "
            "logs have data."
        )
    sprung = {finding.joint for finding in findings if finding.effect == "spring"}
    notes += [text for joint, text in undetectable_springs(problem, false_alarm) if joint not in sprung]
    return tuple(notes)


_TIMED = (
    "{} was identified from impulses at velocity reversals. Those rows are excluded from the fit and from the held-out "
    "error, because the time of a reversal is uncertain. Its held-out gain is not meaningful."
)
_UNSURE = "The held-out gain of {} is not significant: its interval includes zero."
_VAGUE = " These logs determine none of its parameters either, so the effect is reported as the most likely cause only."
_AGAINST = (
    "With {} the model predicts the held-out data worse. The effect may be absent there or have another cause, or the "
    "fit may have moved poorly determined base parameters."
)


def unsure_gain(finding: Finding) -> str:
    """States that the held-out gain is not significant or negative, and if so, that no parameter is determined."""
    named = finding.effect != "unexplained"
    what = finding.effect if named else "the unexplained residual"
    where = f"{what} of joint {finding.joint}" if finding.joint else what
    vague = named and finding.parameters and not any(parameter.determined for parameter in finding.parameters)
    return (_UNSURE if finding.gain.ci95[1] >= 0 else _AGAINST).format(where) + (_VAGUE if vague else "")


def _strange(problem: Problem, after: Array) -> dict[int, str]:
    """Lists joints whose held-out error is far larger than the fit error."""
    counts = ~problem.recording.sign_unknown
    number = np.maximum(counts.sum(axis=0), 1)
    torque = np.sqrt((problem.recording.tau**2 * counts).sum(axis=0) / number)
    fitted = np.sqrt((problem.base_residual**2 * counts).sum(axis=0) / number) / np.maximum(torque, 1e-12)
    far = np.flatnonzero(after > np.maximum(MIN_HELD_OUT_RATIO * fitted, MIN_HELD_OUT_ERROR))
    return {int(j): _STRANGE.format(j + 1, 100 * after[j], 100 * fitted[j]) for j in far}


_STRANGE = (
    "Joint {}: the residual is {:.3g} % of the torque on held-out data, but {:.2g} % in the fit of the base model. The "
    "logs differ in something that was not found, or some of them do not determine the joint's parameters."
)


def worse_joints(before: Array, after: Array) -> list[str]:
    """Lists joints whose held-out NRMSE (n,) is larger with the extended model than with the base model.

    An effect on one joint can change the base parameters of others.

    Args:
        before: NRMSE of the base model (n,).
        after: NRMSE of the extended model (n,).

    Returns:
        One note, or none.
    """
    worse = np.flatnonzero(after > np.maximum(MIN_WORSE_RATIO * before, before + LITTLE))
    if not len(worse):
        return []
    errors = ", ".join(f"{j + 1} ({100 * before[j]:.3g} -> {100 * after[j]:.3g} %)" for j in worse)
    return [f"The extended model has a larger held-out error on joint{'s' if len(worse) > 1 else ''} {errors}."]


def turning_joints(every: Array, after: Array, counts: NDArray[np.bool_]) -> list[str]:
    """Lists joints whose error is dominated by rows with unknown friction sign, which do not count otherwise.

    Args:
        every: NRMSE of the extended model on all held-out rows (n,).
        after: its NRMSE on rows that count (n,).
        counts: mask of the rows that count (N, n).

    Returns:
        One note, or none.
    """
    aside = 1.0 - counts.mean(axis=0)
    (joints,) = np.nonzero((every > MUCH_MORE * after) & (aside > SEVERAL))
    if not len(joints):
        return []
    names = ", ".join(str(j + 1) for j in joints)
    shares = sorted({f"{100 * share:.0f}" for share in (aside[joints].min(), aside[joints].max())}, key=float)
    return [_TURNING.format("s" if len(joints) > 1 else "", names, " to ".join(shares))]


_TURNING = (
    "Joint{} {}: in {} % of the held-out rows the joint rests or reverses. The sign of its friction is unknown there, "
    "so these rows count only in the error of all rows."
)


def faster_joints(problem: Problem, seen: HeldOutResult) -> list[str]:
    """Lists joints that are faster in the held-out data than in the fit of the friction polynomial, in one note."""
    columns = problem.baseline.base.columns
    if seen.whole is problem.recording or not any((c.term, c.symbol) == ("friction", "f4") for c in columns):
        return []
    unseen = cut_recording(seen.whole, slice(seen.first_held_out_row, len(seen.whole)))
    known, there = (np.abs(recording.dq).max(axis=0) for recording in (problem.recording, unseen))
    ratio = there / np.maximum(known, 1e-9)
    fast = np.flatnonzero(ratio > MIN_SPEED_RATIO)
    names = ", ".join(str(j + 1) for j in fast)
    return [_FASTER.format("s" if len(fast) > 1 else "", names, ratio[fast].max())] if len(fast) else []


def farther_joints(problem: Problem, seen: HeldOutResult, findings: Sequence[Finding]) -> list[str]:
    """Lists joints with position-dependent findings that are extrapolated on held-out data, in one note each."""
    if seen.whole is problem.recording:
        return []
    unseen = cut_recording(seen.whole, slice(seen.first_held_out_row, len(seen.whole)))
    notes = []
    placed = {f.joint for f in findings if f.effect in PLACED and f.coordinate.startswith("position of joint")}
    for joint in sorted(joint for joint in placed if joint):
        known, there = (np.ptp(recording.q[:, joint - 1]) for recording in (problem.recording, unseen))
        low, high = (float(limit(problem.recording.q[:, joint - 1])) for limit in (np.min, np.max))
        q = unseen.q[:, joint - 1]
        beyond = float(np.mean((q < low - MIN_RANGE_EXCESS * known) | (q > high + MIN_RANGE_EXCESS * known)))
        if beyond > MIN_RANGE_EXCESS:
            notes.append(_FARTHER.format(joint, 100 * beyond, there / max(known, 1e-9)))
    return notes


_FARTHER = (
    "Joint {}: {:.0f} % of the held-out data lie outside the positions of the fitted logs (their range is {:.1f} times "
    "as large). Position-dependent findings are extrapolated there, so error and gain may be wrong."
)
_FASTER = (
    "Joint{} {}: up to {:.1f} times as fast in the held-out data as in the fitted logs. The friction polynomial is "
    "extrapolated there, so error and gain may be wrong. Try `auto` friction."
)


def beside_larger(slight: FittedEffect | None, members: Sequence[FittedEffect]) -> tuple[str, ...]:
    """Reports a significant candidate `slight` that the formula error of one of the members can explain."""
    if slight is None:
        return ()
    shares = [(slight.gain_on([j]) / m.gain_on([j]), m, j) for m in members for j in slight.group.joints if _acts(m, j)]
    if not shares:
        return ()
    share, member, j = min(shares, key=lambda each: each[0])
    if slight.hypothesis.effect.delays_all_torque:
        return (_NOT_ALIKE.format(slight.hypothesis.label, member.hypothesis.label),)
    if share >= 1.0:
        return ()
    return (_SLIGHT.format(slight.hypothesis.label, member.hypothesis.label, 100 * share, j + 1),)


def _acts(member: FittedEffect, joint: int) -> bool:
    return joint in member.group.joints and member.gain_on([joint]) > 0


_SLIGHT = (
    "{0} is significant too, but not reported as a finding. On joint {3}, it improves the fit by only {2:.1f} % of "
    "what {1} improves it by. A small error in the formula of {1} can produce the same residual. A log in which {1} "
    "acts less would decide."
)
_NOT_ALIKE = (
    "{0} is significant too, but not reported as a finding. A small error in the formula of {1}, or the drives' "
    "response to {1}, can produce the same residual on these joints."
)


def state_change(changed: ChangedFinding) -> str:
    """States one change of a finding by the held-out data."""
    place = f"joint {changed.effect.joint}" if changed.effect.joint else "the whole robot"
    free = changed.effect.name.startswith(PREFIX)
    label = f"a free function of {place}" if free else changed.effect.label
    return _CHANGES[changed.change].format(label, changed.instead and changed.instead.label, place)


_CHANGES = {
    Change.INSIGNIFICANT: "{0} was rejected: it was barely significant, and the held-out data do not support it.",
    Change.REJECTED: ("{0} was rejected: it was significant in the fit, but does not improve the held-out prediction."),
    Change.REPLACED: (
        "{0} was replaced by {1}: both fit about equally well, but only {1} improves the held-out prediction."
    ),
    Change.ABSENT: (
        "{0} seems to be absent from the held-out data, for example because a payload was removed before. The held-out "
        "errors are computed without it. The model keeps it from the time of the change on."
    ),
    Change.FREE_FUNCTION_REJECTED: (
        "Part of the residual of {2} is unexplained. The free function fitted to it did not improve the held-out "
        "prediction, so the extended model does not contain it."
    ),
}
