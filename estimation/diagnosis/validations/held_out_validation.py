"""Which of the names that were found unseen data bear out: others are left out, or give way to a rival that is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from estimation.diagnosis.calibration import CLOSE_RIVAL_BIC, MIN_BIC_GAIN
from estimation.diagnosis.findings import Gain
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.refinement import FittedEffect
from estimation.diagnosis.searches.selection import SelectedEffect
from estimation.diagnosis.validations.free_functions import SURE
from estimation.diagnosis.validations.held_out_errors import HeldOutResult
from estimation.diagnosis.validations.verdict import Verdict
from robots.terms.discrepancies.patterns import PREFIX, is_of_time, is_oscillation
from robots.terms.effects import Effect

MIN_RETAINED_GAIN = 0.2  # share of an effect's gain that stretches left out must show
OSCILLATION_P_VALUE = 1e-5  # chance from which on a swing of which unseen data cannot say is taken for noise
MINOR_SHARE, MINOR_BIC_GAIN = (
    0.1,
    50.0,
)  # share of the strongest name's worth, and BIC, below which another hardly stands out
CONTRADICTION_SHARE = 0.1  # share of an effect's gain by which unseen data must speak against it
MAX_RMSE_RATIO = 1.05  # times the unseen error: an effect that makes it so much larger is left out, sure or not
REJECT_RMSE_RATIO = (
    1.2  # the same, whatever unseen rows say of it: where they go beyond what was fitted, its formula does not hold
)
MAX_FREE_RMSE_RATIO = (
    1.02  # times the base model's unseen error of a joint, by which free functions together are no model of it
)
MIN_SUPPORT, MIN_SUPPORT_CHI2 = (
    0.4,
    30.0,
)  # share and size of the growth by which unseen rows speak for an effect, whatever the error


@dataclass(frozen=True, eq=False)
class ValidatedFindings:
    """What is left of what was found.

    Attributes:
        findings: names that hold.
        effects: theirs, and free functions after them.
        p_values: of the members.
        measured: what the members bring on unseen data.
        rejected_discrepancies: free functions that err on unseen data, with p-value and gain.
        notes: what was left out, in words.
        refuted: names that stood out clearly and that unseen data speak against, with p-value and gain: they are no
            cause, but there is one.
    """

    findings: tuple[SelectedEffect, ...]
    effects: tuple[FittedEffect, ...]
    p_values: tuple[float, ...]
    measured: HeldOutResult
    rejected_discrepancies: tuple[tuple[FittedEffect, float, Gain], ...]
    notes: tuple[str, ...]
    refuted: tuple[tuple[FittedEffect, float, Gain], ...]


def validate_on_held_out(
    judgement: Verdict,
    measure: Callable[[Sequence[FittedEffect], frozenset[int]], HeldOutResult],
    beyond: Callable[[Effect], bool],
    forms: Callable[[Sequence[FittedEffect], int], Sequence[FittedEffect]],
    worth: Callable[[FittedEffect], float],
    unnamed: Callable[[FittedEffect, Sequence[FittedEffect]], tuple[FittedEffect, float] | None],
) -> ValidatedFindings:
    """Leaves out what makes unseen errors larger, one after the other, the surest first.

    However well it fits, it is no cause: a few rows at the end of a log. Where another form of it that fits about as
    well is borne out, or a rival, that takes its place; else what it was for is told as unexplained.

    Args:
        judgement: what was found.
        measure: measures members on unseen data, which are without some of them, by their place.
        beyond: tells of which effects those data can say nothing.
        forms: lists other forms of one of some members, the likeliest first.
        worth: how clearly a name stands out of the noise, by its BIC. Of one that hardly does, or hardly beside a far
            stronger one, whose formula may leave as much, unseen data that do not speak for it are the odds against it.
        unnamed: finds a free function of what a name that is left out was for, beside other members; with its p-value.
    """
    founds = list(judgement.named)
    members = [*(found.effect for found in founds), *judgement.patterns]
    p_values = [*(found.p_value for found in founds), *judgement.p_values]
    spoiling: list[tuple[FittedEffect, float, Gain]] = []
    notes: list[str] = []
    refuted: list[tuple[FittedEffect, float, Gain]] = []
    gone: set[Hypothesis] = set()
    cooled: set[Hypothesis] = set()

    def look(members: Sequence[FittedEffect]) -> HeldOutResult:
        return measure(members, frozenset(i for i, member in enumerate(members) if member.hypothesis in gone))

    seen = look(members)
    strongest = max((worth(found.effect) for found in founds), default=0.0)
    while idle := [i for i in range(len(founds)) if _is_insignificant(seen, i, members[i], beyond, worth, strongest)]:
        notes.append(_FAINT.format(members[idle[0]].hypothesis.label))
        for items in (founds, members, p_values):
            items.pop(idle[0])
        seen = look(members)
    while harmful := (
        [i for i, m in enumerate(members) if m.hypothesis not in cooled and _is_harmful(seen, i, m, beyond)]
        or _harmful_free_functions(seen, members, len(founds))
    ):
        worst = min(harmful, key=lambda i: seen.gains[i].ci95[1])
        label = members[worst].hypothesis.label
        if len(members) == 1 > len(founds) and _is_weak(members[0].hypothesis.effect, p_values[0]):
            # All that stood out, and hardly: unseen data against it are the odds that it is noise.
            own = members[0].hypothesis.joint
            notes.append(_FAINT.format(f"a free function of {f'joint {own}' if own else _WHOLE}"))
            members.clear()
            p_values.clear()
        elif worst >= len(founds):
            # A free function that errs elsewhere is no model; that something is unexplained is as true as before.
            spoiling.append((members.pop(worst), p_values.pop(worst), seen.gains[worst]))
        elif (undone := _without_change(members, worst, gone, look)) is not None:
            seen = undone
            notes.append(_UNDONE.format(label))
            continue
        elif instead := _alternative(founds[worst], worst, members, look, beyond, forms):
            founds[worst], seen = instead
            members[worst] = founds[worst].effect
            if members[worst].hypothesis.label != label:
                notes.append(_REPLACED.format(label, members[worst].hypothesis.label))
            continue
        elif _explained_by_cooling(seen, worst, members[worst]):
            cooled.add(members[worst].hypothesis)
            continue
        else:
            founds.pop(worst)
            refused = members.pop(worst)
            refuted.append((refused, p_values.pop(worst), seen.gains[worst]))
            notes.append(_DROPPED.format(label))
            if (free := unnamed(refused, members)) is not None:
                members.append(free[0])
                p_values.append(free[1])
        seen = look(members)
    joints = sorted({member.hypothesis.joint or 0 for member, _, _ in spoiling})
    notes += [_SPOILING.format(f"joint {joint}" if joint else _WHOLE) for joint in joints]
    return ValidatedFindings(
        tuple(founds), tuple(members), tuple(p_values), seen, tuple(spoiling), tuple(notes), tuple(refuted)
    )


_FAINT = "{} was rejected: it was barely significant, and the held-out data do not support it."
_DROPPED = "{} was rejected: it was significant in the fit, but does not improve the held-out prediction."
_REPLACED = "{0} was replaced by {1}: both fit about equally well, but only {1} improves the held-out prediction."
_UNDONE = (
    "{} seems to be absent from the held-out data, for example because a payload was removed before. The held-out "
    "errors are computed without it. The model keeps it from the time of the change on."
)
_WHOLE = "the whole robot"
_SPOILING = (
    "Part of the residual of {} is unexplained. The free function fitted to it did not improve the held-out "
    "prediction, so the extended model does not contain it."
)


def _without_change(
    members: Sequence[FittedEffect],
    place: int,
    gone: set[Hypothesis],
    look: Callable[[Sequence[FittedEffect]], HeldOutResult],
) -> HeldOutResult | None:
    """Measures unseen data that a change is gone from again, such as a payload; None where that is no better."""
    hypothesis = members[place].hypothesis
    effect = hypothesis.effect
    comes = effect.depends_on == "time" and not effect.transient and any(shape.moment for shape in effect.shapes)
    if hypothesis in gone or not comes:
        return None
    gone.add(hypothesis)
    seen = look(members)
    if seen.gains[place].ci95[0] > 0:
        return seen
    gone.remove(hypothesis)
    return None


def _alternative(
    found: SelectedEffect,
    place: int,
    members: Sequence[FittedEffect],
    measure: Callable[[Sequence[FittedEffect]], HeldOutResult],
    beyond: Callable[[Effect], bool],
    forms: Callable[[Sequence[FittedEffect], int], Sequence[FittedEffect]],
) -> tuple[SelectedEffect, HeldOutResult] | None:
    """Finds another form or the closest rival of a name that unseen data bear out, and what all bring with it.

    Where none is, the same cause may stay in a form that the log does not tell from the first and that does no harm.
    """
    harmless: list[tuple[SelectedEffect, HeldOutResult]] = []
    for form in forms(members, place):
        seen = measure([*members[:place], form, *members[place + 1 :]])
        if not _is_harmful(seen, place, form, beyond):
            harmless.append((SelectedEffect(form, found.p_value, found.rivals), seen))
            if seen.gains[place].ci95[0] > 0:
                return harmless[-1]
    close = [(rival, worse) for rival, worse in found.rivals if worse < CLOSE_RIVAL_BIC]
    for k, (rival, worse) in enumerate(close):
        seen = measure([*members[:place], rival, *members[place + 1 :]])
        if not _is_harmful(seen, place, rival, beyond) and seen.gains[place].ci95[0] > 0:
            rest = tuple((other, more - worse) for other, more in close[k + 1 :])
            return SelectedEffect(rival, found.p_value, rest), seen
    return harmless[0] if harmless else None


def _harmful_free_functions(seen: HeldOutResult, members: Sequence[FittedEffect], named: int) -> list[int]:
    """Lists free functions, after the named members, that are not sure to bring anything where all together harm.

    Each may bring something beside the others, what those first took away.
    """
    before, after = seen.errors.nrmse(0), seen.errors.nrmse(-1)
    worse = set((np.flatnonzero(after > MAX_FREE_RMSE_RATIO * before) + 1).tolist())
    free = range(named, len(members)) if len(members) > 1 else ()
    return [i for i in free if seen.gains[i].ci95[0] <= 0 and (members[i].hypothesis.joint or 0) in worse]


def _is_weak(free: Effect, p_value: float) -> bool:
    """Whether a free function that is alone stands out so little that unseen data against it are the odds against it.

    Of what knows nothing of the motion they can say nothing.
    """
    return not is_of_time(free) and p_value > (OSCILLATION_P_VALUE if is_oscillation(free) else SURE)


def _is_insignificant(
    seen: HeldOutResult,
    i: int,
    member: FittedEffect,
    beyond: Callable[[Effect], bool],
    worth: Callable[[FittedEffect], float],
    strongest: float,
) -> bool:
    """Whether a name that hardly stands out brings nothing on unseen data that it should be seen in.

    One that stands out of the noise, and hardly beside another, may move base parameters to where they err there, and
    be true: then those data speak for it, or it surely brings something after all.
    """
    gain = seen.gains[i]
    if beyond(member.hypothesis.effect):
        return False
    slight = (
        worth(member) < min(MINOR_SHARE * strongest, MINOR_BIC_GAIN)
        and seen.support[i] < MIN_RETAINED_GAIN
        and gain.ci95[0] <= 0
    )
    return slight or (worth(member) <= MIN_BIC_GAIN and gain.nrmse_after >= gain.nrmse_before)


def _is_harmful(seen: HeldOutResult, i: int, member: FittedEffect, beyond: Callable[[Effect], bool]) -> bool:
    """Whether unseen errors are surely larger with a member, or larger by so much that it is no gain to have it.

    A cause that acts at all times must also leave on stretches left out some of what it does where it was fitted: of
    the error or, where a base model that other stretches hardly tell hides that, of what unseen rows say beside it. Of
    a joint whose base model the logs do not tell nothing can be named.
    """
    effect, joint = member.hypothesis.effect, member.hypothesis.joint
    if beyond(effect):
        return False
    gain, speaks = seen.gains[i], seen.support[i]
    told = (speaks >= MIN_RETAINED_GAIN and gain.ci95[0] > 0) or (
        speaks >= MIN_SUPPORT and speaks * member.gain > MIN_SUPPORT_CHI2
    )
    if effect.depends_on == "state" and seen.cv_retained_gain[i] < MIN_RETAINED_GAIN and not told:
        return True
    if joint is not None and seen.errors.is_unreliable(joint - 1):
        return True
    # A free function claims no cause: what it brings elsewhere is all that it is good for.
    least = gain.ci95[1] if len(seen.gains) == 1 or is_of_time(effect) else gain.nrmse_before - gain.nrmse_after
    idle = effect.name.startswith(PREFIX) and least < 0
    # By less of its gain than this a base model that errs there, too, makes them speak against a cause.
    against = seen.contradicts[i] and speaks < -CONTRADICTION_SHARE
    # Base parameters that it moves may err elsewhere by more than it is, whatever those rows say of it.
    risen = (
        seen.rmse_ratio[i] > MAX_RMSE_RATIO
        if speaks < MIN_RETAINED_GAIN
        else seen.rmse_ratio[i] > REJECT_RMSE_RATIO and gain.ci95[0] <= 0
    )
    # Heat that was stored before the unseen data, and what a pause left of it, are told by neither.
    return (against and not effect.has_thermal_memory) or idle or risen


def _explained_by_cooling(seen: HeldOutResult, i: int, member: FittedEffect) -> bool:
    """Whether what unseen data have against a member may be but the heat that a pause left of what they do not show.

    One mass stands for gear and housing: how warm a joint is when it moves again it tells worse than how it warmed.
    """
    joint = member.hypothesis.joint
    known = seen.cv_retained_gain[i] >= MIN_RETAINED_GAIN and not (
        joint is not None and seen.errors.is_unreliable(joint - 1)
    )
    return member.hypothesis.effect.has_thermal_memory and known and seen.rmse_ratio[i] <= REJECT_RMSE_RATIO
