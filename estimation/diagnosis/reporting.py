"""From numbers to a diagnosis: the extended model, its gain on unseen data, findings in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.diagnosis import Diagnosis, Trace
from estimation.diagnosis.extending import Fitted, dense, fit_extended
from estimation.diagnosis.findings import Finding, Gain, Parameter
from estimation.diagnosis.gain import Unseen, cross_validated, on_held_out
from estimation.diagnosis.limits import Limit
from estimation.diagnosis.next_experiment import NextExperiment, plan_next
from estimation.diagnosis.patterns import Pattern
from estimation.diagnosis.problem import Problem
from estimation.diagnosis.refinement import Member
from estimation.diagnosis.selection import Found, Selection
from estimation.diagnosis.states import Recording, record
from estimation.diagnosis.verdict import CLOSE, Judgement, is_open
from robots.common.files import sha256
from robots.robot import Robot
from robots.signals import Log
from robots.terms.base import force_unit, length_unit
from robots.terms.effects.situation import Situation, situation
from robots.version import VERSION

Array = NDArray[np.float64]

SHOWN = 4000  # rows of the curves kept for pictures
SHORTEST_UNSEEN = 1.0  # [s] of held-out logs


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


def assemble(robot: Robot, told: Told) -> Diagnosis:
    """Fits the extended model, measures it on unseen data, and puts the findings into words."""
    problem, judgement = told.problem, told.judgement
    unexplained = judgement.verdict == "unexplained"
    founds = [] if unexplained else list(told.selection.found)
    members = list(judgement.patterns) if unexplained else [found.member for found in founds]
    p_values = list(judgement.p_values) if unexplained else [found.p_value for found in founds]
    unseen, gains, seen_as = _measured(robot, told, members)
    dropped = []
    while harmful := [i for i, gain in enumerate(gains) if gain.ci95[1] < 0]:
        # What makes unseen errors surely larger is no cause, however well it fits: a few rows at the end of a log.
        worst = min(harmful, key=lambda i: gains[i].ci95[1])
        dropped.append(members.pop(worst).hypothesis.label)
        p_values.pop(worst)
        if not unexplained:
            founds.pop(worst)
        unseen, gains, seen_as = _measured(robot, told, members)
    verdict = judgement.verdict
    if dropped and not (unexplained and members):
        verdict = "none" if not members else "ambiguous" if any(map(is_open, founds)) else "named"
    fitted = fit_extended(problem, members, _provenance(told))
    findings = tuple(
        _finding(
            robot,
            problem,
            member,
            fitted,
            i,
            p_values[i],
            None if unexplained else founds[i],
            gains[i],
        )
        for i, member in enumerate(members)
    )
    before = unseen.nrmse(0)
    after = unseen.nrmse(len(unseen.errors) - 1)
    return Diagnosis(
        verdict=verdict,
        findings=findings,
        baseline=before,
        extended=after,
        explained=judgement.explained,
        excess=told.excess,
        limits=told.limits,
        next_experiment=_next(problem, founds) if verdict == "ambiguous" else None,
        model=fitted.model,
        how_unseen=unseen.how,
        notes=(*_notes(told, findings, before, after), *(_DROPPED.format(name) for name in dropped)),
        trace=_trace(members, unseen, seen_as),
    )


_DROPPED = "A fit of {} stood out of the noise, but makes the error on unseen data larger: left out."


def _measured(robot: Robot, told: Told, members: Sequence[Member]) -> tuple[Unseen, list[Gain], tuple[Array, ...]]:
    """Errors on unseen data, what each member brings there, and the coordinate on which it shows there (M,)."""
    effects = [dense(told.problem, member.hypothesis, member.shape) for member in members]
    unseen, coordinates = _unseen(robot, told, members, effects)
    rng = np.random.default_rng(told.seed + 3)
    return unseen, [_gain(unseen, i, member, rng) for i, member in enumerate(members)], coordinates


def _gain(unseen: Unseen, i: int, member: Member, rng: np.random.Generator) -> Gain:
    """The fall of the error by one member, on its joint, or over all it acts on."""
    own = member.hypothesis.joint
    joints = [own - 1] if own is not None else list(member.group.joints)
    last = len(unseen.errors) - 1
    low, high = unseen.interval(i + 1, last, joints, rng)
    return Gain(
        nrmse_before=float(unseen.nrmse(i + 1)[joints].mean()),
        nrmse_after=float(unseen.nrmse(last)[joints].mean()),
        ci95=(low, high),
    )


def _finding(
    robot: Robot,
    problem: Problem,
    member: Member,
    fitted: Fitted,
    i: int,
    p_value: float,
    found: Found | None,
    gain: Gain,
) -> Finding:
    extension, known = fitted.model.extensions[i], fitted.effects[i]
    hypothesis = member.hypothesis
    joint = hypothesis.joint
    units = {}
    if joint is not None:
        units = {"force": force_unit(robot, joint - 1), "length": length_unit(robot, joint - 1)}
    sentence = hypothesis.effect.describe(joint, extension.coefficients, extension.shape, **units)
    pattern = hypothesis.name if isinstance(hypothesis.effect, Pattern) else ""
    rivals = [] if found is None else [(rival.hypothesis, worse) for rival, worse in found.rivals]
    return Finding(
        effect="unexplained" if pattern else hypothesis.name,
        joint=joint,
        parameters=_parameters(robot, member, fitted, i, known),
        p_value=p_value,
        delta_bic=member.bic(problem.rows),
        gain=gain,
        rivals=tuple(
            (h.name if h.joint in (joint, None) else f"{h.name} of joint {h.joint}", float(worse))
            for h, worse in rivals
        ),
        sentence=sentence,
        visible=member.visible,
        coordinate=hypothesis.effect.coordinate(problem.situation, joint, member.shape)[0],
        pattern=pattern,
    )


def _parameters(
    robot: Robot, member: Member, fitted: Fitted, i: int, known: NDArray[np.bool_]
) -> tuple[Parameter, ...]:
    extension = fitted.model.extensions[i]
    effect = member.hypothesis.effect
    described = [(c.name, c.unit, "linear") for c in effect.parameters(robot, extension.joint)]
    described += [(s.name, s.unit, s.scale) for s in effect.shapes]
    values = [*extension.coefficients.tolist(), *extension.shape]
    errors = np.sqrt(np.maximum(np.diag(extension.covariance), 0.0))
    result = []
    for (name, unit, scale), value, error, sure in zip(described, values, errors, known, strict=True):
        interval = (value - 1.96 * error, value + 1.96 * error)
        if scale == "log" and np.isfinite(error) and value > 0:
            factor = float(np.exp(1.96 * error / value))
            interval = (value / factor, value * factor)
        result.append(
            Parameter(
                name=name,
                value=float(value),
                unit=unit,
                standard_error=float(error) if np.isfinite(error) else float("nan"),
                ci95=(float(interval[0]), float(interval[1])) if np.isfinite(error) else (-np.inf, np.inf),
                determined=bool(sure),
            )
        )
    return tuple(result)


def _unseen(
    robot: Robot, told: Told, members: Sequence[Member], effects: Sequence[Array]
) -> tuple[Unseen, tuple[Array, ...]]:
    problem = told.problem
    if not told.held_out:
        return cross_validated(problem, effects), _coordinates(problem.situation, members)
    recording = problem.recording
    other = record(robot, told.held_out, step=recording.step, shortest=SHORTEST_UNSEEN)
    # One clock: where the unseen logs come later, the heat of the ones before is still there.
    later = bool(other.t[0] > recording.t[-1])
    whole = _joined(recording, other) if later else other
    now = situation(
        problem.situation.model,
        problem.situation.parameters,
        whole.t,
        whole.q,
        whole.dq,
        whole.ddq,
        starts=whole.starts,
    )
    there = slice(len(recording), None) if later else slice(None)
    columns = []
    for member in members:
        X = np.zeros((len(whole), robot.n, len(member.coefficients)))
        joints, parts = member.hypothesis.columns(now, member.shape)
        for j, part in zip(joints, parts, strict=True):
            X[:, j] = part
        columns.append(X[there])
    baseline = problem.baseline
    base = baseline.base.regressor(other.q, other.dq, other.ddq)
    nuisance = np.zeros((len(other), robot.n, baseline.nuisance.shape[2]))
    unseen = on_held_out(problem, effects, other, np.concatenate([base, nuisance], axis=2), columns)
    return unseen, tuple(values[there] for values in _coordinates(now, members))


def _coordinates(now: Situation, members: Sequence[Member]) -> tuple[Array, ...]:
    return tuple(m.hypothesis.effect.coordinate(now, m.hypothesis.joint, m.shape)[1] for m in members)


def _joined(first: Recording, second: Recording) -> Recording:
    starts = (*first.starts, *(len(first) + start for start in second.starts))

    def both(name: str) -> Array:
        return np.concatenate([getattr(first, name), getattr(second, name)])

    return replace(
        first,
        t=both("t"),
        q=both("q"),
        dq=both("dq"),
        ddq=both("ddq"),
        tau=both("tau"),
        unsure=both("unsure").astype(bool),
        starts=starts,
        cycles=(*first.cycles, *second.cycles),
        names=(*first.names, *second.names),
    )


def _next(problem: Problem, founds: Sequence[Found]) -> NextExperiment | None:
    """Plans the experiment that tells the causes that are left apart."""
    for found in founds:
        close = [rival for rival, worse in found.rivals if worse < CLOSE]
        if close:
            return plan_next(problem, [found.member, *close])
    return None


def _notes(told: Told, findings: Sequence[Finding], before: Array, after: Array) -> tuple[str, ...]:
    recording = told.problem.recording
    notes = []
    still = [j + 1 for j in range(recording.n) if np.ptp(recording.q[:, j]) < 1e-3]
    if still:
        names = ", ".join(map(str, still))
        notes.append(
            f"Joint{'s' if len(still) > 1 else ''} {names} hardly moved: their friction, gears and rotors cannot be "
            "judged; what gravity and the other joints ask of them can."
        )
    for finding in findings:
        lost = [p for p in finding.parameters if not p.determined and p.unit == "s" and np.isnan(p.standard_error)]
        for parameter in lost:
            notes.append(
                f"{parameter.name} of {finding.effect} is not determined by {recording.duration:.0f} s of logs: the "
                f"value {parameter.value:.3g} s is one of many that fit."
            )
        if finding.gain.ci95[0] <= 0:
            notes.append(f"The gain of {finding.effect} on unseen data is not sure: its interval holds zero.")
    if told.judgement.verdict == "unexplained":
        notes.append(
            "No effect of the catalogue explains what stands out of the noise "
            f"(the best together {100 * told.judgement.explained:.0f} %): a free function of the inputs named above "
            "was fitted instead. It predicts where the robot has been, and says nothing elsewhere."
        )
    return tuple(notes)


def _trace(members: Sequence[Member], unseen: Unseen, seen_as: Sequence[Array]) -> Trace:
    rows = slice(None, None, max(1, len(unseen.t) // SHOWN))
    hidden = ~unseen.counts
    before, after = (np.where(hidden, np.nan, unseen.errors[k]) for k in (0, -1))
    coordinates = tuple(values[rows] for values in seen_as)
    return Trace(unseen.t[rows], unseen.measured[rows], before[rows], after[rows], coordinates)


def _provenance(told: Told) -> dict[str, object]:
    problem = told.problem
    described = []
    for log in told.logs:
        file = log.metadata.get("file")
        described.append(
            {
                "name": log.name,
                "sha256": sha256(file) if file else None,
                "samples": len(log),
                "duration": log.duration,
            }
        )
    torque = np.sqrt(np.mean(problem.recording.tau**2, axis=0))
    return {
        "logs": described,
        "method": "diagnosis",
        "tool_version": VERSION,
        "cutoff_hz": float(max(problem.recording.cutoff, problem.whitening.band.cutoff)),
        "velocity_scales": [float(v) for v in problem.situation.velocity_scale],
        "seed": told.seed,
        "false_alarm": told.false_alarm,
        "residual_rms": np.sqrt(np.mean(problem.remainder**2, axis=0)).tolist(),
        "torque_rms": torque.tolist(),
    }
