"""Specification of times that are rounded to a coarse grid, count rows, or run backwards."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from estimation import check_log, identify, read_log
from robots.common.errors import InputError
from tests.estimation.gate.findings_of import found
from tests.estimation.logs.made_logs import columns, csv, text


@pytest.fixture
def write(tmp_path: Path, arm_log):
    """Write a log of the arm with other times."""
    log = arm_log(seed=1)
    table = pd.DataFrame(np.column_stack([log.t, log.q, log.tau]), columns=["t", "q1", "q2", "tau1", "tau2"])

    def call(t: np.ndarray, rows: np.ndarray | slice = slice(None), name: str = "log.csv") -> Path:
        table.assign(t=t).iloc[rows].to_csv(tmp_path / name, index=False)
        return tmp_path / name

    call.log = log
    return call


@pytest.mark.parametrize("grid", [0.005, 0.01, 0.02, 0.1])
@pytest.mark.parametrize("rounding", [np.floor, np.round])
@pytest.mark.parametrize("gap", [False, True])
def test_times_on_a_coarse_grid_are_put_back(write, grid, rounding, gap):
    """Rows of 4 ms whose times have steps of 5 to 100 ms get uniform times, apart from one offset."""
    t = write.log.t
    rows = np.delete(np.arange(len(t)), slice(1000, 1500) if gap else slice(0, 0))
    path = write(np.round(rounding(t / grid + 1e-9) * grid, 6), rows)
    log = read_log(path)
    error = log.t - t[rows]
    # Each part has its own offset, known to a part of a sample period.
    for part in (error[:1000], error[1000:]):
        assert np.ptp(part) < 0.002
    assert [note["name"] for note in log.metadata["repairs"]] == ["rounded_times"]


def test_uneven_times_that_repeat_are_refused(write):
    """Times that repeat without a grid are not guessed."""
    t = write.log.t + np.random.default_rng(0).uniform(0, 0.003, 5000)
    t[700] = t[699]
    with pytest.raises(InputError, match="log the time with more digits"):
        read_log(write(t))


@pytest.mark.slow
def test_rounded_times_lead_to_the_right_fit(write, arm):
    """The fit of a log whose times were rounded to 10 ms is as good as that of the original."""
    log = write.log
    options = {"friction": "coulomb-viscous", "position": False}
    right = identify(arm, log, **options)
    found = identify(arm, read_log(write(np.floor(log.t * 100) / 100)), **options)
    for one, other in zip(found.joints, right.joints, strict=True):
        assert one.held_out_rms < 1.05 * other.held_out_rms
    assert found.gates[0].findings[0].name == "rounded_times"


@pytest.mark.parametrize("start", [0, 1, 5000])
@pytest.mark.parametrize("velocities", [False, True])
def test_a_row_counter_is_called_one(arm, arm_log, start, velocities):
    """A column that counts rows is no time in milliseconds; velocities show the sample period."""
    log = arm_log(seed=1)
    dq = np.gradient(log.q, log.t, axis=0) if velocities else None
    report = check_log(arm, replace(log, t=start + np.arange(len(log), dtype=float), dq=dq))
    (finding,) = found(report, "row_counter")
    assert finding.severity == "refuse"
    assert "250 Hz" in finding.action
    assert ("velocity columns" in finding.action) == velocities
    fast = replace(arm, period=0.001)
    assert bool(found(check_log(fast, replace(log, t=np.arange(len(log), dtype=float))), "unit_of_time"))


@pytest.mark.slow
def test_a_clock_set_back_is_not_sorted(write, arm):
    """Where the arm moves on, the advice is to split the log; the two logs then give the right fit."""
    log, rows = write.log, np.arange(5000)
    t = log.t - 0.5 * (rows >= 2500)
    with pytest.raises(InputError, match=r"set back by 0\.496 s.*split the log") as caught:
        read_log(write(t))
    assert caught.value.row == 2502  # the line of the file, with its head
    parts = [
        read_log(write(t, rows[part], name)) for part, name in ((slice(2500), "a.csv"), (slice(2500, None), "b.csv"))
    ]
    options = {"friction": "coulomb-viscous", "position": False}
    right, split = identify(arm, log, **options), identify(arm, parts, **options)
    for one, other in zip(split.joints, right.joints, strict=True):
        assert one.held_out_rms < 1.1 * other.held_out_rms


def test_other_backward_times_have_other_advice(write):
    """Two recordings in one file are split; shuffled rows are sorted."""
    t = np.array(write.log.t)
    rows = np.r_[3000:5000, 700:3000]
    with pytest.raises(InputError, match="another recording begins there"):
        read_log(write(t, rows))
    with pytest.raises(InputError, match="sort the rows by time"):
        read_log(write(t, np.random.default_rng(0).permutation(5000)))


def test_serial_days_of_a_spreadsheet_become_seconds(tmp_path):
    """45415.5 is noon of 3 May 2024; a log of seconds at such numbers stays one of seconds."""
    from datetime import UTC, datetime

    steps = 0.016 * np.arange(40)
    noon = datetime(2024, 5, 3, 12, tzinfo=UTC).timestamp()
    for t, expected, noted in (
        (45415.5 + steps / 86400.0, noon + steps, True),
        (45415.5 + steps, 45415.5 + steps, False),
    ):
        log = read_log(csv(tmp_path, text(columns(rows=40, t=[repr(float(time)) for time in t]))), n=2)
        # A double near 45415 has a spacing of 7e-12 days, which are 6e-7 s.
        np.testing.assert_allclose(log.t, expected, rtol=0, atol=1e-6)
        assert any(note["name"] == "serial_days" for note in log.metadata.get("repairs", ())) == noted
