"""The diagnosis: finds model errors, names their causes, extends the model and validates it on held-out data."""

from __future__ import annotations

from collections.abc import Sequence

from estimation.diagnosis.base_models.prepared_logs import TOLERATED, prepare_logs
from estimation.diagnosis.experiment_plans.detection_limits import find_limits
from estimation.diagnosis.hypothesis_tests.hypotheses import all_hypotheses
from estimation.diagnosis.hypothesis_tests.scan import measure
from estimation.diagnosis.results.diagnosis import Diagnosis
from estimation.diagnosis.results.report import report
from estimation.diagnosis.searches.search import search
from estimation.diagnosis.validations.extended_model import fit_extended_model
from estimation.diagnosis.validations.name_comparison import compare_with_free_functions
from estimation.diagnosis.validations.validated_findings import decide
from estimation.diagnosis.validations.validation import validate
from estimation.identifications.estimate import Estimate
from estimation.recordings import Recording, make_ready
from robots.common.errors import InputError
from robots.common.parallel import one_blas_thread
from robots.common.progress import SILENT, Progress
from robots.common.workers import give_back
from robots.robot import Robot
from robots.signals import Log
from robots.terms import BendingFriction, FrictionTerm
from robots.terms.discrepancies.patterns import all_patterns
from robots.terms.effects import EFFECTS, Effect, check_effect


@one_blas_thread()
def diagnose(
    what: Robot | Estimate,
    logs: Log | Sequence[Log] = (),
    *,
    held_out: Log | Sequence[Log] | None = None,
    candidates: Sequence[str | Effect] | None = None,
    friction: str | FrictionTerm | None = None,
    false_alarm: float = 0.01,
    check: bool = True,
    seed: int = 0,
    progress: Progress | None = None,
) -> Diagnosis:
    """Finds what rigid body, friction, rotors and offsets do not explain in a robot's logs.

    Positions are smoothed: by harmonics where the motion repeats, else by a low-pass chosen from the spectrum. The
    spectrum of the torque noise is estimated. Every effect of the catalogue is scored at every joint, jointly with the
    base model; p-values count all of them (Bonferroni). Shapes are refined and rivals tried before the next effect is
    searched. Causes must explain the data as well as free functions in their place, and improve the held-out
    prediction. A significant residual that no effect explains is reported as unexplained. Effects and shapes are
    compared by the Bayesian information criterion (Schwarz 1978).

    Args:
        what: the robot; or its estimate, whose logs are then diagnosed as they were made ready for it.
        logs: of a robot, one or several, of t, q and tau or current; t is one clock. Logs that overlap count one after
            the other, in the order given. A log that says so carries a known payload, or was recorded under another
            gravity.
        held_out: logs of other motions for validation; without them, logs or stretches are left out in turn.
        candidates: effects to look for, by name or as objects; by default all that are registered. An own effect is
            registered by being given.
        friction: of the base model: ``auto`` (`BendingFriction`, which grows linearly beyond the recorded speeds),
            ``polynomial``, ``coulomb-viscous``, or a term of one's own. None: that of the estimate, or ``auto``.
        false_alarm: chance of finding an effect in logs that have none.
        check: whether each log passes the gate first, which rejects unusable logs. Outlier rows are then interpolated,
            and logs are cut at gaps. The logs of an estimate were checked for it.
        seed: of the resampling behind the gains' intervals.
        progress: receives the progress.

    Returns:
        The diagnosis.

    Raises:
        InputError: logs of another robot, without torque, too short, given twice or refused by the gate; logs beside
            an estimate, or an estimate of a log that was read in pieces; an unknown effect or option.
        NotIdentifiableError: no joint moves.
    """
    if not 0 < false_alarm < 0.5:
        raise InputError(f"false-alarm probability {false_alarm}", allowed="between 0 and 0.5")
    robot = what if isinstance(what, Robot) else what.model.robot
    effects = _effects(robot, candidates)
    bar = progress or SILENT
    bar.start("diagnosing", 1.0)
    try:
        bar.update(0.0, "checking the logs" if check else "reading the logs")
        fit = make_ready(what, logs, check=check, tolerated=TOLERATED) if isinstance(what, Robot) else _of(what, logs)
        robot = fit.robot
        unseen = make_ready(robot, held_out, check=check, tolerated=TOLERATED) if held_out else None
        prepared = prepare_logs(fit, unseen, friction or _friction_of(what))
        found = search(prepared.base, prepared.recording, effects, false_alarm, bar)
        bar.update(0.75, "detection limits")
        limits = find_limits(found.problem, found.entries, false_alarm=false_alarm)
        # The columns of all hypotheses are most of what is kept: those of the free functions take their room.
        found.entries.clear()
        give_back()
        bar.update(0.83, "unexplained residual")
        free = measure(found.problem, all_hypotheses(robot, list(all_patterns(robot))))
        compared = compare_with_free_functions(found.problem, found.selection, free, false_alarm)
        free.clear()
        give_back()
        bar.update(0.93, "validation on held-out data")
        validated = validate(robot, found.problem, compared, prepared, false_alarm=false_alarm, seed=seed)
        decision = decide(validated)
        model = fit_extended_model(found.problem, validated, decision, prepared, false_alarm=false_alarm, seed=seed)
        return report(robot, found, prepared, limits, compared, validated, decision, model, false_alarm)
    finally:
        bar.finish()


def _of(estimate: Estimate, logs: Log | Sequence[Log]) -> Recording:
    """The logs of an estimate, as they were made ready for it."""
    if logs:
        raise InputError("logs beside an estimate", allowed="the estimate, which has its logs; or a robot and logs")
    return estimate.require_recording()


def _friction_of(what: Robot | Estimate) -> str | FrictionTerm:
    if isinstance(what, Robot):
        return "auto"
    term = next(term for term in what.model.torque_model.terms if isinstance(term, FrictionTerm))
    # The bends of a diagnosis are finer: a curve that its base model cannot follow would have a name.
    return "auto" if isinstance(term, BendingFriction) else term


def _effects(robot: Robot, candidates: Sequence[str | Effect] | None) -> list[Effect]:
    """The effects to look for; own ones are checked and registered, so that all stages find them by name."""
    if candidates is None:
        return [_checked(effect, robot) for effect in EFFECTS.values()]
    chosen = []
    for candidate in candidates:
        if isinstance(candidate, str):
            candidate = EFFECTS.get_or_raise(candidate)
        else:
            EFFECTS.register(candidate)
        chosen.append(_checked(candidate, robot))
    if not chosen:
        raise InputError("no effects to look for", allowed="one or more names")
    return chosen


def _checked(effect: Effect, robot: Robot) -> Effect:
    if not type(effect).__module__.startswith("robots."):
        check_effect(effect, robot)
    return effect
