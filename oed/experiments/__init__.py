"""Experiments: the design problem, its solver, and the verb that puts them together."""

from oed.experiments.designing import design, usable_limits
from oed.experiments.result import Design, Outcome, Quality
from oed.experiments.retimed import RetimedExperiment, TorqueUse
from oed.experiments.retiming import METHODS, retime
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
    "TorqueUse",
    "design",
    "retime",
    "usable_limits",
]
