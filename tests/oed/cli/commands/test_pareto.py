"""``oed pareto`` as its user calls it."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.mark.slow
def test_front_is_written(run, robot: Path, tmp_path: Path) -> None:
    """The command writes the front, a page, and a folder per design, and prints what it wrote."""
    out = tmp_path / "front"
    done = run("pareto", "--robot", robot, "--points", "2", "--workers", "1", "--out", out, "--json")
    assert done.code == 0, done.err
    assert [criterion["name"] for criterion in done.data["criteria"]] == ["cond", "d"]
    written = {str(path.relative_to(out)) for path in out.rglob("*") if path.is_file()}
    designs = {f"point_{point}/{name}" for point in (1, 2) for name in ("trajectory.csv", "design.json")}
    assert written == {"pareto.json", "report.html"} | designs


def test_bad_input_leaves_nothing(run, robot: Path, tmp_path: Path) -> None:
    """One criterion is no front: exit code 2, one message, nothing written."""
    done = run("pareto", "--robot", robot, "--criteria", "cond", "--out", tmp_path / "front")
    assert done.code == 2
    assert "two or three" in done.err
    assert not (tmp_path / "front").exists()
