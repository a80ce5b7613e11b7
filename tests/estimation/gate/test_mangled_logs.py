"""Fifty mangled logs, a hundred in the longer run; the benchmark of the same name runs ten thousand."""

import pytest


@pytest.mark.slow
@pytest.mark.parametrize("count", [50, pytest.param(100, marks=pytest.mark.longer)])
def test_mangled_logs_end_in_a_message_or_a_right_result(count):
    """Each mangled log ends in a message, in a right result, or in a wrong one with a warning."""
    pytest.importorskip("rosbags", reason="rosbags is not installed")
    pytest.importorskip("h5py", reason="h5py is not installed")
    from benchmarks import mangled_logs

    cases = list(mangled_logs.run(count, seed=7))
    assert [case for case in cases if case.result in ("silent", "traceback")] == []
    # Some logs pass and some are refused: neither side of the test is empty.
    assert sum(case.result == "right" for case in cases) > 0.15 * count
    assert sum(case.result == "message" for case in cases) > 0.3 * count
