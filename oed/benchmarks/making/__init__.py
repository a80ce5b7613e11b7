"""How a benchmark is made: which cases it has, their logs, and the sealed truth."""

from oed.benchmarks.making.making import MakeOptions, make_benchmark

__all__ = ["MakeOptions", "make_benchmark"]
