"""A hundred mangled logs; the benchmark of the same name runs ten thousand."""

from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).parents[3] / "benchmarks"


@pytest.mark.slow
def test_mangled_logs_end_in_a_message_or_a_right_result(monkeypatch):
    """Each mangled log ends in a message, in a right result, or in a wrong one with a warning."""
    pytest.importorskip("rosbags", reason="rosbags is not installed")
    pytest.importorskip("h5py", reason="h5py is not installed")
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    import mangled_logs

    cases = list(mangled_logs.run(100, seed=7))
    assert [case for case in cases if case.result in ("silent", "traceback")] == []
    # Some logs pass and some are refused: neither side of the test is empty.
    assert sum(case.result == "right" for case in cases) > 15
    assert sum(case.result == "message" for case in cases) > 30
