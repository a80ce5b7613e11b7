"""How a benchmark is made: which cases it has, their logs, and the sealed truth."""

from oed.benchmarks.making.making import make_benchmark as make_benchmark
from oed.benchmarks.making.options import MakeOptions as MakeOptions
