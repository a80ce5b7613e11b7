"""Design, play, identify, diagnose, and the next experiment, until nothing is ambiguous."""

from oed.campaigns.loops.options import LoopOptions
from oed.campaigns.loops.result import LoopResult
from oed.campaigns.loops.running import run_loop

__all__ = ["LoopOptions", "LoopResult", "run_loop"]
