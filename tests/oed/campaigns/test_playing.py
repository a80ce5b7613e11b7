"""A campaign plays through the virtual robot, cycle by cycle on one clock."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from estimation import read_log
from oed.campaigns import Campaign, play, record
from robots.common.errors import InputError
from robots.plants import nominal_plant
from robots.robot import Robot

pytestmark = pytest.mark.slow


def test_a_cycle_of_the_thesis_plays(thesis_campaign: Campaign) -> None:
    """The first cycle is 75,000 samples at 4 ms, of 5 min, with q, tau, segment and cycle."""
    log = next(play(thesis_campaign))
    assert len(log) == 75_000
    assert log.t[0] == 0.0
    assert log.period == pytest.approx(0.004, rel=1e-9)
    assert set(np.unique(log.segment)) == {1.0, 2.0, 3.0}
    assert np.all(log.cycle == 1.0)
    # The encoders' steps are a thousandth of that.
    np.testing.assert_allclose(log.q[:100], thesis_campaign.stages[0].motion.q[:100], atol=1e-5)


def test_one_clock_runs_through_all_cycles(small_campaign: Campaign) -> None:
    """Each cycle's log starts when the timetable says; in rest nothing is logged, and time goes on."""
    starts = {slot.cycle: slot.start for slot in reversed(small_campaign.slots)}
    total, last = 0, -1.0
    for log in play(small_campaign, seed=2):
        cycle = int(log.cycle[0])
        assert log.t[0] == pytest.approx(starts[cycle], abs=1e-9)
        assert log.t[0] > last
        last, total = log.t[-1], total + len(log)
    assert cycle == small_campaign.cycles
    assert total == small_campaign.samples


def test_noise_differs_between_cycles_and_repeats_with_the_seed(small_campaign: Campaign) -> None:
    """Two cycles of the same stages have the same motion and other noise; the same seed gives the same logs."""
    first, again, other = ([*play(small_campaign, seed=seed)] for seed in (1, 1, 2))
    heating = [log for log in first if log.metadata["phase"] == "heating"][:2]
    np.testing.assert_array_equal(heating[0].q, heating[1].q)
    assert not np.array_equal(heating[0].tau, heating[1].tau)
    np.testing.assert_array_equal(first[3].tau, again[3].tau)
    assert not np.array_equal(first[3].tau, other[3].tau)


def test_logs_are_written_a_file_a_cycle(small_campaign: Campaign, tmp_path: Path) -> None:
    """Each cycle becomes a Parquet log that reads back; existing logs are kept without force."""
    names = record(small_campaign, tmp_path / "logs")
    assert names == tuple(f"cycle_{cycle:03d}.parquet" for cycle in range(1, small_campaign.cycles + 1))
    log = read_log(tmp_path / "logs" / names[4], n=2)
    assert log.t[0] == pytest.approx(next(slot.start for slot in small_campaign.slots if slot.cycle == 5))
    assert log.metadata["phase"] == "cooling"
    with pytest.raises(InputError, match="exists"):
        record(small_campaign, tmp_path / "logs")


def test_a_plant_of_another_robot_is_refused(small_campaign: Campaign, er3a: Robot) -> None:
    """The plant must have the campaign's joints."""
    with pytest.raises(InputError, match="6 joints"):
        next(play(small_campaign, nominal_plant(er3a)))
