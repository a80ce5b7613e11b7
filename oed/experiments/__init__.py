"""Experiments: the design problem, its solver, and the verb that puts them together."""

from oed.experiments.checks import usable_limits
from oed.experiments.designing import design
from oed.experiments.options import LimitOptions, ModelOptions, SearchOptions, TrajectoryOptions, WeightOptions
from oed.experiments.pareto import ParetoFront, pareto
from oed.experiments.quality import Quality
from oed.experiments.results.outcome import Outcome
from oed.experiments.results.result import Design
from oed.experiments.results.retimed import RetimedExperiment, TorqueUse
from oed.experiments.retiming import METHODS, retime
from oed.experiments.searches.search import EFFORTS, Effort
from oed.experiments.solvers import InteriorPoint, Ipopt, Slsqp, Solver

__all__ = [
    "METHODS",
    "EFFORTS",
    "Design",
    "Effort",
    "InteriorPoint",
    "Ipopt",
    "LimitOptions",
    "ModelOptions",
    "Outcome",
    "ParetoFront",
    "Quality",
    "RetimedExperiment",
    "SearchOptions",
    "Slsqp",
    "Solver",
    "TorqueUse",
    "TrajectoryOptions",
    "WeightOptions",
    "design",
    "pareto",
    "retime",
    "usable_limits",
]
