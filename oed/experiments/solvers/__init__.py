"""Local solvers of design problems, one a file."""

from oed.experiments.solvers.base import Solved, Solver, Stage
from oed.experiments.solvers.interior_point import InteriorPoint
from oed.experiments.solvers.ipopt_ import Ipopt

__all__ = ["InteriorPoint", "Ipopt", "Solved", "Solver", "Stage"]
