"""Local solvers of design problems, one a file."""

from oed.experiments.solvers.base import Solved, Solver, Stage
from oed.experiments.solvers.interior_point import InteriorPoint
from oed.experiments.solvers.ipopt_ import Ipopt
from oed.experiments.solvers.slsqp import Slsqp

__all__ = ["InteriorPoint", "Ipopt", "Slsqp", "Solved", "Solver", "Stage"]
