"""Runs of a campaign that are killed at the worst moments, or whose disk becomes full."""

from __future__ import annotations

import json
import random
import resource
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimation import read_log
from oed.campaigns import Campaign
from oed.campaigns.runs import run_campaign
from oed.controllers import Endpoint
from oed.exports import read_trajectory
from tests.oed.campaigns.runs.conftest import FAST, SPEED

pytestmark = pytest.mark.slow

PLAY = """
import os, signal, sys, time, warnings
from pathlib import Path
warnings.simplefilter("ignore")
from oed.campaigns.runs import run_campaign
from oed.controllers import Endpoint, StreamOptions
from robots.common.errors import OedError
folder, motion, state, speed = Path(sys.argv[1]), *map(int, sys.argv[2:4]), float(sys.argv[4])
place = Endpoint(host="127.0.0.1", transport="tcp", motion_port=motion, state_port=state)

def play():
    run_campaign(folder, place, options=StreamOptions(download=True, patience=10.0), speed=speed)
"""

KILLED = (
    PLAY
    + """
def die_at(event, name, count):
    left = [int(count)]
    def look(seen, arguments):
        # A rename has the old name and the new one, an open has the name first.
        if seen == event and name in Path(str(arguments[event == "os.rename"])).name:
            left[0] -= 1
            if not left[0]:
                os.kill(os.getpid(), signal.SIGKILL)
    sys.addaudithook(look)

for moment in [*sys.argv[5:], "end"]:
    kind, *rest = moment.split(":")
    before = set((folder / "interrupted").glob("*.csv"))
    child = os.fork()
    if not child:
        if len(rest) == 2:
            die_at(kind, *rest)
        play()
        os._exit(0)
    if kind == "after":
        time.sleep(float(rest[0]))
    while kind == "bytes":
        files = set((folder / "interrupted").glob("*.csv")) - before
        if any(file.stat().st_size > int(rest[0]) for file in files):
            break
        time.sleep(0.002)
    if kind in ("after", "bytes"):
        os.kill(child, signal.SIGKILL)
    print(os.waitpid(child, 0)[1])
"""
)

MOMENTS = (
    "os.rename:run.json:2",  # the first stage is recorded; its note is written but not in place
    "open:.run.json.:2",  # the note of the stage is empty
    "os.rename:001_power_on.csv:1",  # the stage is noted, its recording is not in its place
    "bytes:20000",  # the second stage is in the middle
    "open:.002_friction:1",  # the header of the recording is written again
)


def child(script: str, campaign: Path, endpoint: Endpoint, *further: object, **settings: Any) -> Any:
    """Run a script that plays the campaign."""
    words = [sys.executable, "-c", script, campaign, endpoint.motion_port, endpoint.state_port, SPEED, *further]
    return subprocess.run(list(map(str, words)), capture_output=True, text=True, check=False, timeout=120, **settings)


@pytest.mark.longer
def test_kills_while_files_are_written(campaign: Path, endpoint: Endpoint) -> None:
    """Killed while its files are written, and at a random time, a run ends with every stage recorded once."""
    moments = [*MOMENTS, f"after:{random.uniform(0.1, 2.5):.3f}"]
    done = child(KILLED, campaign, endpoint, *moments)
    assert done.stderr == "", moments
    codes = done.stdout.split()
    assert (codes[:5], codes[6]) == (["9"] * 5, "0"), moments
    state = json.loads((campaign / "run.json").read_text())
    planned = [slot for slot in Campaign.load(campaign).slots if slot.stage is not None]
    assert [(row["number"], row["stage"], row["cycle"]) for row in state["recorded"]] == [
        (number, slot.stage, slot.cycle) for number, slot in enumerate(planned, start=1)
    ]
    files = sorted((campaign / "logs").iterdir())
    assert [file.name for file in files] == [Path(row["file"]).name for row in state["recorded"]]
    assert state["starts"] >= 6
    # What was cut short is kept, and what is not whole is not.
    assert len(list((campaign / "interrupted").glob("*.csv"))) >= 4
    assert not list(campaign.rglob("*.partial"))
    end = -np.inf
    for file, slot in zip(files, planned, strict=True):
        log = read_log(file, 2)
        motion, _ = read_trajectory(campaign / f"{slot.stage}.csv")
        assert log.t[0] > end
        end = log.t[-1]
        assert log.metadata["complete"] is True
        assert (log.metadata["stage"], log.metadata["cycle"]) == (slot.stage, slot.cycle)
        # The whole stage is in its log: 4-byte reals and encoders round by less.
        np.testing.assert_allclose(log.q.max(axis=0), motion.q.max(axis=0), atol=1e-4)
        np.testing.assert_allclose(log.q[[0, -1]], motion.q[[0, -1]], atol=1e-4)


FULL = (
    PLAY
    + """
try:
    play()
except OedError as error:
    print(error.exit_code, error)
"""
)


def test_full_disk(campaign: Path, endpoint: Endpoint) -> None:
    """On a full disk a run ends with one message, and keeps what it recorded; with room it goes on."""
    room = 60_000
    limit = (room, resource.RLIM_INFINITY)
    done = child(FULL, campaign, endpoint, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, limit))
    assert done.stderr == ""
    cut = next((campaign / "interrupted").glob("002_friction_*.csv"))
    rows = len(read_log(cut, 2))
    assert done.stdout.startswith(f"2 {cut}: recording stopped (")
    assert f"{rows} rows are in {cut}; 1 of 4 stages are recorded; the same command goes on" in done.stdout
    assert 0.8 * room < cut.stat().st_size <= room
    result = run_campaign(campaign, endpoint, options=FAST, speed=SPEED)
    assert [stage.number for stage in result.stages] == [1, 2, 3, 4]
    assert len(list((campaign / "logs").iterdir())) == 4
    assert len(read_log(cut, 2)) == rows
