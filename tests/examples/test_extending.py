"""The examples of the page "Write your own" run from outside the packages and do what they say."""

from __future__ import annotations

import os
import re
import runpy
import warnings
from contextlib import redirect_stdout
from multiprocessing import get_context
from pathlib import Path

import pytest

import estimation
import oed

assert estimation.diagnose, oed.design  # both are imported on first use: here, for all examples at once

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "examples" / "extending"
PAGE = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")


def example(name: str, folder: Path) -> str:
    """Runs an example as a program in another folder, with the packages on its path, and gives what it prints."""
    printed = folder / "printed.txt"
    # A fork has imported what all examples import, and what it registers ends with it.
    process = get_context("fork").Process(target=_run, args=(FOLDER / f"{name}.py", printed))
    process.start()
    process.join()
    assert process.exitcode == 0
    return printed.read_text(encoding="utf-8")


def _run(program: Path, printed: Path) -> None:
    os.chdir(printed.parent)
    warnings.simplefilter("default")
    with printed.open("w", encoding="utf-8") as stream, redirect_stdout(stream):
        runpy.run_path(str(program), run_name="__main__")


def test_page_shows_every_example():
    """The page includes each file, so that what it prints is what runs here."""
    included = set(re.findall(r"examples/extending/(\w+)\.py", PAGE))
    assert included == {file.stem for file in FOLDER.glob("*.py")}


@pytest.mark.slow
def test_criterion(tmp_path):
    """The design by an own criterion is better by it than the design by cond(Y)."""
    values = dict(re.findall(r"^([\w-]+): ([\d.]+)$", example("criterion", tmp_path), flags=re.MULTILINE))
    assert float(values["two-smallest"]) > 1.1 * float(values["cond"])


@pytest.mark.slow
def test_limit(tmp_path):
    """The flange uses its own speed limit up, and does not pass it."""
    (speed,) = re.findall(r"fastest flange: ([\d.]+) m/s", example("limit", tmp_path))
    assert 0.45 < float(speed) <= 0.5


@pytest.mark.slow
def test_family(tmp_path):
    """An experiment of an own family determines all parameters within all limits."""
    text = example("family", tmp_path)
    (cond,) = re.findall(r"excitation +cond\(Y\) ([\d.]+)", text)
    assert float(cond) < 60
    assert "PASSED" not in text
    assert "VIOLATED" not in text.upper()


@pytest.mark.slow
def test_friction(tmp_path):
    """Data with an own friction are explained by that term alone, to the noise of two per cent."""
    levels = dict(re.findall(r"^([\w-]+): ([\d.]+) % residual$", example("friction", tmp_path), flags=re.MULTILINE))
    assert float(levels["saturating_friction"]) < 2.5
    assert float(levels["coulomb-viscous"]) > 2 * float(levels["saturating_friction"])


@pytest.mark.slow
def test_estimator(tmp_path):
    """An own estimator fits to the noise; its largest relative residual is not above that of WLS."""
    lines = re.findall(r"^([\w-]+): residual (.*) %", example("estimator", tmp_path), flags=re.MULTILINE)
    largest = {name: max(float(value) for value in values.split(",")) for name, values in lines}
    assert largest["load-weighted"] < 2.5
    assert largest["load-weighted"] <= largest["wls"]


@pytest.mark.slow
def test_check(tmp_path):
    """An own check warns of each joint of a slow log, and not of a fast one."""
    fast, slow = (part.splitlines() for part in example("check", tmp_path).split("virtual er3a: ")[1:])
    assert len(fast) == 1
    assert sum("of its speed limit" in line for line in slow) == 6


@pytest.mark.slow
def test_effect(tmp_path):
    """An own effect is found on its joint with its parameters, and saved in a model that loads again."""
    text = example("effect", tmp_path)
    assert "1 known cause found: tight_hose (joint 2)" in text
    low, high = map(float, re.search(r"hose_stiffness \(([\d.]+) to ([\d.]+) N m/rad2\)", text).groups())
    assert low <= 12.0 <= high
    assert "the saved model has tight_hose on joint 2" in text
