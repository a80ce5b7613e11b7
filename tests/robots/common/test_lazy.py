"""Public names are there, and cost nothing until they are used."""

from __future__ import annotations

import importlib
import subprocess
import sys

import pytest

from robots.common.lazy import lazy_exports

PACKAGES = ("robots", "estimation", "oed")
HEAVY = ("casadi", "pandas", "pinocchio", "matplotlib", "scipy", "plotly", "cvxpy", "ruckig", "toppra", "pyarrow")


def test_loads_on_use() -> None:
    """A name is imported from its module when it is asked for."""
    load = lazy_exports("made", {"sqrt": "math"})
    import math

    assert load("sqrt") is math.sqrt


def test_unknown_name() -> None:
    """Any other name is missing, as in every module."""
    with pytest.raises(AttributeError, match="module 'made' has no attribute 'nothing'"):
        lazy_exports("made", {"sqrt": "math"})("nothing")


@pytest.mark.parametrize("package", PACKAGES)
def test_every_public_name_exists(package: str) -> None:
    """Every name that a package announces is there, documented, and no more than thirty are."""
    module = importlib.import_module(package)
    assert 0 < len(module.__all__) <= 30
    assert list(module.__all__) == sorted(module.__all__)
    for name in module.__all__:
        assert getattr(module, name).__doc__


@pytest.mark.parametrize("package", PACKAGES)
def test_import_is_light(package: str) -> None:
    """Importing a package loads no library beyond the standard one."""
    code = f"import sys, {package}; print(*(set(sys.modules) & set({HEAVY} + ('numpy',))))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""
