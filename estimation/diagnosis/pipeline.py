"""The diagnosis: finds model errors, names their causes, extends the model and validates it on held-out data."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.base_models.baseline import base_parameters
from estimation.diagnosis.base_models.payload_and_gravity import subtract_known_payload
from estimation.diagnosis.experiment_plans.detection_limits import find_limits
from estimation.diagnosis.hypothesis_tests.hypotheses import all_hypotheses
from estimation.diagnosis.hypothesis_tests.scan import measure
from estimation.diagnosis.recordings.log_reading import build_recording
from estimation.diagnosis.recordings.log_repair import repair_log
from estimation.diagnosis.recordings.unusable_logs import find_unusable_logs
from estimation.diagnosis.results.assembly import DiagnosisInputs, assemble
from estimation.diagnosis.results.diagnosis import Diagnosis
from estimation.diagnosis.searches.search import search
from estimation.diagnosis.validations.residual_shares import residual_shares
from estimation.diagnosis.validations.verdict import decide_verdict
from estimation.logs.clocks import put_on_clock
from robots.common.errors import InputError, NotIdentifiableError
from robots.common.memory import give_back
from robots.common.parallel import one_blas_thread
from robots.common.progress import SILENT, Progress
from robots.robot import Robot
from robots.signals import Log
from robots.terms.discrepancies.patterns import all_patterns
from robots.terms.effects import EFFECTS, Effect, check_effect

Array = NDArray[np.float64]


@one_blas_thread()
def diagnose(
    robot: Robot,
    logs: Log | Sequence[Log],
    *,
    held_out: Log | Sequence[Log] | None = None,
    candidates: Sequence[str | Effect] | None = None,
    friction: str = "polynomial",
    false_alarm: float = 0.01,
    check: bool = True,
    seed: int = 0,
    progress: Progress | None = None,
) -> Diagnosis:
    """Finds what rigid body, friction, rotors and offsets do not explain in a robot's logs.

    Positions are smoothed: by harmonics where the motion repeats, else by a low-pass chosen from the spectrum. The
    spectrum of the torque noise is estimated. Every effect of the catalogue is scored at every joint, jointly with the
    base model, against the null distribution of the maximum. Shapes are refined and rivals tried before the next
    effect is searched. A significant residual that no effect explains is reported as unexplained.

    Args:
        robot: the robot.
        logs: one or several, of t, q and tau or current; t is one clock. Logs that overlap count one after the other,
            in the order given. A log that says so carries a known payload, or was recorded under another gravity.
        held_out: logs of other motions for validation; without them, logs or stretches are left out in turn.
        candidates: effects to look for, by name or as objects; by default all that are registered. An own effect is
            registered by being given.
        friction: of the base model: ``polynomial`` or ``coulomb-viscous``.
        false_alarm: chance of finding an effect in logs that have none.
        check: whether each log passes the gate first, which rejects unusable logs. Outlier rows are then interpolated,
            and logs are cut at gaps.
        seed: of the resampling behind the gains' intervals.
        progress: receives the progress.

    Returns:
        The diagnosis.

    Raises:
        InputError: logs of another robot, without torque, too short, given twice or refused by the gate; an unknown
            effect or option.
        NotIdentifiableError: no joint moves.
    """
    data = [logs] if isinstance(logs, Log) else list(logs)
    other = [] if held_out is None else [held_out] if isinstance(held_out, Log) else list(held_out)
    if not data:
        raise InputError("no logs", allowed="one or more")
    if not 0 < false_alarm < 0.5:
        raise InputError(f"false-alarm probability {false_alarm}", allowed="between 0 and 0.5")
    effects = _effects(robot, candidates)
    bar = progress or SILENT
    bar.start("diagnosing", 1.0)
    try:
        on_clock = put_on_clock(data, other)
        data, other = sorted(on_clock.logs, key=lambda log: float(log.t[0])), list(on_clock.held_out)
        found: list[str] = []
        if check:
            bar.update(0.0, "checking the logs")
            (data, log_notes), (other, held_out_notes) = (
                _repaired(robot, data, "Log"),
                _repaired(robot, other, "Held out"),
            )
            found = [*log_notes, *held_out_notes]
        recording = subtract_known_payload(robot, build_recording(robot, data))
        if not (np.ptp(recording.q, axis=0) > 0).any():
            raise NotIdentifiableError("no joint moves", remedy="record a log in which the arm moves")
        # Held-out logs count too: gravities that only they have need the description as prior.
        gravities = [log.gravity for log in (*data, *other) if log.gravity is not None]
        base = base_parameters(robot, friction, (0.001,) * robot.n, gravities)
        unusable = find_unusable_logs(base, recording)
        notes = tuple(_UNUSABLE.format(k + 1, _log_name(recording.names[k]), 100 * s) for k, s in unusable.items())
        if unusable:
            data = [log for k, log in enumerate(data) if k not in unusable]
            recording = subtract_known_payload(robot, build_recording(robot, data))
        searched = search(base, recording, effects, false_alarm, bar)
        problem, selection, entries = searched.problem, searched.selection, searched.entries
        bar.update(0.75, "detection limits")
        limits = find_limits(problem, entries, false_alarm=false_alarm)
        # The columns of all hypotheses are most of what is kept: those of the patterns take their room.
        del searched, entries
        give_back()
        bar.update(0.83, "unexplained residual")
        patterns = measure(problem, all_hypotheses(robot, list(all_patterns(robot))))
        judgement = decide_verdict(problem, selection, patterns, false_alarm)
        bar.update(0.93, "validation on held-out data")
        del patterns
        give_back()
        inputs = DiagnosisInputs(
            problem=problem,
            selection=selection,
            verdict=judgement,
            limits=limits,
            excess=residual_shares(problem),
            logs=tuple(data),
            held_out=tuple(other),
            dated=on_clock.dated,
            false_alarm=false_alarm,
            seed=seed,
            notes=(*on_clock.notes, *found, *notes),
        )
        return assemble(robot, inputs)
    finally:
        bar.finish()


_UNUSABLE = (
    "Log {}{} is left out: even when fitted to this log alone, the base model leaves {:.0f} % of the torque on every "
    "joint. Check its torque signal."
)


def _repaired(robot: Robot, logs: Sequence[Log], kind: str) -> tuple[list[Log], list[str]]:
    """Gives the usable stretches of logs, and notes about them."""
    several = [repair_log(robot, log, f"{kind} {k}{_log_name(log.name)}") for k, log in enumerate(logs, start=1)]
    return [part for one in several for part in one.logs], [note for one in several for note in one.notes]


def _log_name(name: str) -> str:
    return f" ({name})" if name else ""


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
