"""One case judged: what was hidden against what a tool says."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oed.benchmarks.answers.answer import CaseAnswer, NamedEffect
from oed.benchmarks.sealing import HiddenEffect, Truth
from oed.benchmarks.taxonomy import UNKNOWN, class_of, known_parameters


@dataclass(frozen=True, kw_only=True)
class Judgement:
    """A case with its truth and its answer.

    Attributes:
        name: of the case.
        truth: what it hides.
        answer: what the tool says; None where it says nothing, which counts as wrong.
    """

    name: str
    truth: Truth
    answer: CaseAnswer | None

    @property
    def detected(self) -> bool:
        """Whether the tool says that something is hidden."""
        return self.answer is not None and self.answer.verdict != "nothing"

    @property
    def false_alarm(self) -> bool:
        """Whether a case without an effect is not answered with ``nothing``."""
        return self.answer is None or self.answer.verdict != "nothing"

    @property
    def unexplained(self) -> bool:
        """Whether the verdict is ``unexplained``."""
        return self.answer is not None and self.answer.verdict == "unexplained"

    @property
    def named(self) -> tuple[NamedEffect, ...]:
        """The effects that the tool claims, strongest first."""
        return () if self.answer is None else self.answer.effects

    def first_has(self, level: str) -> bool:
        """Returns whether the effect that is named first is right, in joint, class or name and joint.

        Args:
            level: ``joint``, ``class`` (and joint) or ``name`` (and joint).
        """
        return bool(self.named) and any(agrees(self.named[0], hidden, level) for hidden in self.truth.effects)

    def all_found(self, level: str) -> bool:
        """Returns whether each hidden effect is among those that are named. An answer counts for one effect only."""
        left = list(self.named)
        for hidden in self.truth.effects:
            match = next((named for named in left if agrees(named, hidden, level)), None)
            if match is None:
                return False
            left.remove(match)
        return True

    def any_found(self, level: str) -> bool:
        """Returns whether at least one hidden effect is among those that are named."""
        return any(agrees(named, hidden, level) for named in self.named for hidden in self.truth.effects)

    @property
    def spurious(self) -> bool:
        """Whether an effect is named whose class and joint are not hidden. ``unknown`` claims no class."""
        if self.answer is None:
            return True
        claimed = [named for named in self.named if class_of(named.effect) != UNKNOWN]
        return any(not any(agrees(named, hidden, "class") for hidden in self.truth.effects) for named in claimed)

    def intervals(self) -> list[bool]:
        """Lists for each interval of a parameter of an effect rightly named whether it contains the true value."""
        inside = []
        for hidden in self.truth.effects:
            match = next((named for named in self.named if agrees(named, hidden, "name")), None)
            stated = {} if match is None else match.parameters
            for name, value in known_parameters(hidden.effect, hidden.parameters).items():
                interval = stated[name].interval if name in stated else None
                if interval is not None:
                    inside.append(interval[0] <= value <= interval[1])
        return inside

    def confidences(self) -> list[tuple[float, bool]]:
        """Lists each stated confidence, and whether class and joint are right."""
        return [
            (named.confidence, any(agrees(named, hidden, "class") for hidden in self.truth.effects))
            for named in self.named
            if named.confidence is not None
        ]

    def error(self) -> float | None:
        """Computes the RMS error of the predicted torque over the RMS of the noise, root mean square over joints."""
        if self.answer is None or self.answer.torque is None:
            return None
        t, measured = self.truth.torque[:, 0], self.truth.torque[:, 1:]
        # Time [s] at both ends of an unseen motion whose prediction does not count: filters err there.
        ends = 0.5
        rows = (t >= t[0] + ends) & (t <= t[-1] - ends)
        squares = ((measured - self.answer.torque)[rows] ** 2).mean(axis=0)
        return float(np.sqrt((squares / self.truth.noise**2).mean()))


def agrees(named: NamedEffect, hidden: HiddenEffect, level: str) -> bool:
    """Returns whether an answer agrees with a hidden effect.

    Args:
        named: of an answer.
        hidden: of the truth.
        level: ``joint``, ``class`` (and joint) or ``name`` (and joint).
    """
    if named.joints != (() if hidden.joint is None else (hidden.joint,)):
        return False
    if level == "joint":
        return True
    if level == "class":
        kind = class_of(hidden.effect)
        return kind != UNKNOWN and class_of(named.effect) == kind
    return named.effect == hidden.effect
