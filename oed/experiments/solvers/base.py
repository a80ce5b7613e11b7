"""What a local solver of design problems is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

from oed.experiments.problems.problem import FourierProblem
from robots.common.arrays import Array

# By how much a row may be passed, as a share of its bound, before it is added; less than that is shrunk away.
PASSED = 1e-3


Tell = Callable[[float, float], bool]
"""Hears the sharpness of a stage and the value of its stand-in; says whether to go on."""


def go_on(sharpness: float, value: float) -> bool:
    """Lets a solver finish."""
    return True


@dataclass(frozen=True, kw_only=True)
class Stage:
    """One smooth stand-in of the criterion to be minimised.

    Attributes:
        sharpness: of the stand-in.
        max_iter: iterations.
        barrier: initial barrier parameter.
    """

    sharpness: float
    max_iter: int
    barrier: float


@dataclass(frozen=True, kw_only=True)
class Solved:
    """What one solution came to.

    Attributes:
        z: a feasible point (n K,).
        iterations: of the solver, all stages together.
        evaluations: of the criterion with its gradient.
        status: the solver's last word.
    """

    z: Array
    iterations: int
    evaluations: int
    status: str


@dataclass(frozen=True, kw_only=True)
class Solver(ABC):
    """Settings that every solver has; each member adds its own.

    Attributes:
        max_iter: iterations per stage of the criterion in the search.
        finish_iter: iterations per stage of the finish.
        tolerance: at which a stage ends.
    """

    name: ClassVar[str]
    # Initial barrier parameters of a first solution, of one from a known design, and of the finish.
    barriers: ClassVar[tuple[float, float, float]]

    max_iter: int = 60
    finish_iter: int = 150
    tolerance: float = 1e-4

    @abstractmethod
    def minimise(
        self,
        problem: FourierProblem,
        start: Array,
        stages: Sequence[Stage],
        *,
        tell: Tell = go_on,
    ) -> Solved:
        """Solves stages one after the other from a feasible start.

        Args:
            problem: the design problem.
            start: z (n K,), within the limits.
            stages: of the criterion, the smoothest first.
            tell: called after each iteration with the stage's sharpness and the value of its stand-in; returning False
                stops the solver, which keeps its last iterate.

        Returns:
            The last stage's solution, within all limits.
        """
