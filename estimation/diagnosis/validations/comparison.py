"""Which fits better: names, or free functions of the motion in their place or beside them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimation.diagnosis.calibration import CLOSE_RIVAL_BIC
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import RARE, FittedEffect, set_bic_gain
from estimation.diagnosis.hypothesis_tests.scoring import accept, score
from estimation.diagnosis.searches.selection import SelectedEffect

# Named effects that explain less than this share of what stands out of the noise, or of what free functions do in their
# place, do not explain it; nor do those that fit worse than one of those and explain less than the second share of it.
ENOUGH, NEARLY = 0.7, 0.9
# A name of the whole robot is not owed to a joint where a free function there leaves it this share of its gain.
STAYS = 0.75


def is_outperformed(problem: Problem, gain: float, degrees: int, free: Sequence[FittedEffect]) -> bool:
    """Whether one free function explains much more than names do, or clearly more and fits better.

    Several of them may be about other things besides, which the names do not claim.
    """
    if not free:
        return False
    most, own = free[0].excess_chi2, gain - degrees * float(np.log(problem.rows))
    return gain - degrees < ENOUGH * most or (gain - degrees < NEARLY * most and own < set_bic_gain(problem, free[:1]))


def retains_gain(problem: Problem, names: Sequence[FittedEffect], beside: Sequence[FittedEffect]) -> bool:
    """Whether names explain beside other functions most of what they do without them."""
    accepted = accept(problem, tuple(member.group for member in beside))
    return all(score(problem, name.group, accepted).gain > STAYS * name.gain for name in names)


def has_better_bic(
    problem: Problem,
    names: Sequence[FittedEffect],
    others: Sequence[FittedEffect],
    free: Sequence[FittedEffect],
    margin: float = 0.0,
) -> bool:
    """Whether names fit better than free functions in their place, by a margin (Schwarz), all parameters counted."""
    gain = accept(problem, tuple(m.group for m in (*others, *names))).gain
    gain -= accept(problem, tuple(m.group for m in others)).gain
    price = float(np.log(problem.rows))
    return not free or gain - sum(member.degrees for member in names) * price > set_bic_gain(problem, free) + margin


def has_close_rivals(found: SelectedEffect) -> bool:
    """Whether an effect has rivals that fit about as well; one that robots seldom have must do so by the data alone."""
    return any(worse < (RARE if rival.hypothesis.effect.rare else CLOSE_RIVAL_BIC) for rival, worse in found.rivals)
