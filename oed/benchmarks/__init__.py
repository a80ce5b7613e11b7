"""The hidden-effect benchmark: blind cases, answers of any tool, and their scores."""

from robots.common.lazy import lazy_exports, listed

_EXPORTS = {
    "Answers": "oed.benchmarks.answers",
    "Benchmark": "oed.benchmarks.folders",
    "MakeOptions": "oed.benchmarks.making",
    "Scores": "oed.benchmarks.scores",
    "answer_benchmark": "oed.benchmarks.solving",
    "make_benchmark": "oed.benchmarks.making",
    "read_answers": "oed.benchmarks.answers",
    "read_benchmark": "oed.benchmarks.folders",
    "score_benchmark": "oed.benchmarks.scores",
    "write_answers": "oed.benchmarks.answers",
}
__all__ = list(_EXPORTS)
__getattr__ = lazy_exports(__name__, _EXPORTS)
__dir__ = listed(_EXPORTS)
