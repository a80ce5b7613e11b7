"""Design, play, identify, diagnose, and the next experiment, until nothing is ambiguous."""

from oed.campaigns.loops.options import LoopOptions as LoopOptions
from oed.campaigns.loops.result import LoopResult as LoopResult
from oed.campaigns.loops.running import run_loop as run_loop
