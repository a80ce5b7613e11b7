"""Selection of the hypotheses of a scan that are refined."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimation.diagnosis.calibration import MIN_CANDIDATE_GAIN
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.scan import Outcome, Scan
from robots.terms.effect_bases.capabilities import Persistence
from robots.terms.effects import Effect

# Hypotheses that are refined at each step.
MAX_CANDIDATES = 7
# Assumed largest ratio of refined gain to grid gain of a transient effect, whose refinement takes longest.
TWICE = 2.0


def screen_candidates(
    problem: Problem, result: Scan, members: Sequence[FittedEffect] = (), least: float = -np.inf
) -> list[Outcome]:
    """Picks the hypotheses that are refined: those with a gain near the best on the grid, and not in the model.

    A transient effect, or one with a change time, must also be able to reach the best BIC gain on the grid.

    Args:
        problem: whitened data.
        result: scan beside the members.
        members: effects in the model; each effect and joint is selected once.
        least: BIC gain that is known to be reached.

    Returns:
        The hypotheses with their best shapes on the grid, the best BIC first.
    """
    taken = {(m.hypothesis.name, m.hypothesis.joint) for m in members}
    able = [o for o in result.outcomes if o.degrees and (o.hypothesis.name, o.hypothesis.joint) not in taken]
    if not able:
        return []

    def worth(outcome: Outcome) -> float:
        return float(outcome.gain - outcome.degrees * np.log(problem.rows))

    def reached(outcome: Outcome, times: float = 1.0) -> float:
        """Returns the BIC gain with free shape parameters counted, at a multiple of the grid gain."""
        effect, joint = outcome.hypothesis.effect, outcome.hypothesis.joint
        free = sum(high > low for low, high in effect.bounds(problem.state_for(effect), joint))
        rows = problem.rows * len(effect.acts_on(problem.situation.robot, joint))
        return float(times * outcome.gain - (outcome.degrees + free) * np.log(rows))

    ranked = sorted(able, key=worth, reverse=True)
    best, top = max(o.gain for o in able), max(*map(reached, ranked[:MAX_CANDIDATES]), least)
    hopeless = {o.hypothesis for o in able if _of_a_moment(o.hypothesis.effect) and reached(o, TWICE) < top}
    return [o for o in ranked if o.gain >= MIN_CANDIDATE_GAIN * best and o.hypothesis not in hopeless][:MAX_CANDIDATES]


def _of_a_moment(effect: Effect) -> bool:
    return effect.persistence is Persistence.TRANSIENT or any(shape.moment for shape in effect.shapes)
