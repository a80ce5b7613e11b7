"""The verb: finds what a robot's model gets wrong, names the cause, extends the model, measures the gain."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimation.clocks import clocked
from estimation.diagnosis.baseline import Baseline, base_parameters, build_baseline, inertia_of
from estimation.diagnosis.carried import lightened
from estimation.diagnosis.composed import composed
from estimation.diagnosis.diagnosis import Diagnosis
from estimation.diagnosis.excess import residual_shares
from estimation.diagnosis.hopeless_logs import hopeless_logs
from estimation.diagnosis.hypotheses import Hypothesis, all_hypotheses
from estimation.diagnosis.limits import find_limits
from estimation.diagnosis.mended import mended
from estimation.diagnosis.noise import estimate_whitening, quiet_joints
from estimation.diagnosis.own_functions import is_short, own_functions
from estimation.diagnosis.patterns import all_patterns
from estimation.diagnosis.posing import moments, pose
from estimation.diagnosis.problem import Problem
from estimation.diagnosis.regularisation import free, held, loosened, pull_of
from estimation.diagnosis.reporting import Told, assemble
from estimation.diagnosis.scan import Entry, measure
from estimation.diagnosis.selection import Selection, select, with_rivals
from estimation.diagnosis.settling import Settled, calmer, moved, settle
from estimation.diagnosis.states import Recording, record
from estimation.diagnosis.upper import WIDER, pose_upper
from estimation.diagnosis.verdict import Judgement, judge
from robots.base_parameters import BaseParameters
from robots.common.errors import InputError, NotIdentifiableError
from robots.common.memory import give_back
from robots.common.parallel import one_blas_thread
from robots.common.progress import SILENT, Progress
from robots.robot import Robot
from robots.signals import Log
from robots.terms.effects import EFFECTS, Effect

Array = NDArray[np.float64]

DRAWS = 200
# The base model alone is fitted again while what is left of a joint's torque falls below this share of what it was.
ROUNDS, SETTLED = 4, 0.9
# Noise is no smaller than this share of the torque there.
QUIETEST = 0.05


@dataclass(frozen=True, eq=False)
class Search:
    """One search through the catalogue with one noise model.

    Attributes:
        posed: what was searched.
        problem: that, its state composed with the effects found.
        entries: the catalogue, measured.
        selection: what was found.
    """

    posed: Problem
    problem: Problem
    entries: list[Entry]
    selection: Selection


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
    executor: Executor | None = None,
) -> Diagnosis:
    """Finds what rigid body, friction, rotors and offsets do not explain in a robot's logs.

    Positions become noise-free motion (harmonics where it repeats, a low-pass chosen by its spectrum elsewhere); the
    torque noise is estimated with its colour; every effect of the catalogue at every joint is scored beside the base
    model, against what noise alone would have made of the strongest; shapes are refined, and rivals tried, before the
    next effect is sought. What no effect explains is told as such.

    Args:
        robot: the robot.
        logs: one or several, of t, q and tau or current; t is one clock. Logs that overlap count one after the other,
            in the order given. A log that says so carries a known payload, or was recorded under another gravity.
        held_out: logs of other motions to measure the gain on; without, runs or stretches are kept apart.
        candidates: effects to look for, by name; all by default.
        friction: of the base model: ``polynomial`` or ``coulomb-viscous``.
        false_alarm: chance of finding an effect in logs that have none.
        check: whether each log passes the gate first, which refuses what would be diagnosed wrongly; rows that stick
            out of their neighbours are filled in, and logs are cut at gaps.
        seed: of the noise that is drawn.
        progress: is told how far it is.
        executor: not needed so far: the work is in threads.

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
        raise InputError(f"a false-alarm probability of {false_alarm}", allowed="between 0 and 0.5")
    effects = _effects(candidates)
    bar = progress or SILENT
    bar.start("diagnosing", 1.0)
    try:
        on_clock = clocked(data, other)
        data, other = sorted(on_clock.logs, key=lambda log: float(log.t[0])), list(on_clock.held_out)
        found: list[str] = []
        if check:
            bar.update(0.0, "checking the logs")
            (data, told_of_logs), (other, told_of_others) = (
                _mended(robot, data, "Log"),
                _mended(robot, other, "Held out"),
            )
            found = [*told_of_logs, *told_of_others]
        recording = lightened(robot, record(robot, data))
        if not (np.ptp(recording.q, axis=0) > 0).any():
            raise NotIdentifiableError("no joint moves", remedy="record a log in which the arm moves")
        # Unseen logs count too: what only they show is told by the description at least.
        gravities = [log.gravity for log in (*data, *other) if log.gravity is not None]
        base = base_parameters(robot, friction, (0.001,) * robot.n, gravities)
        hopeless = hopeless_logs(base, recording)
        notes = tuple(_HOPELESS.format(k + 1, _named(recording.names[k]), 100 * s) for k, s in hopeless.items())
        if hopeless:
            data = [log for k, log in enumerate(data) if k not in hopeless]
            recording = lightened(robot, record(robot, data))
        search = _search(base, recording, effects, false_alarm, seed, bar)
        problem, selection, entries = search.problem, search.selection, search.entries
        bar.update(0.75, "limits of what the logs can show")
        limits = find_limits(problem, entries, false_alarm=false_alarm)
        # The columns of all hypotheses are most of what is kept: those of the patterns take their room.
        del search, entries
        give_back()
        bar.update(0.83, "what is left")
        patterns = measure(problem, all_hypotheses(robot, list(all_patterns(robot))))
        judgement = judge(problem, selection, patterns, false_alarm, np.random.default_rng(seed + 2))
        bar.update(0.93, "gain on unseen data")
        del patterns
        give_back()
        told = Told(
            problem=problem,
            selection=selection,
            judgement=judgement,
            limits=limits,
            excess=residual_shares(problem),
            logs=tuple(data),
            held_out=tuple(other),
            dated=on_clock.dated,
            false_alarm=false_alarm,
            seed=seed,
            notes=(*on_clock.notes, *found, *notes),
        )
        return assemble(robot, told)
    finally:
        bar.finish()


_HOPELESS = (
    "Log {}{} is left out: fitted to it alone, the base model still leaves {:.0f} % of the torque on every joint. It "
    "says nothing of what the arm is like; look at its torque."
)


def _mended(robot: Robot, logs: Sequence[Log], kind: str) -> tuple[list[Log], list[str]]:
    """The stretches of logs that can be used, and what is to be told of them."""
    several = [mended(robot, log, f"{kind} {k}{_named(log.name)}") for k, log in enumerate(logs, start=1)]
    return [part for one in several for part in one.logs], [note for one in several for note in one.notes]


def _named(name: str) -> str:
    return f" ({name})" if name else ""


def _effects(candidates: Sequence[str | Effect] | None) -> list[Effect]:
    if candidates is None:
        return list(EFFECTS.values())
    chosen = []
    for candidate in candidates:
        if isinstance(candidate, str):
            if candidate not in EFFECTS:
                raise InputError(f"unknown effect {candidate!r}", allowed=", ".join(EFFECTS))
            candidate = EFFECTS[candidate]
        chosen.append(candidate)
    if not chosen:
        raise InputError("no effects to look for", allowed="one or more names")
    return chosen


def _search(
    base: BaseParameters,
    recording: Recording,
    effects: Sequence[Effect],
    false_alarm: float,
    seed: int,
    bar: Progress,
) -> Search:
    """Searches the catalogue; once more where what was found had been taken for noise."""
    hypotheses = all_hypotheses(base.model.robot, effects)
    recording = _relied_on(base, recording)
    baseline, settled = _plain(base, recording)
    tau = recording.tau
    search: Search | None = None
    blurred = False
    known: dict[Hypothesis, tuple[float, ...]] = {}
    for attempt in range(2):
        share = 0.1 + 0.3 * attempt
        inertia = inertia_of(baseline, recording, settled.values)
        fitted = baseline.base.size + settled.degrees
        spared = own_functions(recording, baseline, settled.residual)
        whitening = estimate_whitening(recording, settled.residual, fitted, inertia, spared=spared)
        if search is not None:
            members = [found.member for found in search.selection.found]
            if not (calmer(search.problem, whitening) or moved(search.problem, settled.values, members)):
                break
            # Its columns are most of what a diagnosis keeps in memory: they go before others come.
            search = None
            give_back()
            if blurred:
                baseline = build_baseline(base, replace(recording, tau=settled.without_effects(tau)))
        upper = None
        if any(effect.fast for effect in effects):
            wide = estimate_whitening(recording, settled.residual, fitted, inertia, WIDER, spared)
            remainder = tau - baseline.regressor @ settled.values
            upper = pose_upper(recording, baseline, remainder, settled.residual, whitening.bands, wide)
        rng = np.random.default_rng(seed)
        search = _searched(
            pose(
                recording,
                baseline,
                whitening,
                draws=DRAWS,
                rng=rng,
                extra=settled.extra,
                upper=upper,
                followed=settled.followed,
            ),
            hypotheses,
            false_alarm,
            rng,
            bar,
            share,
            known,
        )
        known = {found.member.hypothesis: found.member.shape for found in search.selection.found}
        if not search.selection.found:
            break
        settled = settle(search.problem, [found.member for found in search.selection.found])
        # A delay made the sign of friction look less sharp than it is.
        blurred = any(found.member.hypothesis.effect.blurs for found in search.selection.found)
    assert search is not None
    told = with_rivals(search.posed, search.entries, search.selection, np.random.default_rng(seed))
    return replace(search, selection=told)


def _relied_on(base: BaseParameters, recording: Recording) -> Recording:
    """Lets rows at reversals count where neither direction nor acceleration is in doubt: a model tells the second."""
    if not recording.clear.any():
        return recording
    baseline, settled = _plain(base, recording)
    inertia = inertia_of(baseline, recording, settled.values)
    return recording.trusting(quiet_joints(recording, settled.residual, inertia))


def _plain(base: BaseParameters, recording: Recording) -> tuple[Baseline, Settled]:
    """Fits the base model alone.

    Rows count by what the fit before leaves of them: against noise as large as the torque, a description that lacks a
    rotor or a tool would hold the fit, and what it then leaves pass for noise. But what is left is not all noise, and
    joints that the base model describes well must not bend what it says of the others.
    """
    baseline, tau = build_baseline(base, recording), recording.tau
    counts, size = ~recording.unsure, tau.std(axis=0) + 1e-12
    pull, (grams, crosses) = pull_of(baseline, recording), moments(baseline, counts.astype(float), tau)
    scale = size
    for _ in range(ROUNDS):
        gram, cross = np.tensordot(scale**-2.0, grams, 1), scale**-2.0 @ crosses
        values = held(gram, cross, loosened(pull, gram, cross))[: baseline.base.size]
        left = tau - baseline.regressor @ values
        noise = np.sqrt((left**2 * counts).sum(axis=0) / np.maximum(counts.sum(axis=0), 1))
        before, scale = scale, np.clip(noise, QUIETEST * size, scale)
        if (scale > SETTLED * before).all():
            break
    if not is_short(recording):
        # Effects are measured beside a base model that nothing holds: so is the noise.
        left = tau - np.concatenate([baseline.regressor, baseline.nuisance], axis=2) @ free(gram, cross)
    return baseline, Settled(left, values)


def _searched(
    problem: Problem,
    hypotheses: Sequence[Hypothesis],
    false_alarm: float,
    rng: np.random.Generator,
    bar: Progress,
    share: float,
    known: Mapping[Hypothesis, tuple[float, ...]],
) -> Search:
    entries = measure(problem, hypotheses, _teller(bar, share, 0.2))
    give_back()
    advance = _noter(bar, share + 0.25)
    selection = select(problem, entries, false_alarm=false_alarm, rng=rng, advance=advance, known=known)
    members = [found.member for found in selection.found]
    return Search(problem, composed(problem, members, hypotheses), entries, selection)


def _teller(bar: Progress, start: float, share: float) -> Callable[[float], None]:
    return lambda done: bar.update(start + share * done, "scan")


def _noter(bar: Progress, at: float) -> Callable[[str], None]:
    return lambda note: bar.update(at, note)


__all__ = ["Judgement", "Search", "diagnose"]
