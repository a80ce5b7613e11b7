"""Robots: description, dynamics, limits, signals and the virtual robot."""

from robots.base_parameters import BaseParameters as BaseParameters
from robots.base_parameters import find_base_parameters as find_base_parameters
from robots.common.errors import AssumedValueWarning as AssumedValueWarning
from robots.common.errors import InfeasibleError as InfeasibleError
from robots.common.errors import InputError as InputError
from robots.common.errors import NotIdentifiableError as NotIdentifiableError
from robots.common.errors import OedError as OedError
from robots.common.errors import SolverError as SolverError
from robots.limits import Limits as Limits
from robots.loading import load_robot as load_robot
from robots.plants import Plant as Plant
from robots.plants import Sensors as Sensors
from robots.plants import nominal_plant as nominal_plant
from robots.plants import simulate as simulate
from robots.regressor import TorqueModel as TorqueModel
from robots.regressor import default_model as default_model
from robots.robot import Robot as Robot
from robots.signals import Log as Log
from robots.signals import Motion as Motion
from robots.version import __version__ as __version__
