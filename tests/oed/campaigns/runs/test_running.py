"""A campaign that is played on a controller of this computer."""

from __future__ import annotations

import sys
from collections import namedtuple
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from estimation import read_log
from oed.campaigns import Campaign
from oed.campaigns.runs import run_campaign, running
from oed.campaigns.runs.state import run_lock
from oed.controllers import ControllerError, ControllerOptions, Endpoint, LinkError, StreamOptions, VirtualController
from oed.controllers.drivers import DRIVERS
from oed.exports import read_trajectory
from robots.common.errors import InputError
from robots.robot import Robot
from tests.oed.campaigns.runs.conftest import FAST, NOWHERE, SPEED


@pytest.mark.slow
def test_rests_and_progress(campaign: Path, endpoint: Endpoint) -> None:
    """Cycles last their time on the controller's clock, and the progress counts the seconds of the timetable."""
    seen: list[float] = []

    class Listener:
        def start(self, task: str, total: float | None = None) -> None:
            self.total = total

        def update(self, done: float, note: str = "") -> None:
            seen.append(done)

        def finish(self) -> None:
            seen.append(float("nan"))

    listener = Listener()
    result = run_campaign(campaign, endpoint, options=FAST, speed=SPEED, progress=listener)
    assert [stage.stage for stage in result.stages] == ["power_on", "friction", "friction", "friction"]
    slots = [slot for slot in Campaign.load(campaign).slots if slot.stage is not None]
    assert listener.total == pytest.approx(slots[-1].end - slots[0].start)
    assert seen[-2] == pytest.approx(listener.total)
    assert (np.diff(seen[:-1]) >= 0).all()
    ends = [stage.end.t for stage in result.stages[1:]]
    # A cycle is never shorter; how much longer it is depends on how busy this computer is.
    assert (np.diff(ends) > 12.0 - 2.0).all()
    again = run_campaign(campaign, NOWHERE)
    assert again.stages == result.stages


def test_a_folder_is_locked_on_windows_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without `fcntl` the lock is that of `msvcrt`, which raises OSError where another program has it."""
    held: list[int] = []

    def locking(number: int, mode: int, size: int) -> None:
        assert (mode, size) == (2, 1)
        if held:
            raise PermissionError(13, "Permission denied")
        held.append(number)

    monkeypatch.setitem(sys.modules, "fcntl", None)
    monkeypatch.setitem(sys.modules, "msvcrt", SimpleNamespace(locking=locking, LK_NBLCK=2))
    with run_lock(tmp_path, "runs"):
        second = run_lock(tmp_path, "runs")
        with pytest.raises(InputError, match="another program runs in this folder"):
            second.__enter__()
    assert len(held) == 1


def test_what_is_refused(campaign: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No controller, a second program, a full disk, other logs and a changed plan are one message each."""
    with pytest.raises(LinkError, match=r"nothing listens.*0 of 4 stages are recorded; the same command goes on"):
        run_campaign(campaign, NOWHERE)
    with run_lock(campaign, "plays this campaign"), pytest.raises(InputError, match="another program plays"):
        run_campaign(campaign, NOWHERE)
    with monkeypatch.context() as patch:
        usage = namedtuple("usage", "free")
        patch.setattr(running.shutil, "disk_usage", lambda _: usage(1000))
        with pytest.raises(InputError, match=r"may need \d+ MB, the disk has 0 MB"):
            run_campaign(campaign, NOWHERE)
    with pytest.raises(InputError, match="a speed of 0"):
        run_campaign(campaign, NOWHERE, speed=0.0)
    plan = campaign / "campaign.json"
    plan.write_text(plan.read_text().replace('"notes": [', '"notes": ["another one",'))
    with pytest.raises(InputError, match="planned again"):
        run_campaign(campaign, NOWHERE)
    (campaign / "run.json").write_text("{}")
    with pytest.raises(InputError, match="not a campaign run file"):
        run_campaign(campaign, NOWHERE)
    (campaign / "run.json").unlink()
    (campaign / "logs").mkdir(exist_ok=True)
    (campaign / "logs" / "other.csv").write_text("t\n")
    with pytest.raises(InputError, match="holds other logs"):
        run_campaign(campaign, NOWHERE)
    with pytest.raises(InputError, match="no such file"):
        run_campaign(tmp_path / "nothing", NOWHERE)


@pytest.mark.slow
def test_start_elsewhere(campaign: Path, two: Robot) -> None:
    """At its first start a run does not move a robot that stands elsewhere; after an interruption it moves it home."""
    home = read_trajectory(campaign / "friction.csv")[0].q[0]
    options = ControllerOptions(transport="tcp", motion_port=0, state_port=0, speed=SPEED, wait_for_points=True)
    with VirtualController(two, options=options, pose=home + 0.2) as controller:
        place = Endpoint(
            host="127.0.0.1",
            transport="tcp",
            motion_port=controller.motion_port,
            state_port=controller.state_port,
        )
        with pytest.raises(InputError, match="move the robot to the start"):
            run_campaign(campaign, place, options=FAST, speed=SPEED)
        assert controller.points == 0
        run_campaign(campaign, place, options=FAST, speed=SPEED)
    moved = read_log(next((campaign / "interrupted").glob("*_home_1.csv")), 2)
    np.testing.assert_allclose(moved.q[-1], home, atol=1e-4)
    speed = np.abs(np.diff(moved.q, axis=0)).max() / 0.004
    assert speed < 0.2 * 2.0 + 0.01


@pytest.mark.slow
def test_buffer_that_never_empties(campaign: Path, two: Robot) -> None:
    """A controller that plays nothing ends the run with its reason, and says how far the run came."""
    from oed.controllers import Faults

    home = read_trajectory(campaign / "friction.csv")[0].q[0]
    options = ControllerOptions(motion_port=0, state_port=0, faults=Faults(stuck=True))
    with VirtualController(two, options=options, pose=home) as controller:
        place = Endpoint(host="127.0.0.1", motion_port=controller.motion_port, state_port=controller.state_port)
        with pytest.raises(ControllerError, match=r"takes no points.*0 of 4 stages are recorded"):
            run_campaign(campaign, place, options=StreamOptions(patience=0.5))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["efort", "motoman"])
def test_campaigns_with_a_driver(name: str, campaign: Path, two: Robot) -> None:
    """A campaign opens one link after the other, also to a server that answers one handshake, and stops by command."""
    driver = DRIVERS[name]
    home = read_trajectory(campaign / "friction.csv")[0].q[0]
    options = ControllerOptions.of(
        driver, motion_port=0, state_port=0, feedback="torque", feedback_every=1, speed=5.0, wait_for_points=True
    )
    with VirtualController(two, options=options, pose=home) as controller:
        ports = {"motion_port": controller.motion_port, "state_port": controller.state_port}
        place = Endpoint.of(driver, "127.0.0.1", handshake_interval=0.1, **ports)
        result = run_campaign(campaign, place, options=StreamOptions.of(driver, patience=10.0, speed=5.0), speed=5.0)
    assert [stage.number for stage in result.stages] == [1, 2, 3, 4]
    assert len(list((campaign / "logs").iterdir())) == 4
