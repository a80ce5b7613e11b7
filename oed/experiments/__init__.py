"""Experiments: the design problem, its solver, and the verb that puts them together."""

from oed.experiments.designing import design, usable_limits
from oed.experiments.result import Design, Outcome, Quality
from oed.experiments.retimed import METHODS, RetimedExperiment, retime
from oed.experiments.search import EFFORTS, Effort
from oed.experiments.solver import Ipopt

__all__ = [
    "METHODS",
    "EFFORTS",
    "Design",
    "Effort",
    "Ipopt",
    "Outcome",
    "Quality",
    "RetimedExperiment",
    "design",
    "retime",
    "usable_limits",
]
