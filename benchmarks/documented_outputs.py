"""Runs the commands that README and documentation show, and writes their output into the pages.

How a page is read, from top to bottom:

- In a ``console`` block the lines that begin with ``$ `` are commands. The lines below a command are its output, and
  are replaced. A line ``...`` stays: as many lines as the page shows before and after it are kept.
- A comment in the line above a block is not visible to a reader of the page:
  ``<!-- file: NAME -->`` writes the block to that file, ``<!-- run -->`` or ``<!-- design -->`` runs the ``oed`` and
  ``echo`` commands of a ``sh`` block, and ``<!-- halves: LOG -> FIRST, SECOND -->`` splits a log of the folder with the
  published logs in the middle.

All commands of a page run in one temporary directory, which the page shows as ``/home/user``. Only standard output is
written. The script also makes the picture of the report that the commands of README.md end with, if Chromium is there.

Use: ``python benchmarks/documented_outputs.py [--only PAGE] [--data FOLDER] [--check]``. With ``--check`` no file is
changed; the differences are printed, and the exit code is 1 if more than digits and spaces differ. Digits depend on the
processor.
"""

from __future__ import annotations

import argparse
import difflib
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
from PIL import Image, ImageChops

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.sentence_lengths import ROOT, pages

BLOCK = re.compile(
    r"(?:^<!-- (?P<note>[^\n]*) -->\n)?^```(?P<language>\w+)\n(?P<body>.*?)^```$", re.MULTILINE | re.DOTALL
)
PROMPT, LEFT_OUT, SHOWN_FOLDER = "$ ", "...", "/home/user"
PROGRAM = re.compile(r"^(?:\.venv/bin/)?oed ")
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")

PICTURE = ROOT / "docs" / "images" / "diagnosis_report.png"
REPORT = Path("diagnosed") / "report.html"  # of the commands of README.md
COLOURS, MARGIN, LARGEST = 128, 30, 200_000  # of the picture: number, pixels, bytes
# The picture shows the first finding: its sentence, its first figure and its first table.
FIRST_FINDING = """<style>
.contents, header, footer, .modebar-container, main > section:not([id^="section-finding-1-"]) { display: none; }
section > .scroll ~ .scroll, section > figure ~ figure { display: none; }
main > section { border: none; margin: 0; }
</style></head>"""


@dataclass(frozen=True)
class Call:
    """A command of a console block, and the lines of output that the page shows."""

    command: str
    output: list[str]


@dataclass(frozen=True)
class Difference:
    """A console block whose output differs from that of the page."""

    line: int
    old: str
    new: str

    @property
    def only_digits(self) -> bool:
        """Whether the outputs are the same except for numbers and spaces."""
        old, new = (NUMBER.sub("0", text).split() for text in (self.old, self.new))
        return old == new


def calls(body: str) -> list[Call]:
    """The commands of a console block with the output that the page shows.

    Raises:
        ValueError: there is output before the first command.
    """
    found: list[Call] = []
    for line in body.splitlines():
        if line.startswith(PROMPT):
            found.append(Call(line.removeprefix(PROMPT), []))
        elif found:
            found[-1].output.append(line)
        else:
            raise ValueError(f"a console block begins with {line!r}: begin it with a command, '{PROMPT}oed ...'")
    return found


def shell_commands(body: str) -> list[str]:
    """The commands of a ``sh`` block that make the page's files: those of ``oed`` and ``echo``."""
    parts = [part.strip() for line in body.splitlines() for part in line.split(" && ")]
    return [part for part in parts if PROGRAM.match(part) or part.startswith("echo ")]


def shorten(output: list[str], shown: list[str]) -> list[str]:
    """The new output, with as many lines around ``...`` as the page shows.

    All lines are returned if the page leaves out none, or if none would be left out.
    """
    marks = [index for index, line in enumerate(shown) if line.strip() == LEFT_OUT]
    if not marks or len(output) < len(shown):
        return output
    before, after = marks[0], len(shown) - marks[0] - 1
    return [*output[:before], shown[before], *output[len(output) - after :]]


@dataclass(frozen=True)
class Session:
    """The directory in which the commands of a page run, and the folder with the published logs."""

    directory: Path
    logs: Path

    def run(self, command: str) -> list[str]:
        """Runs a command with this Python and this checkout, and returns the lines of its standard output."""
        started = time.monotonic()
        executed = PROGRAM.sub(lambda _: f"{shlex.quote(sys.executable)} -m oed ", command)
        options = {"cwd": self.directory, "env": {**os.environ, "PYTHONPATH": str(ROOT)}, "shell": True, "text": True}
        done = subprocess.run(executed, **options, capture_output=True, check=False)
        if done.returncode:
            raise SystemExit(f"{command}\nended with exit code {done.returncode}:\n{done.stderr}")
        print(f"  {time.monotonic() - started:5.1f} s  {command}", flush=True)
        return done.stdout.replace(str(self.directory), SHOWN_FOLDER).splitlines()

    def write(self, name: str, text: str) -> None:
        """Writes a file that the page shows."""
        (self.directory / name).write_text(text, encoding="utf-8")

    def split(self, source: str, names: list[str]) -> None:
        """Writes the first and the second half of the rows of a published log."""
        log = pd.read_parquet(self.logs / source)
        middle = len(log) // 2
        for name, rows in zip(names, (log[:middle], log[middle:]), strict=True):
            rows.reset_index(drop=True).to_parquet(self.directory / name)


def replay(text: str, session: Session) -> list[Difference]:
    """Runs the commands of a page from top to bottom.

    Args:
        text: the page, in Markdown.
        session: runs the commands and makes the files.

    Returns:
        The console blocks whose output differs from what the page shows.
    """
    differences = []
    for block in BLOCK.finditer(text):
        language, body = block["language"], block["body"]
        keyword, _, value = (block["note"] or "").partition(": ")
        if keyword == "file":
            session.write(value, body)
        elif keyword == "halves":
            source, names = value.split(" -> ")
            session.split(source, names.split(", "))
        if language == "sh" and keyword in ("run", "design"):
            for command in shell_commands(body):
                session.run(command)
        if language == "console":
            lines: list[str] = []
            for call in calls(body):
                lines += [PROMPT + call.command, *shorten(session.run(call.command), call.output)]
            new = "".join(f"{line.rstrip()}\n" for line in lines)
            if new != body:
                differences.append(Difference(text.count("\n", 0, block.start("body")), body, new))
    return differences


def replace(text: str, differences: list[Difference]) -> str:
    """A page with the new outputs."""
    for found in differences:
        text = text.replace(f"```console\n{found.old}```", f"```console\n{found.new}```", 1)
    return text


def take_picture(report: Path) -> None:
    """Writes the picture of the first finding of a report, if Chromium is installed."""
    browser = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if browser is None:
        print(f"{PICTURE.name} is not made: it needs Chromium (chromium, chromium-browser or google-chrome)")
        return
    page, screen = report.with_name("finding.html"), report.with_name("finding.png").resolve()
    page.write_text(report.read_text(encoding="utf-8").replace("</head>", FIRST_FINDING, 1), encoding="utf-8")
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--window-size=1200,1400"]
    waiting = ["--virtual-time-budget=10000", f"--screenshot={screen}"]
    subprocess.run([browser, *options, *waiting, page.resolve().as_uri()], capture_output=True, check=True, timeout=120)
    with Image.open(screen) as taken:
        image = taken.convert("RGB")
    written = ImageChops.difference(image, Image.new("RGB", image.size, "white")).getbbox()
    if written is None:
        raise SystemExit(f"{report}: the picture is empty, because the page has no section of a first finding")
    image = image.crop((0, 0, image.width, min(written[3] + MARGIN, image.height))).quantize(COLOURS)
    image.save(PICTURE, optimize=True)
    print(f"{PICTURE.name}: {image.width} x {image.height} pixels, {PICTURE.stat().st_size / 1000:.0f} kB")
    if PICTURE.stat().st_size >= LARGEST:
        raise SystemExit(f"{PICTURE} has more than {LARGEST // 1000} kB: use fewer colours")


def update(path: Path, logs: Path, *, check: bool) -> bool:
    """Runs a page, prints the differences, and rewrites the page unless ``check``; returns whether words differ."""
    name = path.relative_to(ROOT).as_posix()
    print(name, flush=True)
    with tempfile.TemporaryDirectory() as folder:
        session = Session(Path(folder).resolve(), logs)
        differences = replay(path.read_text(encoding="utf-8"), session)
        if not check:
            # Read again: the prose may have been edited while the commands ran.
            path.write_text(replace(path.read_text(encoding="utf-8"), differences), encoding="utf-8")
            if (report := session.directory / REPORT).exists() and path.name == "README.md":
                take_picture(report)
    for found in differences:
        print(f"{name}:{found.line}: {'digits differ' if found.only_digits else 'the output differs'}")
        lines = difflib.ndiff(found.old.splitlines(), found.new.splitlines())
        print(*(line for line in lines if line[0] in "+-"), sep="\n")
    return not all(found.only_digits for found in differences)


def main() -> None:
    """Runs the pages that have console blocks."""
    with_output = [path for path in pages() if "```console\n" in path.read_text(encoding="utf-8")]
    names = [path.name for path in with_output]
    parser = argparse.ArgumentParser(description="Writes the output of their commands into README and documentation.")
    parser.add_argument("--only", metavar="PAGE", choices=names, help="one page: %(choices)s")
    parser.add_argument("--data", metavar="FOLDER", type=Path, default=Path("data"), help="the published logs")
    parser.add_argument("--check", action="store_true", help="change no file; exit code 1 if more than digits differ")
    chosen = parser.parse_args()
    changed = False
    for path in with_output:
        if chosen.only not in (None, path.name):
            continue
        if not chosen.data.is_dir() and "<!-- halves: " in path.read_text(encoding="utf-8"):
            print(f"{path.name} is left out: there is no folder {chosen.data} with the published logs")
        else:
            changed |= update(path, chosen.data, check=chosen.check)
    sys.exit(chosen.check and changed)


if __name__ == "__main__":
    main()
