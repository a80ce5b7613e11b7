"""The timetable, the heat, the temperatures, and what is kept of them in files."""

from __future__ import annotations

import dataclasses
import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import oed
from oed.campaigns import Campaign, Programme, friction_power
from oed.experiments import Design
from oed.reports import Page, campaign_page
from robots.common.errors import InfeasibleError, InputError
from robots.common.files import sha256
from robots.robot import Robot

pytestmark = pytest.mark.slow


def test_the_default_is_that_of_the_thesis(thesis_campaign: Campaign) -> None:
    """24 cycles of 5 min at 4 ms, without gaps: 2 h and 1.8 million samples."""
    assert thesis_campaign.duration == pytest.approx(7200.0, abs=1e-6)
    assert thesis_campaign.cycles == 24
    assert thesis_campaign.samples == 1_800_000
    for cycle in range(24):
        slots = [slot for slot in thesis_campaign.slots if slot.cycle == cycle + 1]
        assert [slot.stage for slot in slots] == ["excitation", "friction", "warm_up_100"]
        assert slots[0].start == pytest.approx(300.0 * cycle, abs=1e-6)
        assert slots[-1].end == pytest.approx(300.0 * (cycle + 1), abs=1e-6)


def test_the_timetable_has_no_gaps_and_files_of_the_right_length(small_campaign: Campaign) -> None:
    """Each line begins where the one before ends, and a file of N samples takes N periods."""
    stages, before = small_campaign.stages_by_name, 0.0
    for slot in small_campaign.slots:
        assert slot.start == pytest.approx(before, abs=1e-9)
        before = slot.end
        if slot.stage is not None:
            assert slot.duration == pytest.approx(0.004 * len(stages[slot.stage].motion), abs=1e-9)


def test_runs_follow_one_another(small_campaign: Campaign) -> None:
    """After the power-on test each duty cycle has its run of heating cycles and its cooling test."""
    phases = list(dict.fromkeys((slot.run, slot.phase, slot.duty) for slot in small_campaign.slots))
    assert phases == [
        (0, "power_on", None),
        (1, "heating", 0.2),
        (1, "cooling", None),
        (2, "heating", 1.0),
        (2, "cooling", None),
    ]


def test_a_cooling_test_sweeps_once_a_cycle_and_rests(small_campaign: Campaign) -> None:
    """In a cooling test each cycle is one friction stage and rest."""
    cooling = [slot for slot in small_campaign.slots if slot.phase == "cooling"]
    assert [slot.stage for slot in cooling] == ["friction", None] * 4
    starts = [slot.start for slot in cooling if slot.stage and slot.run == 1]
    assert starts[1] - starts[0] == pytest.approx(80.0, abs=1e-6)


def test_the_friction_stage_gives_way_first(thesis_campaign: Campaign) -> None:
    """What does not fit into 5 min costs the friction stage its time at each speed, not the warm-up, and is said."""
    assert any("friction stage was shortened" in note for note in thesis_campaign.notes)
    assert thesis_campaign.stages_by_name["warm_up_100"].duration > 180.0


def test_then_the_warm_up_gives_way(two: Robot, two_design: Design) -> None:
    """Where that is not enough, the warm-up is shortened, and it is said; the cycle keeps its time."""
    friction = oed.campaign(two, programme=Programme(cycles=0, cooling=1, plateau=0.3)).stages[0]
    cycle = float(np.ceil(len(two_design.motion) * 0.004 + friction.duration + 30.0))
    made = oed.campaign(two, design=two_design, programme=Programme(cycles=1, cycle_time=cycle, warm_up=40.0))
    assert any("warm-up was shortened" in note for note in made.notes)
    assert made.duration == pytest.approx(cycle, abs=1e-9)
    assert made.slots[-1].stage == "warm_up_100"


def test_a_cycle_without_room_is_infeasible(two: Robot, two_design: Design) -> None:
    """A cycle in which not half of the warm-up is left is refused with the time that would do."""
    with pytest.raises(InfeasibleError, match="too short") as reported:
        oed.campaign(two, design=two_design, programme=Programme(cycle_time=40.0, warm_up=39.0))
    assert reported.value.allowed is not None
    needed = float(reported.value.allowed.split()[0])
    assert oed.campaign(
        two, design=two_design, programme=Programme(cycles=1, cycle_time=np.ceil(needed), warm_up=39.0)
    ).success


def test_much_time_left_over_is_rest(two: Robot, two_design: Design) -> None:
    """In a cycle that is longer than its stages the robot rests at home until the next."""
    made = oed.campaign(two, design=two_design, programme=Programme(cycles=1, cycle_time=300.0, warm_up=30.0))
    assert made.slots[-1].stage is None
    assert made.duration == pytest.approx(300.0)


def test_heat_is_the_work_of_friction(small_campaign: Campaign, two: Robot) -> None:
    """Heat is friction torque times speed over time: on the constant speeds f1 v + f2 v^2 + f3 v^3 + f4 v^4."""
    v = 1.7
    expected = [4.0 * v + 3.0 * v**2 + 0.5 * v**3 + 0.1 * v**4, 3.0 * v + 2.0 * v**2]
    np.testing.assert_allclose(friction_power(two, [[v, -v]])[0], expected, rtol=1e-12)
    for stage in small_campaign.stages:
        power = friction_power(two, stage.motion.dq)
        # The rule of the rectangles differs from that of the trapezoids by the ends, where the robot rests.
        whole = np.trapezoid(power, stage.motion.t, axis=0)
        np.testing.assert_allclose(small_campaign.heat[stage.name], whole, rtol=1e-9, atol=1e-9)
    total = sum(small_campaign.heat[slot.stage] for slot in small_campaign.slots if slot.stage)
    np.testing.assert_allclose(small_campaign.cycle_heat.sum(axis=0), total, rtol=1e-12)


def test_temperatures_rise_in_heating_and_fall_in_cooling(er3a: Robot, er3a_design: Design) -> None:
    """Expected temperatures start at the surroundings', rise over the heating cycles and fall in the cooling test."""
    made = oed.campaign(
        er3a, design=er3a_design, programme=Programme(cycles=4, cooling=3), ambient=25.0, collision=False
    )
    assert made.temperatures is not None
    T1, T2 = made.temperatures.at([0.0, 300.0, 1200.0, 2100.0])
    np.testing.assert_allclose(T1[0], 25.0)
    np.testing.assert_allclose(T2[0], 25.0)
    assert np.all(np.diff(T2[:3], axis=0) > 0.0)
    assert np.all(T1[2] > T1[1])
    assert np.all(T1[3] < T1[2])


def test_binning_does_not_change_the_temperatures(thesis_campaign: Campaign) -> None:
    """Averaging the power over 5 s leaves the expected temperatures as they are with the power of every 0.1 s."""
    made, (model, *_) = thesis_campaign, thesis_campaign.thermal.models
    power = np.concatenate(
        [
            friction_power(made.robot, made.stages_by_name[slot.stage].motion.dq)[:, 0]
            for slot in made.slots
            if slot.cycle == 1
        ]
    )
    fine = model.temperatures(power.reshape(-1, 25).mean(axis=1), 0.1)[-1]
    # The power within 5 s is spread over time by less than the fast time constant's fortieth.
    np.testing.assert_allclose([v[0, 0] for v in made.temperatures.at([300.0])], fine, rtol=0, atol=0.1)


def test_a_cold_robot_gets_hotter(thesis_campaign: Campaign) -> None:
    """Friction of the cold robot above that of the description raises the expected temperatures."""
    cold = dataclasses.replace(thesis_campaign, cold_friction=1.5)
    assert np.all(cold.temperatures.T1.max(axis=0) > thesis_campaign.temperatures.T1.max(axis=0))


def test_a_robot_without_thermal_model_has_no_temperatures(small_campaign: Campaign) -> None:
    """Where nothing is known, nothing is expected, and it is said."""
    assert small_campaign.temperatures is None
    assert any("No thermal model" in note for note in small_campaign.notes)
    assert small_campaign.plot().get_ylabel() == "friction heat [kJ]"


def test_the_file_lists_what_runs_when(saved: Path, thesis_campaign: Campaign) -> None:
    """campaign.json has the timetable with files, and the digest of every file."""
    data = json.loads((saved / "campaign.json").read_text(), parse_constant=lambda name: pytest.fail(name))
    assert data["robot"]["name"] == "er3a"
    assert data["tool_version"]
    assert [row["file"] for row in data["timetable"][:3]] == ["excitation.csv", "friction.csv", "warm_up_100.csv"]
    for stage in data["stages"]:
        assert stage["sha256"] == sha256(saved / stage["file"])
    assert len(data["temperatures"]["T1"]) == len(data["timetable"]) + 1
    assert "thesis" in data["temperatures"]["sources"][3]
    assert np.sum(data["heat"]["per_cycle"]) == pytest.approx(np.sum(data["heat"]["total"]))


def test_a_saved_campaign_is_read_back(saved: Path, thesis_campaign: Campaign, er3a: Robot) -> None:
    """What is loaded says the same as what was saved, and checks itself anew."""
    loaded = Campaign.load(saved)
    assert loaded.to_dict() == thesis_campaign.to_dict()
    assert loaded.summary() == thesis_campaign.summary()
    assert all(not stage.violated for stage in loaded.check())
    assert list(loaded.to_frame().columns)[:3] == ["start", "end", "stage"]


def test_a_changed_file_is_refused(saved: Path, tmp_path: Path) -> None:
    """A stage that is not the one that was written, a broken file, and another robot are bad input."""
    folder = tmp_path / "copy"
    shutil.copytree(saved, folder)
    with (folder / "friction.csv").open("a") as stream:
        stream.write("\n")
    with pytest.raises(InputError, match=r"friction\.csv"):
        Campaign.load(folder)
    (folder / "campaign.json").write_text("{}")
    with pytest.raises(InputError, match="is not a campaign file"):
        Campaign.load(folder)


def test_a_design_is_read_from_its_folder(er3a: Robot, er3a_design: Design, tmp_path: Path) -> None:
    """A saved design is the excitation stage; one for another robot is refused, one for another description noted."""
    er3a_design.save(tmp_path)
    options = {"design": tmp_path, "programme": Programme(cycles=1), "collision": False}
    made = oed.campaign(er3a, **options)
    np.testing.assert_array_equal(made.stages_by_name["excitation"].motion.q, er3a_design.motion.q)
    other = dataclasses.replace(er3a, digest="0" * 64)
    assert any("another description" in n for n in oed.campaign(other, **options).notes)
    with pytest.raises(InputError, match="for er3a, not for ur10"):
        oed.campaign(dataclasses.replace(er3a, name="ur10"), design=tmp_path)
    with pytest.raises(InputError, match=r"design\.json"):
        oed.campaign(er3a, design=tmp_path / "nowhere")


def test_a_design_beyond_the_limits_is_refused(er3a: Robot, er3a_design: Design) -> None:
    """An excitation that passes a limit of this robot is refused with joint and number."""
    slow = dataclasses.replace(er3a, limits=er3a.limits.scaled(velocity=0.5))
    with pytest.raises(InfeasibleError, match="excitation stage exceeds the velocity limit"):
        oed.campaign(slow, design=er3a_design)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"cycles": -1}, "cycles"),
        ({"cycles": 0}, "empty"),
        ({"cycles": 2.5}, "cycles"),
        ({"cooling": -1}, "cooling"),
        ({"cycle_time": 0.0}, "cycle_time"),
        ({"cycle_time": np.nan}, "cycle_time"),
        ({"warm_up": 300.0}, "does not fit"),
        ({"warm_up_range": 1.1}, "warm_up_range"),
        ({"duties": ()}, "duties"),
        ({"duties": (0.0,)}, "duties"),
        ({"duties": (1.2,)}, "duties"),
        ({"duties": (0.5, 0.5)}, "each once"),
        ({"power_on": -1.0}, "power_on"),
        ({"plateau": 0.0}, "plateau"),
        ({"levels": (0.0, 1.0)}, "levels"),
        ({"cycles": 10_000}, "the campaign lasts"),
    ],
)
def test_a_bad_programme_is_refused(change: dict[str, object], match: str) -> None:
    """Numbers out of range are bad input that names them."""
    with pytest.raises(InputError, match=match):
        Programme(**change)


def test_bad_options_are_refused(two: Robot) -> None:
    """A period that is no multiple of the controller's, margins and temperatures out of range are bad input."""
    cooling = Programme(cycles=0, cooling=1)
    with pytest.raises(InputError, match="multiple"):
        oed.campaign(two, programme=dataclasses.replace(cooling, cycle_time=300.001))
    for option in ({"torque_margin": 1.0}, {"ambient": np.nan}, {"cold_friction": 0.0}, {"velocity_fraction": 1.1}):
        with pytest.raises(InputError, match=r"margin|ambient|cold_friction|velocity fraction"):
            oed.campaign(two, programme=cooling, **option)
    stuck = dataclasses.replace(two, limits=dataclasses.replace(two.limits, velocity=np.array([2.0, 0.0])))
    with pytest.raises(InfeasibleError) as reported:
        oed.campaign(stuck, programme=cooling)
    assert reported.value.joint == 2


@pytest.mark.slow
def test_page_works_in_a_browser(small_campaign: Campaign, in_browser: Callable[[Page], None]) -> None:
    """The page passes all checks of `browser_checks`."""
    in_browser(campaign_page(small_campaign))
