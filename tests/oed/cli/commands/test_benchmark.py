"""``oed benchmark`` as its user calls it."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("mak", "FOLDER"), "oed benchmark mak; allowed: make, answer or score"),
        (("make", "FOLDER", "--by", "oed"), "--by beside `oed benchmark make`; it belongs to answer"),
        (("make", "FOLDER", "others"), "others beside `oed benchmark make`"),
        (("make", "FOLDER", "--robots", "kuka"), "the plant has no robot 'kuka'"),
        (("answer", "FOLDER"), "no method; allowed: oed, residual-fit, threshold"),
        (
            ("answer", "FOLDER", "--by", "oed", "--answers", "x"),
            "--answers beside `oed benchmark answer`; it belongs to make",
        ),
        (("answer", "FOLDER", "--by", "oed"), "is no benchmark: it has no benchmark.json"),
        (("score", "FOLDER"), "no answers to score"),
        (("score", "FOLDER", "others", "--cases", "3"), "--cases beside `oed benchmark score`; it belongs to make"),
        (("score", "FOLDER", "others"), "is no benchmark"),
    ],
)
def test_bad_input(run, tmp_path: Path, words: tuple[str, ...], message: str) -> None:
    """Bad input is exit code 2 and one message, and nothing is written."""
    done = run("benchmark", *(tmp_path / "blind" if word == "FOLDER" else word for word in words))
    assert done.code == 2
    assert message in " ".join(done.err.split())
    assert done.err.count("\n") <= 2
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_the_documented_commands(run, tmp_path: Path) -> None:
    """A case is made, answered by a rival and scored, with a table as JSON and as Markdown."""
    blind = tmp_path / "blind"
    made = run(
        *("benchmark", "make", blind, "--cases", "1", "--robots", "heavy"),
        *("--duration", "10", "--unseen", "10", "--seed", "5", "--json"),
    )
    assert made.code == 0, made.err
    assert made.data["cases"] == ["case-001"]
    answered = run("benchmark", "answer", blind, "--by", "threshold", "--json")
    assert answered.code == 0, answered.err
    assert set(answered.data["cases"]) == {"case-001"}
    table = tmp_path / "table.md"
    scored = run("benchmark", "score", blind, tmp_path / "blind.threshold", "--markdown", table, "--json")
    assert scored.code == 0, scored.err
    assert scored.data["tools"][0]["figures"]["false alarm"]["cases"] == 1
    assert table.read_text().startswith("|  | threshold |")
    again = run("benchmark", "score", blind, tmp_path / "blind.threshold", "--markdown", table)
    assert again.code == 2
    assert "the file exists" in again.err
