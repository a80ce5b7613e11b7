"""The command answers at once: heavy libraries load only where they are used."""

from __future__ import annotations

import os
import resource
import subprocess
import sys

import pytest

HEAVY = (
    "casadi",
    "pandas",
    "pinocchio",
    "matplotlib",
    "scipy",
    "plotly",
    "cvxpy",
    "ruckig",
    "toppra",
    "pyarrow",
    "numpy",
)


@pytest.mark.slow
def test_help_is_light() -> None:
    """`oed --help` imports no numerical library."""
    code = (
        "import sys; sys.argv = ['oed', '--help']\n"
        "from oed.cli import main\n"
        "try: main()\n"
        "except SystemExit as stop: assert not stop.code\n"
        f"print('loaded:', *(set(sys.modules) & set({HEAVY})))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1].strip() == "loaded:"
    for command in ("design", "retime", "export", "simulate", "identify", "predict"):
        assert f"  {command} " in done.stdout


@pytest.mark.slow
def test_options_are_light() -> None:
    """The options of all commands load none of the libraries that take seconds: a configuration file needs them all."""
    code = (
        "import sys\n"
        "from oed.cli.app import VERBS\n"
        "from oed.cli.declarations.declared import declared_options\n"
        "assert all(declared_options(verb) for verb in VERBS.values())\n"
        f"print('loaded:', *(set(sys.modules) & set({HEAVY}) - {{'numpy', 'scipy'}}))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1].strip() == "loaded:"


@pytest.mark.slow
def test_help_is_quick() -> None:
    """`oed --help` takes less than half a second of the processor."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [sys.executable, "-c", "from oed.cli import main; main()", "--help"],
        capture_output=True,
        check=True,
        env={**os.environ, "PYTHONDONTWRITEBYTECODE": ""},
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    # Time of the processor, not of the wall: other tests may be running.
    assert after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime < 0.5


@pytest.mark.slow
def test_it_runs_as_a_module() -> None:
    """`python -m oed` is `oed`, its exit code for bad input too."""
    done = subprocess.run([sys.executable, "-m", "oed", "predict"], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "oed predict" in done.stderr
