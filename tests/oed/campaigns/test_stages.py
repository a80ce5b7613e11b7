"""Every stage can be played: within all limits by its file's own numbers, and from rest at home to rest at home."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

import oed
from oed.campaigns import Campaign, Programme, friction_power
from oed.experiments.safety_checks.freedom import is_free
from oed.exports import read_trajectory
from oed.exports.trajectory_checks import stated_collisions
from robots.common.errors import InfeasibleError
from robots.plants import nominal_plant
from robots.robot import Robot

pytestmark = pytest.mark.slow

STAGES = ("excitation", "friction", "warm_up_100")


@pytest.mark.parametrize("name", STAGES)
def test_every_file_keeps_all_limits(saved: Path, er3a: Robot, name: str) -> None:
    """The numbers of each CSV keep position, velocity and acceleration, jerk at 250 Hz, and torque with its margin."""
    motion, _ = read_trajectory(saved / f"{name}.csv", n=6)
    limits = er3a.limits
    assert motion.period == pytest.approx(0.004, abs=1e-12)
    assert np.all((motion.q >= limits.lower) & (motion.q <= limits.upper))
    assert np.all(np.abs(motion.dq) <= limits.velocity)
    assert np.all(np.abs(motion.ddq) <= limits.acceleration)
    assert np.all(np.abs(np.diff(motion.ddq, axis=0)) / 0.004 <= limits.jerk)
    plant = nominal_plant(er3a)
    tau = plant.model.torque(motion.q, motion.dq, motion.ddq, plant.parameters)
    assert np.all(np.abs(tau) <= 0.9 * limits.torque * (1 + 1e-9))


def test_every_file_states_its_check_for_collisions(saved: Path, thesis_campaign: Campaign) -> None:
    """A file of a stage says what `stream` and the exports must know: whether its motion was proved free."""
    for stage in thesis_campaign.stages:
        text, free = stated_collisions(read_trajectory(saved / stage.file)[1])
        assert free == is_free(stage.freedom), text
        assert "NOT CHECKED" not in text


@pytest.mark.parametrize("name", STAGES)
def test_every_file_begins_and_ends_at_rest_at_home(saved: Path, name: str) -> None:
    """All stages begin and end at the same pose without speed or acceleration, so that they play in any order."""
    home = json.loads((saved / "campaign.json").read_text())["home"]
    motion, _ = read_trajectory(saved / f"{name}.csv", n=6)
    for row in (0, -1):
        np.testing.assert_allclose(motion.q[row], home, rtol=0, atol=1e-9)
        np.testing.assert_allclose(motion.dq[row], 0.0, atol=1e-7)
        np.testing.assert_allclose(motion.ddq[row], 0.0, atol=1e-5)


def test_the_friction_stage_drives_every_level_both_ways(thesis_campaign: Campaign, er3a: Robot) -> None:
    """Each joint moves alone at 5, 20, 40, 60, 80 and 100 % of its speed both ways, for equal times."""
    stage = thesis_campaign.stages_by_name["friction"]
    t, dq = stage.motion.t, stage.motion.dq
    for joint in range(6):
        own = [p for p in stage.plateaus if p["joint"] == joint + 1]
        shares = sorted(round(100 * p["speed"] / er3a.limits.velocity[joint]) for p in own)
        assert shares == [-100, -80, -60, -40, -20, -5, 5, 20, 40, 60, 80, 100]
        times = [p["end"] - p["start"] for p in own]
        np.testing.assert_allclose(times, times[0], atol=1e-6)
        for plateau in own:
            inside = (t > plateau["start"] + 1e-6) & (t < plateau["end"] - 1e-6)
            assert inside.sum() * 0.004 > 0.3 - 0.01
            np.testing.assert_allclose(dq[inside, joint], plateau["speed"], rtol=1e-9)
            assert not np.any(np.delete(dq[inside], joint, axis=1))


def test_gravity_does_no_work_on_the_joints_of_the_thesis(thesis_campaign: Campaign, er3a: Robot) -> None:
    """Joints 1, 4, 5 and 6 are swept with vertical axes (thesis section 2.4): their gravity torque stays the same."""
    stage = thesis_campaign.stages_by_name["friction"]
    angles = stage.details["angle_to_no_gravity_deg"]
    assert [angle < 0.01 for angle in angles] == [True, False, False, True, True, True]
    plant = nominal_plant(er3a)
    still = np.zeros((1, 6))
    for joint in (1, 4, 5, 6):
        (segment,) = [s for s in stage.segments if s["kind"] == "friction" and s["joint"] == joint]
        rows = (stage.motion.t >= segment["start"]) & (stage.motion.t <= segment["end"])
        q = stage.motion.q[rows][::50]
        tau = plant.model.torque(q, still.repeat(len(q), 0), still.repeat(len(q), 0), plant.parameters)[:, joint - 1]
        # The angle that is left times the weight of a 27 kg arm.
        assert np.ptp(tau) < 1e-3


def test_the_warm_up_drives_80_percent_of_the_ranges_at_full_speed(thesis_campaign: Campaign, er3a: Robot) -> None:
    """In the warm-up all joints reach their speed and sweep 80 % of their ranges, where bodies allow, for 3 min."""
    stage = thesis_campaign.stages_by_name["warm_up_100"]
    (segment,) = [s for s in stage.segments if s["kind"] == "warm_up"]
    assert 180.0 <= segment["end"] - segment["start"] < 181.0
    inside = (stage.motion.t >= segment["start"]) & (stage.motion.t <= segment["end"])
    span = er3a.limits.upper - er3a.limits.lower
    parts = np.array(stage.details["ranges"])
    assert (parts <= 0.8 + 1e-9).all()
    # The shoulder and the elbow would bring the forearm into the base.
    np.testing.assert_allclose(parts[[0, 3, 4, 5]], 0.8)
    np.testing.assert_allclose(np.ptp(stage.motion.q[inside], axis=0), parts * span, rtol=2e-3)
    np.testing.assert_allclose(np.abs(stage.motion.dq[inside]).max(axis=0), er3a.limits.velocity, rtol=2e-3)


def test_duty_cycles_move_for_their_share_of_the_time(small_campaign: Campaign) -> None:
    """A duty cycle of 20 % leaves the joints at rest for most of the warm-up, in a file as long as the others."""
    stages = small_campaign.stages_by_name
    low, full = stages["warm_up_20"], stages["warm_up_100"]
    assert len(low.motion) == len(full.motion)
    moving = [np.mean(np.abs(stage.motion.dq).max(axis=1) > 1e-9) for stage in (low, full)]
    assert moving[0] < 0.4
    assert moving[1] > 0.9


def test_power_on_holds_home(small_campaign: Campaign) -> None:
    """The power-on test has a stage of its own that holds home with the motors on."""
    stage = small_campaign.stages_by_name["power_on"]
    assert not np.any(stage.motion.dq)
    assert np.all(stage.motion.q == small_campaign.home)
    played = [slot for slot in small_campaign.slots if slot.stage == "power_on"]
    assert sum(slot.duration for slot in played) == pytest.approx(100.0, abs=0.01)


def test_torque_limits_soften_the_accelerations(two: Robot) -> None:
    """Where full acceleration passes a torque limit, stages accelerate less, reach the same speeds, and it is said."""
    programme = Programme(cycles=0, cooling=1, plateau=0.3)
    (free,) = oed.campaign(two, programme=programme).stages
    peak = next(abs(m.value) for m in free.margins if m.quantity == "torque" and m.joint == 1)
    # What full speed takes of friction is there at any acceleration.
    steady = float(friction_power(two, [[2.0, 0.0]])[0, 0]) / 2.0
    torque = np.array([(peak + steady) / 2.0, 200.0])
    weak = dataclasses.replace(two, limits=dataclasses.replace(two.limits, torque=torque))
    made = oed.campaign(weak, programme=programme, torque_margin=0.0)
    (stage,) = made.stages
    assert stage.details["acceleration_share"] < 1.0
    assert any("of the acceleration limits" in note for note in made.notes)
    assert np.abs(stage.motion.dq).max() == pytest.approx(2.0, rel=1e-3)
    assert made.success


def test_a_torque_limit_that_no_motion_keeps_is_infeasible(two: Robot) -> None:
    """A joint that cannot even overcome its friction at full speed is named."""
    weak = dataclasses.replace(two, limits=dataclasses.replace(two.limits, torque=np.array([5.0, 60.0])))
    with pytest.raises(InfeasibleError, match="even with low accelerations") as reported:
        oed.campaign(weak, programme=Programme(cycles=0, cooling=1))
    assert reported.value.joint == 1
