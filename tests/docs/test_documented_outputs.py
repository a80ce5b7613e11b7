"""The script that writes outputs into the pages finds commands, files and outputs, and changes nothing else."""

from __future__ import annotations

import pytest

from benchmarks.documented_outputs import BLOCK, PICTURE, Difference, calls, replace, replay, shorten, take_picture
from benchmarks.sentence_lengths import pages

PAGE = """# A page

<!-- file: plant.yaml -->
```yaml
spread: 0.2
```

```yaml
not: a file
```

<!-- run -->
```sh
source .venv/bin/activate
echo "{}" > other.yaml && .venv/bin/oed design --robot er3a
```

```sh
oed campaign --robot er3a
```

<!-- halves: arm/log.parquet -> first.parquet, second.parquet -->
```console
$ oed identify --log first.parquet
an old output of 4.5 s
$ oed predict --quiet
```

The prose stays.
"""


class Recorder:
    """A session that runs nothing: it notes what it is asked for, and gives the outputs that it was made with."""

    def __init__(self, outputs: list[list[str]]) -> None:
        self.outputs, self.asked = iter(outputs), []

    def run(self, command: str) -> list[str]:
        self.asked.append(command)
        return next(self.outputs)

    def write(self, name: str, text: str) -> None:
        self.asked.append((name, text))

    def split(self, source: str, names: list[str]) -> None:
        self.asked.append((source, names))


def test_a_page_is_run_from_top_to_bottom():
    """Files, commands of marked shell blocks, halves of a log and console blocks come in the page's order."""
    session = Recorder([[], [], ["a new output", "of 3.5 s  "], []])
    differences = replay(PAGE, session)
    assert session.asked == [
        ("plant.yaml", "spread: 0.2\n"),
        'echo "{}" > other.yaml',
        ".venv/bin/oed design --robot er3a",
        ("arm/log.parquet", ["first.parquet", "second.parquet"]),
        "oed identify --log first.parquet",
        "oed predict --quiet",
    ]
    assert replace(PAGE, differences) == PAGE.replace("an old output of 4.5 s", "a new output\nof 3.5 s")
    assert [(found.line, found.only_digits) for found in differences] == [(23, False)]


@pytest.mark.parametrize("path", pages(), ids=lambda path: path.stem)
def test_same_outputs_are_no_difference(path):
    """A page of the repository has no difference if every command prints what the page shows."""
    text = path.read_text(encoding="utf-8")
    consoles = [calls(block["body"]) for block in BLOCK.finditer(text) if block["language"] == "console"]
    shown = {call.command: call.output for console in consoles for call in console}
    session = Recorder([])
    session.run = lambda command: shown.get(command, [])
    assert replay(text, session) == []


@pytest.mark.parametrize(
    ("shown", "expected"),
    [
        (["old"], ["1", "2", "3", "4"]),
        (["old", "  ..."], ["1", "  ..."]),
        (["...", "old", "old"], ["...", "3", "4"]),
        (["old", "...", "old"], ["1", "...", "4"]),
        (["old", "old", "...", "old", "old"], ["1", "2", "3", "4"]),
    ],
)
def test_outputs_are_shortened_as_shown(shown, expected):
    """As many lines are shown around dots as before; dots that would stand for no line are left out."""
    assert shorten(["1", "2", "3", "4"], shown) == expected


def test_digits_are_no_change_of_words():
    """Outputs that differ in numbers and their columns only are distinguished from changed words."""
    assert Difference(1, "error  6.25 %, 1e-05", "error 12.5 %, -3").only_digits
    assert not Difference(1, "error 6.25 %", "errors 6.25 %").only_digits


def test_output_needs_a_command():
    """A console block that begins with output is refused with the line."""
    with pytest.raises(ValueError, match="begins with 'er3a'"):
        calls("er3a\n$ oed design\n")


def test_no_picture_without_a_browser(monkeypatch, tmp_path, capsys):
    """Without Chromium the picture is left as it is, and a line of the output says so."""
    monkeypatch.setattr("shutil.which", lambda name: None)
    before = PICTURE.read_bytes()
    take_picture(tmp_path / "report.html")
    assert "needs Chromium" in capsys.readouterr().out
    assert PICTURE.read_bytes() == before
