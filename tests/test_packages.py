"""What the three packages show of themselves: names, versions, and objects in one line."""

from __future__ import annotations

import importlib
import subprocess
import sys
import tomllib
from fnmatch import fnmatch
from pathlib import Path

import numpy as np
import pytest

import estimation
from robots import Log, Motion, load_robot, nominal_plant, simulate


@pytest.mark.parametrize("name", ["oed", "estimation", "robots"])
def test_names_and_version(name):
    """`dir` lists the public names and the version, in a fresh process too, before any of them was used."""
    package = importlib.import_module(name)
    code = f"import {name}; print(*dir({name})); print({name}.__version__)"
    names, version = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.splitlines()
    assert set(names.split()) == {*package.__all__, "__version__"}
    assert version == package.__version__ != ""
    assert all(getattr(package, public) is not None for public in package.__all__)


ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize("name", ["oed", "estimation", "robots"])
def test_wheels_hold_all_files(name):
    """Every folder of modules is a package, and every other file is listed as package data: wheels hold both."""
    data = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]["package-data"]
    files = [path for path in (ROOT / name).rglob("*") if path.is_file() and "__pycache__" not in path.parts]
    assert files
    for path in files:
        if path.suffix == ".py":
            assert (path.parent / "__init__.py").exists(), path
            continue
        assert any(
            fnmatch(path.relative_to(ROOT / one).as_posix(), pattern)
            for one in path.relative_to(ROOT).parents
            for pattern in data.get(".".join(one.parts), ())
        ) or any(fnmatch(path.name, pattern) for pattern in data.get("*", ())), f"{path} is not in the package data"


@pytest.mark.slow
def test_objects_print_as_one_line():
    """Robot, motion, log, estimate and model say in one line what they are."""
    robot = load_robot("er3a")
    assert repr(robot) == "Robot('er3a', 6 joints, period 4 ms, nominal dynamics known)"
    t = 0.004 * np.arange(2500)
    phase = 2 * np.pi * 0.3 * t[:, None] + np.arange(6)
    motion = Motion(t, 0.5 * np.sin(phase), 0.3 * np.pi * np.cos(phase), -0.18 * np.pi**2 * np.sin(phase))
    assert repr(motion) == "Motion(2500 samples, 6 joints, 0 to 9.996 s, q, dq, ddq)"
    log = simulate(nominal_plant(robot), motion, seed=0)
    assert (
        repr(Log(log.t, log.q, log.tau, name="run 3")) == "Log('run 3', 2500 samples, 6 joints, 0 to 9.996 s, q, tau)"
    )
    estimate = estimation.identify(robot, log, check=False)
    assert repr(estimate.model).startswith("Model('er3a', ")
    assert repr(estimate).startswith(f"Estimate({estimate.model!r}, held-out error ")
    assert "\n" not in repr(estimate)
