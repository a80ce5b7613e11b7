"""Detection limits: for each effect and joint, the smallest size that a log shows and distinguishes from rivals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis, all_hypotheses
from estimation.diagnosis.hypothesis_tests.joint_agreement import per_joint_evidence
from estimation.diagnosis.hypothesis_tests.power import (
    detectable_energy,
    residual_energy,
    resolving_energy,
    size_per_energy,
    unit_mixtures,
)
from estimation.diagnosis.hypothesis_tests.problem import Group, Problem
from estimation.diagnosis.hypothesis_tests.scan import Entry
from estimation.diagnosis.hypothesis_tests.scoring import accept, visible_root
from robots.common.arrays import Array
from robots.common.forks import forked
from robots.common.records import Record, read_null_as
from robots.terms.base import force_unit, length_unit
from robots.terms.effect_bases.capabilities import AtReversals, Persistence
from robots.terms.effects import EFFECTS

HIDDEN = "not detectable at any size: the base model absorbs it in this motion"
UNSURE = "not detectable at any size: it acts only at rest or near reversals, where the friction sign is unknown"
FEW = "only {1} of its {0} tested shapes are detectable, from {2:.2g} % of the torque"
RESTING = 0.02
"""Share of rest in a log from which a note mentions it."""
RESTS = "not detectable while the arm is at rest ({:.0f} % of the log), because static friction is unknown"
STILL = 1e-3
"""Travel of a joint [rad or m] below which it hardly moves."""
MOST = 0.9
"""Share of effects and joints for which a summary states the limit."""
NAMED = 4
"""Number of undetectable effects that a summary names."""
SHAPES = 3
"""Number of shapes of an effect over which its limit is the median."""
RIVAL_SHAPES = 4
"""Number of shapes of a rival that are compared with it."""
CHUNK = 8
"""Number of limits that a process computes at once."""


@dataclass(frozen=True, kw_only=True)
class Limit(Record):
    """Detection limit of one effect at one joint.

    Sizes are shares of the joint's torque RMS. For an effect of the whole robot it is the joint where the effect is
    largest.

    Attributes:
        effect: its name.
        joint: counted from 1; None for the whole robot.
        detectable: smallest size that is found with a probability of 95 %, for a typical shape; infinite if no size is.
        at_worst: the same for the scanned shape that shows least; infinite if one shape is never detectable.
        attributable: smallest size that is also distinguished from each rival; infinite if no size is.
        toughest: the rival that is hardest to distinguish; None without rivals.
        visible: share of its energy that the base model does not absorb.
        note: why no size is detectable, or what remains undetermined; empty without a note.
    """

    ENTRIES = (
        "effect",
        "joint",
        "detectable",
        "at_worst",
        "attributable",
        "toughest_rival=toughest",
        "visible",
        "note",
    )

    effect: str
    joint: int | None
    detectable: float = field(metadata=read_null_as(np.inf))
    # Older files lack this entry.
    at_worst: float = field(default=np.inf, metadata=read_null_as(np.inf))
    attributable: float = field(metadata=read_null_as(np.inf))
    toughest: str | None
    visible: float
    note: str = ""


def find_limits(problem: Problem, entries: Sequence[Entry], *, false_alarm: float = 0.01) -> tuple[Limit, ...]:
    """Computes the detection limits of a log from its noise and base model; the residual is not used.

    Args:
        problem: data and base model.
        entries: all hypotheses, evaluated by `measure`.
        false_alarm: probability that noise alone gives a finding.

    Returns:
        One limit per hypothesis, in the order of the catalogue.
    """
    tries = sum(entry.tries for entry in entries)
    known = {(entry.hypothesis.name, entry.hypothesis.joint): entry for entry in entries}

    def limit(hypothesis: Hypothesis) -> Limit:
        entry = known.get((hypothesis.name, hypothesis.joint))
        if entry is None:
            return _none(hypothesis, _why_nothing(problem, hypothesis))
        return _limit(problem, entry, known, tries, false_alarm)

    return tuple(forked(limit, all_hypotheses(problem.situation.robot, list(EFFECTS.values())), chunk=CHUNK))


def summarise_limits(limits: Sequence[Limit]) -> str:
    """Summarises detection limits in one sentence without a full stop; empty if nothing is detectable."""
    sizes = [limit.detectable for limit in limits if np.isfinite(limit.detectable)]
    if not sizes:
        return ""
    half, most = (f"{100 * float(size):.1f} %" for size in np.quantile(sizes, (0.5, MOST)))
    hidden = [
        limit.effect + (f" of joint {limit.joint}" if limit.joint else "")
        for limit in limits
        if not np.isfinite(limit.detectable)
    ]
    more = len(hidden) - NAMED
    rest = f"; at any size hidden: {', '.join(hidden if more <= 1 else [*hidden[:NAMED], f'and {more} more'])}"
    rest = rest if hidden else ""
    return (
        f"Of {len(sizes)} effects and places half would have shown from {half} of the joint's torque on, nine in ten "
        f"from {most}{rest}"
    )


def _why_nothing(problem: Problem, hypothesis: Hypothesis) -> str:
    joint = hypothesis.joint
    still = joint is not None and np.ptp(problem.recording.q[:, joint - 1]) < STILL
    return "joint hardly moves" if still else "not excited by this motion"


def _limit(
    problem: Problem,
    entry: Entry,
    known: dict[tuple[str, int | None], Entry],
    tries: int,
    false_alarm: float,
) -> Limit:
    hypothesis = entry.hypothesis
    roots = [visible_root(group.gram, group.raw) for group in entry.groups]
    mixtures = [unit_mixtures(sizes) for sizes in entry.sizes]
    showing = [at for at, (own, root) in enumerate(zip(mixtures, roots, strict=True)) if len(own) and len(root)]
    if not showing:
        unsure = all(np.isinf(group.raw).all() for group in entry.groups)
        return _none(hypothesis, UNSURE if unsure else HIDDEN)
    picked = [showing[k] for k in _spread(len(showing), SHAPES)]
    bounds = hypothesis.effect.bounds(problem.situation, hypothesis.joint)
    # Optional parameters do not count as fitted near the detection limit.
    free = [k for k, (low, high) in enumerate(bounds) if high > low and not hypothesis.effect.shapes[k].beside]

    def size(at: int) -> float:
        assumed = hypothesis.effect.likely(
            problem.situation, hypothesis.joint, entry.shapes[at], np.abs(mixtures[at][0])
        )
        fitted = min((sum(known[k] is None for k in free) for known in assumed), default=len(free))
        penalty = (len(roots[at]) + fitted) * float(np.log(problem.rows * len(entry.groups[at].joints)))
        needed = detectable_energy(len(roots[at]), tries, false_alarm=false_alarm, penalty=penalty)
        sure = (
            _certain_share(problem, hypothesis, entry.shapes[at])
            if hypothesis.effect.at_reversals is AtReversals.LATE
            else 1.0
        )
        return float(size_per_energy(mixtures[at], entry.groups[at].gram) * np.sqrt(needed / sure))

    sizes = {at: size(at) for at in showing}
    found = [sizes[at] for at in picked]
    detectable = float(np.median(found))
    if 2 * len(showing) < len(entry.groups):
        return _none(hypothesis, FEW.format(len(entry.groups), len(showing), 100 * detectable))
    rivals = _rivals(problem, hypothesis, known)
    named = [
        _toughest(problem, entry.groups[at], mixtures[at], rivals, size) for at, size in zip(picked, found, strict=True)
    ]
    attributable, toughest = sorted(named, key=lambda one: one[0])[len(named) // 2]
    shares = [float(np.max(np.diag(g.gram) / np.maximum(g.raw, 1e-300))) for g in (entry.groups[at] for at in picked)]
    return Limit(
        effect=hypothesis.name,
        joint=hypothesis.joint,
        detectable=detectable,
        at_worst=max(sizes.values()) if len(showing) == len(entry.groups) else np.inf,
        attributable=max(attributable, detectable),
        toughest=toughest,
        visible=float(np.median(shares)),
        note=_note(problem, hypothesis) if np.isfinite(detectable) else HIDDEN,
    )


def _certain_share(problem: Problem, hypothesis: Hypothesis, shape: tuple[float, ...]) -> float:
    """Returns the share of a delay's energy that remains with errors of the reversal times."""
    evidence = per_joint_evidence(problem, hypothesis, shape, accept(problem, ()))
    return float(np.sum(evidence.certain_share * evidence.gram) / np.sum(evidence.gram)) if evidence.gram.any() else 1.0


def _toughest(
    problem: Problem, group: Group, mixtures: Array, rivals: Sequence[tuple[str, Entry]], smallest: float
) -> tuple[float, str | None]:
    """Returns the size from which an effect is distinguished from all rivals, and the hardest rival.

    The size is at least `smallest`.
    """
    worst: tuple[float, str | None] = (smallest, None)
    for name, rival in rivals:
        per_energy = max(
            size_per_energy(mixtures, residual_energy(group.gram, problem.product(group, other), other.gram, other.raw))
            for other in (rival.groups[k] for k in _spread(len(rival.groups), RIVAL_SHAPES))
        )
        size = per_energy * np.sqrt(resolving_energy())
        if size > worst[0] or worst[1] is None:
            worst = (max(size, smallest), name)
    return worst


def _note(problem: Problem, hypothesis: Hypothesis) -> str:
    """Describes what a log does not show because it is short or contains rest.

    A rest hides transient effects. A short log does not determine long time constants.
    """
    if hypothesis.effect.persistence is Persistence.TRANSIENT:
        resting = float(np.mean(problem.recording.sign_unknown.all(axis=1)))
        if resting > RESTING:
            return RESTS.format(100 * resting)
    duration = float(problem.recording.t[-1] - problem.recording.t[0])
    slow = [shape for shape in hypothesis.effect.shapes if shape.name == "time_constant" and shape.upper > duration]
    if not slow:
        return ""
    return f"time constants above {duration:.0f} s, the length of the data, cannot be distinguished"


def _rivals(
    problem: Problem, hypothesis: Hypothesis, known: dict[tuple[str, int | None], Entry]
) -> list[tuple[str, Entry]]:
    """Lists the declared rivals on the joints where the effect acts; rare rivals only of rare effects."""
    joints: list[int | None] = [None, *(range(1, problem.n + 1) if hypothesis.joint is None else [hypothesis.joint])]
    names = [name for name in hypothesis.effect.rivals if hypothesis.effect.rare or not EFFECTS[name].rare]
    return [(name, known[name, joint]) for name in names for joint in joints if (name, joint) in known]


def _spread(count: int, most: int) -> list[int]:
    """Returns up to `most` of `count` indices, evenly spaced."""
    if count <= most:
        return list(range(count))
    return sorted({round((k + 0.5) * count / most - 0.5) for k in range(most)})


def _none(hypothesis: Hypothesis, note: str) -> Limit:
    return Limit(
        effect=hypothesis.name,
        joint=hypothesis.joint,
        detectable=np.inf,
        at_worst=np.inf,
        attributable=np.inf,
        toughest=None,
        visible=0.0,
        note=note,
    )


MOVED = 1e-3  # travel [rad or m] below which a joint has not moved


def undetectable_springs(problem: Problem, false_alarm: float) -> tuple[tuple[int, str], ...]:
    """Describes the joints on which a spring as large as the joint's torque RMS is not detectable.

    A spring's or counterbalance's torque is a smooth function of one position. Gravity, whose moments are free
    parameters, and offset fit such a function; the shorter the range, the better.

    Args:
        problem: data with the base model projected out.
        false_alarm: probability that noise alone gives a finding.

    Returns:
        Joint, counted from 1, and sentence.
    """
    robot, recording = problem.situation.robot, problem.recording
    torque = problem.rms
    needed = detectable_energy(1, robot.n, false_alarm=false_alarm)
    notes = []
    for j in range(robot.n):
        x = recording.q[:, j] - recording.q[:, j].mean()
        if np.ptp(x) < MOVED:
            continue
        group = problem.group((j,), (x[:, None],))
        energy = max(float(group.gram[0, 0]), 1e-300)
        stiffness = np.sqrt(needed / energy)
        own = stiffness * float(x.std())
        if own < torque[j]:
            continue
        force, length = force_unit(robot, j), length_unit(robot, j)
        size = f"{stiffness:.2g} {force}/{length} ({own:.2g} {force} RMS)" if energy > 1e-200 else "any size"
        text = (
            f"Joint {j + 1}: a spring or counterbalance of up to {size} cannot be detected. The joint moved only "
            f"{np.ptp(x):.2g} {length}, where gravity and offset of the base model fit a spring too."
        )
        notes.append((j + 1, text))
    return tuple(notes)
