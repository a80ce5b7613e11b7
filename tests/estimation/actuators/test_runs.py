"""Logs that are no use for drives are refused, each with one clear message."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from benchmarks.actuators_parts.plants import MACHINES, mjcf
from estimation.actuators.base_motion import is_situated, with_base
from estimation.actuators.freedom import Fleet
from estimation.actuators.runs import runs_of
from estimation.logs import read_log
from robots.common.errors import InputError
from robots.drives import described_drives
from robots.drives.branches import load_branches
from robots.signals import Log

LEG = MACHINES["leg"]()


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Fleet:
    """A leg with its drives."""
    path = tmp_path_factory.mktemp("leg") / "leg.xml"
    path.write_text(mjcf(LEG))
    chains = load_branches(path)
    return Fleet(chains, described_drives(chains).drives)


def log_of(rate: float = 200.0) -> Log:
    """A motion that follows its command with a lag."""
    t = np.arange(0, 3.0, 1 / rate)
    wave = np.sin(2 * np.pi * np.outer(t, [0.5, 0.7, 0.9]))
    late = np.sin(2 * np.pi * np.outer(t - 0.03, [0.5, 0.7, 0.9]))
    home = np.array(LEG.home)
    return Log(t=t, q=home + 0.3 * late, command=home + 0.3 * wave, name="run", metadata={"file": "run.csv"})


def test_a_log_without_faults_is_one_run(fleet: Fleet) -> None:
    """A log without pauses is one run, one with a pause is two; the command stays whole."""
    log = log_of()
    (run,), notes = runs_of([log], fleet)
    assert (len(run.t), notes) == (600, ())
    kept = np.r_[0:200, 300:600]
    first, second = runs_of([log.rows(kept)], fleet)[0]
    assert (len(first.t), len(second.t), len(second.log_t)) == (200, 300, 500)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda log: replace(log, command=None), r"run.csv: column qref1: no command; .*qref1..qn.*--mapping"),
        (lambda log: replace(log, command=log.q), "the command equals the measured position"),
        (lambda log: replace(log, command=np.rad2deg(log.command)), "command is 57.3 times the measurement.*degrees"),
        (lambda log: replace(log, q=log.q * 4096 / (2 * np.pi)), "measurement is .* times the command.*ticks of 4096"),
        (lambda log: replace(log, q=np.rad2deg(log.q), command=np.rad2deg(log.command)), "they look like degrees"),
        (lambda log: log.rows(slice(None, None, 20)), "10 samples per second; allowed: 25 or more"),
        (lambda log: replace(log, q=log.q[:, :2], command=log.command[:, :2]), "2 joints; allowed: 3: hip_joint"),
    ],
)
def test_faults_are_named(fleet: Fleet, change: object, message: str) -> None:
    """No command, the measurement as command, mixed units, a slow log, other joints: each is one message."""
    with pytest.raises(InputError, match=message):
        runs_of([change(log_of())], fleet)  # type: ignore[operator]


def test_commands_with_gaps_say_so(fleet: Fleet, tmp_path: Path) -> None:
    """A command column with an empty cell is named with its row, not called missing."""
    log = log_of()
    assert log.command is not None
    columns = {"t": log.t} | {f"q{j + 1}": log.q[:, j] for j in range(3)}
    columns |= {f"qref{j + 1}": log.command[:, j] for j in range(3)}
    table = pd.DataFrame(columns)
    table.loc[30, "qref2"] = np.nan
    table.to_csv(tmp_path / "run.csv", index=False)
    with pytest.raises(InputError, match=r"no command: qref2 has no number in 1 row of 600, the first of them row 32"):
        runs_of([read_log(tmp_path / "run.csv", 3, torque=False)], fleet)


def test_what_a_slow_log_shows_is_said(fleet: Fleet) -> None:
    """A log of 30 Hz is read, and its limits are said."""
    _, notes = runs_of([log_of(30.0)], fleet)
    assert "30 samples per second: delays, inertias and gains" in notes[0]


def test_a_base_that_moves_is_refused(fleet: Fleet, tmp_path: Path) -> None:
    """Columns of the log itself show that the base was not held."""
    log = log_of()
    assert log.command is not None
    columns = {"t": log.t, "base_z": 0.3 + 0.1 * np.sin(log.t)}
    columns |= {f"q{j + 1}": log.q[:, j] for j in range(3)} | {f"qref{j + 1}": log.command[:, j] for j in range(3)}
    path = tmp_path / "walk.csv"
    pd.DataFrame(columns).to_csv(path, index=False)
    with pytest.raises(InputError, match=r"walk.csv: column base_z: the base moves.*base_qx.*base_roll"):
        with_base(read_log(path, 3, torque=False))
    pd.DataFrame(columns | {"base_z": 0.3}).to_csv(path, index=False)
    still = with_base(read_log(path, 3, torque=False))
    assert not is_situated(still)
    assert len(runs_of([still], fleet)[0]) == 1
