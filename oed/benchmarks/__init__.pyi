"""The hidden-effect benchmark: blind cases, answers of any tool, and their scores."""

from oed.benchmarks.answers import Answers as Answers
from oed.benchmarks.answers import read_answers as read_answers
from oed.benchmarks.answers import write_answers as write_answers
from oed.benchmarks.folders import Benchmark as Benchmark
from oed.benchmarks.folders import read_benchmark as read_benchmark
from oed.benchmarks.making import MakeOptions as MakeOptions
from oed.benchmarks.making import make_benchmark as make_benchmark
from oed.benchmarks.scores import Scores as Scores
from oed.benchmarks.scores import score_benchmark as score_benchmark
from oed.benchmarks.solving import answer_benchmark as answer_benchmark
