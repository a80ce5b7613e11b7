"""``oed view`` from the command line: a list, a static page, the served page, and bad input."""

from __future__ import annotations

import socket
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

from tests.oed.overviews.test_entries import DESIGN, write

pytestmark = pytest.mark.slow


def test_list_and_static_page(run, tmp_path: Path) -> None:
    """--json lists the results; --out writes a page whose links lead from its place to the results."""
    write(tmp_path, "results/a/design.json", DESIGN)
    done = run("view", tmp_path / "results", "--json")
    assert (done.code, [entry["kind"] for entry in done.data["results"]]) == (0, ["design"])
    page = tmp_path / "pages" / "index.html"
    page.parent.mkdir()
    assert run("view", tmp_path / "results", "--out", page).code == 0
    assert 'href="./../results/a/design.json"' in page.read_text()
    assert run("view", tmp_path / "results", "--out", page).code == 2


def test_bad_input(run, tmp_path: Path) -> None:
    """A folder that is not there and a port that is taken are named, with code 2."""
    done = run("view", tmp_path / "none", "--no-browser")
    assert (done.code, "no such folder" in done.err) == (2, True)
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        done = run("view", tmp_path, "--no-browser", "--port", taken.getsockname()[1])
    assert (done.code, "cannot be used" in done.err) == (2, True)


def test_served_page(tmp_path: Path) -> None:
    """The command prints its address, serves the page there, and ends by Ctrl-C."""
    write(tmp_path, "design.json", DESIGN)
    words = [sys.executable, "-u", "-m", "oed", "view", str(tmp_path), "--no-browser"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        try:
            address = process.stdout.readline().split(" at ")[1].split()[0]
            with urllib.request.urlopen(address, timeout=20) as answer:
                assert "design.json" in answer.read().decode()
        finally:
            process.send_signal(2)
        _, error = process.communicate(timeout=20)
    assert process.returncode == 130
    assert "interrupted" in error
