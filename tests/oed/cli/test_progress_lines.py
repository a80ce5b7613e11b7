"""Long work shows in a captured output that it goes on."""

from __future__ import annotations

import pytest

from oed.cli.console import Console
from oed.cli.progress_lines import ProgressLines


def test_a_line_every_ten_seconds(capsys: pytest.CaptureFixture[str]) -> None:
    """Task, share, note and time; nothing within ten seconds of the start or of the last line."""
    now = [0.0]
    lines = ProgressLines(clock=lambda: now[0])
    lines.start("fitting", 200.0)
    for second in range(1, 25):
        now[0] = float(second)
        lines.update(10.0 * second, "joint 2")
    lines.finish()
    now[0] = 60.0
    lines.update(1.0)
    assert capsys.readouterr().err.splitlines() == [
        "progress: fitting: 50 %, joint 2 (10 s since the start)",
        "progress: fitting: 100 %, joint 2 (20 s since the start)",
    ]


def test_a_pipe_gets_lines_unless_the_output_is_for_a_program() -> None:
    """Without a terminal there are lines; with --json or --quiet there are none."""
    with Console().working() as progress:
        assert isinstance(progress, ProgressLines)
    for console in (Console(json=True), Console(quiet=True)):
        with console.working() as progress:
            assert not isinstance(progress, ProgressLines)
