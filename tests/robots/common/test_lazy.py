"""Public names are there, and cost nothing until they are used."""

from __future__ import annotations

import importlib
import math
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from robots.common.lazy import lazy_exports

PACKAGES = ("robots", "estimation", "oed")
HEAVY = ("casadi", "pandas", "pinocchio", "matplotlib", "scipy", "plotly", "cvxpy", "ruckig", "toppra", "pyarrow")


@pytest.fixture
def exports(tmp_path: Path) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """What a package with one public name gets from its stub."""
    (tmp_path / "__init__.pyi").write_text("from math import sqrt as sqrt\nfrom robots.version import __version__\n")
    return lazy_exports("made", str(tmp_path / "__init__.py"))


def test_loads_on_use(exports: tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]) -> None:
    """A name is imported from the module that the stub states, when it is asked for."""
    load, listed, public = exports
    assert load("sqrt") is math.sqrt
    assert listed() == ["__version__", "sqrt"]
    assert public == ["sqrt"]


def test_unknown_name(exports: tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]) -> None:
    """Any other name is missing, as in every module."""
    with pytest.raises(AttributeError, match="module 'made' has no attribute 'nothing'"):
        exports[0]("nothing")


@pytest.mark.slow
@pytest.mark.parametrize("package", PACKAGES)
def test_a_misspelt_name_is_an_error_of_types(tmp_path: Path, package: str) -> None:
    """A type checker finds every public name of a package, and none that there is not."""
    names = importlib.import_module(package).__all__
    (tmp_path / "use.py").write_text(
        "\n".join([f"import {package}", *(f"{package}.{n}" for n in names), f"{package}.none"])
    )
    root = Path(__file__).parents[3]
    # What the stub imports is skipped: the packages themselves are checked elsewhere.
    options = ["--config-file", "", "--follow-imports", "skip", "--no-incremental", "--explicit-package-bases"]
    command = [sys.executable, "-m", "mypy", *options, str(tmp_path / "use.py"), str(root / package / "__init__.pyi")]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True)
    errors = [line for line in done.stdout.splitlines() if "error:" in line and "use.py" in line]
    assert len(errors) == 1, done.stdout + done.stderr
    assert '"none"' in errors[0]


@pytest.mark.parametrize("package", PACKAGES)
def test_every_public_name_exists(package: str) -> None:
    """Every name that a package announces is there, documented, and only about thirty are."""
    module = importlib.import_module(package)
    assert 0 < len(module.__all__) <= 31
    assert list(module.__all__) == sorted(module.__all__)
    for name in module.__all__:
        assert getattr(module, name).__doc__


@pytest.mark.parametrize("package", PACKAGES)
def test_import_is_light(package: str) -> None:
    """Importing a package loads no library beyond the standard one."""
    code = f"import sys, {package}; print(*(set(sys.modules) & set({HEAVY} + ('numpy',))))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""
