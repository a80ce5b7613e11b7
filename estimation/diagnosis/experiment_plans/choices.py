"""Kinds of experiment with their chance to separate causes: repeated, or combined, until it is high enough."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from estimation.diagnosis.experiment_plans.experiment_grams import Grams
from estimation.diagnosis.experiment_plans.experiment_motions import MAKERS, MotionRange, Stage
from robots.common.arrays import Array
from robots.terms.effects import EXPERIMENTS

ENOUGH = 0.99
"""Probability from which the simplest experiment is chosen. Models of causes hold to some per cent, and the probability
includes noise only."""
TIE = 0.01
"""Weight of the mean probability over all pairs of causes, added to the smallest one."""
LIKELY = 0.5
"""Probability below which kinds are combined, and a proposal says first that it will hardly separate the causes."""
WORTH = 0.02
"""Increase of the probability for which one more kind is added."""
TIMES, LONGEST = (2, 4, 8, 16), 300.0
"""Numbers of repetitions tried if once is not enough, and the longest experiment then [s], with pauses. Kinds that are
combined may be as long each."""


def experiment_words(kind: str, times: int) -> str:
    """Describes a kind of experiment, and how often its motions are made."""
    return EXPERIMENTS.get(kind, kind.replace("_", " ")) + (f", repeated {times} times" if times > 1 else "")


@dataclass(frozen=True, kw_only=True)
class Proposal:
    """One kind of experiment and its evaluation.

    Attributes:
        kind: a name of `EXPERIMENTS`.
        resolves: probability that it leaves one cause.
        duration: with pauses [s].
        times: how often each motion is made.
    """

    kind: str
    resolves: float
    duration: float
    times: int = 1

    @property
    def words(self) -> str:
        """What the robot does, and how often."""
        return experiment_words(self.kind, self.times)


@dataclass(frozen=True, eq=False)
class Choice:
    """An experiment with its Gram matrices (b + k, b + k), and the probabilities to separate causes (K, K).

    `more` lists kinds that are combined with `kind`.
    """

    kind: str
    stages: tuple[Stage, ...]
    grams: tuple[Array, ...]
    chances: Array
    times: int = 1
    more: tuple[str, ...] = ()

    @property
    def chance(self) -> float:
        """Probability that it leaves one cause, for the least favourable true cause."""
        return float(self.chances.min())

    @property
    def rank(self) -> tuple[float, int]:
        """Sort key: sufficiently certain kinds first, by their repetitions, then the others by their probability.

        The mean probability decides where two causes are never separable.
        """
        if self.chance >= ENOUGH:
            return -ENOUGH, self.times
        return -(1.0 - TIE) * self.chance - TIE * float(self.chances.mean()), self.times

    @property
    def duration(self) -> float:
        """Duration with pauses [s]."""
        return float(sum(stage.pause + stage.motion.duration for stage in repeat_stages(self.stages, self.times)))

    def proposal(self) -> Proposal:
        """Returns the kind with its evaluation."""
        return Proposal(kind=self.kind, resolves=self.chance, duration=self.duration, times=self.times)


def repeat_stages(stages: Sequence[Stage], times: int) -> tuple[Stage, ...]:
    """Repeats each stage; a manual change before it, such as a payload, is made once.

    Args:
        stages: stages of one repetition.
        times: how often each is made.
    """
    again = [replace(stage, pause=Stage.pause) for stage in stages]
    return tuple(part for stage, other in zip(stages, again, strict=True) for part in (stage, *(other,) * (times - 1)))


def make_choice(grams: Grams, room: MotionRange, joint: int, kind: str, variant: int = 0) -> Choice:
    """Evaluates one kind of experiment, made once.

    Args:
        grams: Gram matrices of the logs and the causes.
        room: range and reference of its motions.
        joint: joint to which it applies, from 0.
        kind: a name of `MAKERS`.
        variant: number of its motion.
    """
    stages = MAKERS[kind](room, joint, variant)
    later = grams.later(stages)
    return Choice(kind, stages, later, grams.chances_of(later))


def with_times(grams: Grams, choice: Choice, times: int) -> Choice:
    """Evaluates an experiment whose motions are made several times."""
    return replace(choice, times=times, chances=grams.chances_of(choice.grams, times))


def combined(grams: Grams, best: Choice, others: Sequence[Choice]) -> Choice:
    """Adds the motions of other kinds, the most useful first, as long as they separate the causes better."""
    left = list(others)
    while left:
        trials = [_both(grams, best, other) for other in left]
        at = min(range(len(left)), key=lambda k: trials[k].rank)
        if trials[at].chance < best.chance + WORTH:
            break
        best = trials[at]
        del left[at]
        if best.chance >= LIKELY:
            break
    return best


def repeated(grams: Grams, choice: Choice) -> Choice:
    """Repeats an experiment's motions until it is certain enough or too long."""
    best = choice
    for times in TIMES:
        more = with_times(grams, choice, times)
        if best.chance >= ENOUGH or more.duration > LONGEST:
            break
        best = more
    return best


def _both(grams: Grams, first: Choice, second: Choice) -> Choice:
    """Evaluates the motions of two experiments together: their information adds up."""
    new = tuple(a * first.times + b * second.times for a, b in zip(first.grams, second.grams, strict=True))
    stages = (*repeat_stages(first.stages, first.times), *repeat_stages(second.stages, second.times))
    return Choice(first.kind, stages, new, grams.chances_of(new), more=(*first.more, second.kind))
