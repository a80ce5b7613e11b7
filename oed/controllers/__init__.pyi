"""Ways to a controller: play a trajectory, record the feedback, and a controller to test against."""

from oed.controllers.clients.playing import stream as stream
from oed.controllers.clients.result import StreamResult as StreamResult
from oed.controllers.drivers import Driver as Driver
from oed.controllers.drivers import driver_of as driver_of
from oed.controllers.errors import ControllerError as ControllerError
from oed.controllers.errors import LinkError as LinkError
from oed.controllers.options import Endpoint as Endpoint
from oed.controllers.options import StreamOptions as StreamOptions
from oed.controllers.recording.pose import read_pose as read_pose
from oed.controllers.recording.recording import Recording as Recording
from oed.controllers.recording.recording import record as record
from oed.controllers.virtual import VirtualController as VirtualController
from oed.controllers.virtual import virtual_controller as virtual_controller
from oed.controllers.virtual_options import ControllerOptions as ControllerOptions
from oed.controllers.virtual_options import Faults as Faults
