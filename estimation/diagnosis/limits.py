"""What a log could have shown: for each effect and joint the smallest size that it would, and could have named."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_toeplitz

from estimation.diagnosis.band import Band
from estimation.diagnosis.baseline import build_baseline
from estimation.diagnosis.gaps import Gaps
from estimation.diagnosis.hypotheses import Hypothesis, all_hypotheses
from estimation.diagnosis.posing import pose
from estimation.diagnosis.power import beside, detectable_energy, resolving_energy, size_per_energy, unit_mixtures
from estimation.diagnosis.problem import Group, Problem
from estimation.diagnosis.scan import Entry, measure
from estimation.diagnosis.scoring import visible_root
from estimation.diagnosis.states import Recording
from estimation.diagnosis.whitening import Whitening
from estimation.pulls import Pull
from robots.base_parameters import find_base_parameters
from robots.common.errors import InputError
from robots.plants.sensors import Sensors
from robots.regressor import TorqueModel
from robots.signals import Motion
from robots.terms.effects import EFFECTS

Array = NDArray[np.float64]

HIDDEN = "the base model absorbs it: no size shows in this motion"
UNSURE = "nearly all of it is at rest or beside reversals, where friction may have either sign: no size shows"
FEW = "of {} kinds of it that were tried only {} show, from {:.2g} % of the torque on"
SHAPES = 3
"""Shapes of an effect that its limit is the median of."""
RIVAL_SHAPES = 4
"""Shapes with which a rival may imitate it."""
ORDER = 12
"""Of the prediction filter of noise that is a sum of white and first-order noise, which has no finite one."""


@dataclass(frozen=True, kw_only=True)
class Limit:
    """What one log can tell of one effect at one joint.

    Attributes:
        effect: its name.
        joint: counted from 1; None for the whole robot.
        detectable: smallest size that is found with 95 % chance, as a share of the joint's torque RMS (of a robot's
            effect: of the joint where it shows most); infinite where no size shows.
        attributable: smallest that is also told from every rival; infinite where none is.
        toughest: the rival that is hardest to tell from it; None without.
        visible: share of its energy that the base model does not absorb.
        note: why no size shows, or empty.
    """

    effect: str
    joint: int | None
    detectable: float
    attributable: float
    toughest: str | None
    visible: float
    note: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Writes it as plain data; what is infinite is None."""
        return {
            "effect": self.effect,
            "joint": self.joint,
            "detectable": _finite(self.detectable),
            "attributable": _finite(self.attributable),
            "toughest_rival": self.toughest,
            "visible": self.visible,
            "note": self.note,
        }


def find_limits(problem: Problem, entries: Sequence[Entry], *, false_alarm: float = 0.01) -> tuple[Limit, ...]:
    """Finds the limits of a log, by the noise it has and the base model it is fitted with.

    Args:
        problem: the data, white; nothing of its residual is used.
        entries: all hypotheses, measured.
        false_alarm: chance that noise alone has an effect named.

    Returns:
        One per hypothesis, in the catalogue's order.
    """
    tries = sum(entry.tries for entry in entries)
    known = {(entry.hypothesis.name, entry.hypothesis.joint): entry for entry in entries}
    limits = []
    for hypothesis in all_hypotheses(problem.situation.robot, list(EFFECTS.values())):
        entry = known.get((hypothesis.name, hypothesis.joint))
        if entry is None:
            note = "joint hardly moves" if hypothesis.joint else "nothing of it shows in this motion"
            limits.append(_none(hypothesis, note))
        else:
            limits.append(_limit(problem, entry, known, tries, false_alarm))
    return tuple(limits)


def planned_limits(
    model: TorqueModel, parameters: Array, motions: Sequence[Motion], *, noise: Sensors | None = None
) -> tuple[Limit, ...]:
    """Finds the limits of an experiment that has not been made.

    Args:
        model: the torque model.
        parameters: its standard parameters (p,).
        motions: the planned motions, one after the other on one clock.
        noise: the torque noise expected.

    Raises:
        InputError: parameters that are not known.
    """
    problem = planned_problem(model, parameters, motions, noise=noise or Sensors())
    return find_limits(problem, measure(problem, all_hypotheses(model.robot, list(EFFECTS.values()))))


def planned_problem(
    model: TorqueModel,
    parameters: Array,
    motions: Sequence[Motion],
    *,
    noise: Sensors,
    level: Array | None = None,
) -> Problem:
    """Poses the diagnosis of an experiment that has not been made: its torque is the model's.

    `level` (n,) [N m or N] is the noise's standard deviation where it is known, else the share that `noise` says.
    """
    if not np.isfinite(parameters).all():
        missing = model.columns[int(np.argmin(np.isfinite(parameters)))]
        raise InputError(
            f"{model.robot.name}: {missing.name} is not known",
            joint=missing.joint,
            remedy="identify the robot first, and give its model.json",
        )
    joined = Motion.concatenate(motions)
    starts = tuple(int(s) for s in np.cumsum([0, *(len(motion) for motion in motions[:-1])]))
    step = float(np.median(np.diff(joined.t)))
    recording = Recording(
        t=joined.t,
        starts=starts,
        q=joined.q,
        dq=joined.dq,
        ddq=joined.ddq,
        tau=model.torque(joined.q, joined.dq, joined.ddq, parameters),
        step=step,
        cycles=(None,) * len(motions),
        cutoff=0.5 / step,
        unsure=np.zeros(joined.q.shape, dtype=bool),
        clear=np.zeros(joined.q.shape, dtype=bool),
        jolts=np.zeros(joined.q.shape[1]),
        floor=np.zeros(joined.q.shape[1]),
        names=tuple(f"motion {i}" for i in range(1, len(motions) + 1)),
    )
    whitening = expected_whitening(recording, noise, level)
    baseline = build_baseline(find_base_parameters(model), recording, whitening.scale)
    # The parameters are known: the motion's own torque gives them back, and nothing is to hold them elsewhere.
    size = baseline.base.size + baseline.nuisance.shape[2]
    free = Pull(np.zeros((size, size)), np.zeros(size))
    return pose(recording, baseline, whitening, draws=0, rng=np.random.default_rng(0), pull=free)


def expected_whitening(recording: Recording, noise: Sensors, level: Array | None = None) -> Whitening:
    """Whitens the noise that sensors are expected to have: white and first-order coloured, a share of the torque.

    `level` (n,) [N m or N] is its standard deviation where that is known.
    """
    size = noise.torque_noise * np.sqrt(np.mean(recording.tau**2, axis=0)) if level is None else level
    size = np.maximum(size, 1e-3 * max(float(size.max()), 1e-9))
    rho = float(np.exp(-recording.step / noise.correlation_time)) if noise.correlation_time else 0.0
    lags = noise.coloured_share * rho ** np.arange(ORDER + 1)
    lags[0] = 1.0
    taps = solve_toeplitz(lags[:-1], lags[1:])
    innovation = float(np.sqrt(lags[0] - taps @ lags[1:]))
    n = recording.n
    return Whitening(
        coefficients=(taps,) * n,
        scale=size * innovation,
        precision=np.eye(n),
        starts=recording.starts,
        gaps=no_gaps(n),
        bands=(Band(np.zeros(0), 1, 0.5 / recording.step),) * recording.n,
        innovations=np.random.default_rng(0).standard_normal((1024, n)),
    )


def no_gaps(joints: int) -> Gaps:
    """Builds the gaps of a motion whose direction is known throughout."""
    none = np.zeros(0, dtype=np.intp)
    return Gaps(((none, none, none, np.zeros(0)),) * joints, ())


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
    free = [k for k, (low, high) in enumerate(bounds) if high > low]
    found: list[float] = []
    for at in picked:
        group, shape, root = entry.groups[at], entry.shapes[at], roots[at]
        assumed = hypothesis.effect.likely(problem.situation, hypothesis.joint, shape, np.abs(mixtures[at][0]))
        fitted = min((sum(known[k] is None for k in free) for known in assumed), default=len(free))
        penalty = (len(root) + fitted) * float(np.log(problem.rows * len(group.joints)))
        needed = detectable_energy(len(root), tries, false_alarm=false_alarm, penalty=penalty)
        found.append(size_per_energy(mixtures[at], group.gram) * np.sqrt(needed))
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
        attributable=max(attributable, detectable),
        toughest=toughest,
        visible=float(np.median(shares)),
        note=_note(problem, hypothesis) if np.isfinite(detectable) else HIDDEN,
    )


def _toughest(
    problem: Problem, group: Group, mixtures: Array, rivals: Sequence[tuple[str, Entry]], smallest: float
) -> tuple[float, str | None]:
    """Gives the size, `smallest` at least, from which an effect is told from all rivals, and the one that asks most."""
    worst: tuple[float, str | None] = (smallest, None)
    for name, rival in rivals:
        per_energy = max(
            size_per_energy(mixtures, beside(group.gram, problem.product(group, other), other.gram, other.raw))
            for other in (rival.groups[k] for k in _spread(len(rival.groups), RIVAL_SHAPES))
        )
        size = per_energy * np.sqrt(resolving_energy())
        if size > worst[0] or worst[1] is None:
            worst = (max(size, smallest), name)
    return worst


def _note(problem: Problem, hypothesis: Hypothesis) -> str:
    """Says what a log that is shorter than an effect's slowest time constant leaves open."""
    duration = float(problem.recording.t[-1] - problem.recording.t[0])
    slow = [shape for shape in hypothesis.effect.shapes if shape.name == "time_constant" and shape.upper > duration]
    if not slow:
        return ""
    return (
        f"in {duration:.0f} s of data, time constants beyond {duration:.0f} s look alike: how fast it goes stays open"
    )


def _rivals(
    problem: Problem, hypothesis: Hypothesis, known: dict[tuple[str, int | None], Entry]
) -> list[tuple[str, Entry]]:
    """Finds the declared rivals on the joints where the effect acts; rare ones only of a rare one."""
    joints: list[int | None] = [None, *(range(1, problem.n + 1) if hypothesis.joint is None else [hypothesis.joint])]
    names = [name for name in hypothesis.effect.rivals if hypothesis.effect.rare or not EFFECTS[name].rare]
    return [(name, known[name, joint]) for name in names for joint in joints if (name, joint) in known]


def _spread(count: int, most: int) -> list[int]:
    """Picks up to `most` of `count` places, evenly, the middle first of all."""
    if count <= most:
        return list(range(count))
    return sorted({round((k + 0.5) * count / most - 0.5) for k in range(most)})


def _none(hypothesis: Hypothesis, note: str) -> Limit:
    return Limit(
        effect=hypothesis.name,
        joint=hypothesis.joint,
        detectable=np.inf,
        attributable=np.inf,
        toughest=None,
        visible=0.0,
        note=note,
    )


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
