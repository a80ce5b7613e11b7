"""Experiments: the design problem, its solver, and the verb that puts them together."""

from oed.experiments.checks import usable_limits as usable_limits
from oed.experiments.designing import design as design
from oed.experiments.options import LimitOptions as LimitOptions
from oed.experiments.options import ModelOptions as ModelOptions
from oed.experiments.options import SearchOptions as SearchOptions
from oed.experiments.options import TrajectoryOptions as TrajectoryOptions
from oed.experiments.options import WeightOptions as WeightOptions
from oed.experiments.pareto_fronts import ParetoFront as ParetoFront
from oed.experiments.pareto_fronts import pareto as pareto
from oed.experiments.quality import Quality as Quality
from oed.experiments.results.outcome import Outcome as Outcome
from oed.experiments.results.result import Design as Design
from oed.experiments.results.retimed import RetimedExperiment as RetimedExperiment
from oed.experiments.results.retimed import TorqueUse as TorqueUse
from oed.experiments.retiming import METHODS as METHODS
from oed.experiments.retiming import retime as retime
from oed.experiments.searches.search import EFFORTS as EFFORTS
from oed.experiments.searches.search import Effort as Effort
from oed.experiments.solvers import InteriorPoint as InteriorPoint
from oed.experiments.solvers import Ipopt as Ipopt
from oed.experiments.solvers import Slsqp as Slsqp
from oed.experiments.solvers import Solver as Solver
