"""New timings: moves between poses, and given paths as fast as the limits allow."""

from oed.retiming.limits import finite_limits, limit_usage
from oed.retiming.moves import PlannedMove, plan_move
from oed.retiming.result import Retimed
from oed.retiming.ruckig_ import retime_with_stops
from oed.retiming.toppra_ import Toppra, retime

__all__ = [
    "PlannedMove",
    "Retimed",
    "Toppra",
    "finite_limits",
    "limit_usage",
    "plan_move",
    "retime",
    "retime_with_stops",
]
