"""Elastic gears and backlash: two masses against MuJoCo's second hinge, closed forms, and gains files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from benchmarks.actuators_parts.plants import MACHINES, Truth, mjcf, multisine, play, random_truth
from robots.common.errors import InputError
from robots.drives import (
    Backlash,
    Drive,
    DriveDynamics,
    ElasticGear,
    HeldCommand,
    PdLaw,
    ServoLaw,
    Start,
    described_drives,
    load_branches,
    simulate_drives,
)
from robots.robot import Robot

LEG = replace(MACHINES["leg"](), encoder=1e-12)
CASES = {
    "joint_elasticity": (150.0, {"gear_damping": 0.3}, ElasticGear()),
    "backlash": (0.03, {"gear_damping": 0.05, "stiffness": 400.0}, Backlash()),
}


@pytest.fixture(scope="module")
def leg(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    """A leg of three joints, from an MJCF."""
    path = tmp_path_factory.mktemp("leg") / "leg.xml"
    path.write_text(mjcf(LEG))
    return load_branches(path)[0]


def plant(effect: str) -> Truth:
    """A leg whose thigh has an elastic gear, or play."""
    size, notes, _ = CASES[effect]
    truth = random_truth(LEG, np.random.default_rng(3))
    return replace(truth, effect=effect, joint=1, size=size, notes=notes)


def drives_of(truth: Truth, encoder: Literal["motor", "link"] = "motor") -> list[Drive]:
    """The drives of that leg as it is; by an encoder on the link, servos that the motor's velocity damps."""
    drives = [
        Drive.usual(
            PdLaw() if encoder == "motor" else ServoLaw(),
            encoder=encoder,
            values={
                "kp": LEG.kp[j],
                "kd": LEG.kd[j],
                "armature": truth.armature[j],
                "viscous": truth.viscous[j],
                "coulomb": truth.coulomb[j],
                "delay": truth.delay,
            },
        )
        for j in range(LEG.n)
    ]
    size, notes, gear = CASES[truth.effect]
    values = {"stiffness": notes.get("stiffness", size), "gear_damping": notes["gear_damping"]}
    values |= {"backlash": size} if truth.effect == "backlash" else {}
    drives[1] = drives[1].with_gear(gear).with_values(values)
    return drives


@pytest.mark.slow
@pytest.mark.parametrize("effect", CASES)
def test_two_masses_move_as_mujocos(leg: Robot, effect: str) -> None:
    """The motors' motion is MuJoCo's to 0.05 mrad; with rigid gears it is ten times as far away."""
    truth = plant(effect)
    t, command = multisine(LEG, 2.0, np.random.default_rng(4))
    measured = play(LEG, truth, t, command)
    dynamics = DriveDynamics(leg, drives_of(truth))
    rigid = DriveDynamics(leg, [drive.with_gear(None) for drive in drives_of(truth)])
    held, start = HeldCommand(t, command), Start(command[0], np.zeros(3))
    # The first half second is MuJoCo's settling under gravity.
    errors = [
        np.sqrt(np.mean((simulate_drives(d, held, t, start, d.values).measured - measured)[500:, 1] ** 2))
        for d in (dynamics, rigid)
    ]
    assert errors[0] < 5e-5
    assert errors[1] > 10 * errors[0]


@pytest.mark.slow
@pytest.mark.parametrize("effect", CASES)
@pytest.mark.parametrize("encoder", ["motor", "link"])
def test_sensitivities_are_derivatives(leg: Robot, effect: str, encoder: Literal["motor", "link"]) -> None:
    """Derivatives by the gear's and other parameters agree with central differences to 2 % of the largest."""
    dynamics = DriveDynamics(leg, drives_of(plant(effect), encoder))
    t, command = multisine(LEG, 1.0, np.random.default_rng(0), 0.002)
    held, start = HeldCommand(t, command), Start(command[0], np.zeros(3))
    steps = {"stiffness": 1e-2, "gear_damping": 1e-4, "armature": 1e-5, "encoder_zero": 1e-5, "mass_factor": 1e-4}
    steps |= {"backlash": 1e-6} if effect == "backlash" else {}
    for name, step in steps.items():
        direction = np.zeros((dynamics.size, 1))
        direction[dynamics.layout.of(name)] = 1.0
        found = simulate_drives(dynamics, held, t, start, dynamics.values, directions=direction)
        there, back = (
            simulate_drives(dynamics, held, t, start, dynamics.values + sign * step * direction[:, 0]).measured
            for sign in (1, -1)
        )
        difference = (there - back) / (2 * step)
        assert found.sensitivity is not None
        # Where a flank is reached or a joint starts to slip, a difference has a spike that a derivative has not.
        error = np.quantile(np.abs(found.sensitivity[:, :, 0] - difference), 0.95)
        assert error < 0.02 * np.abs(difference).max(), name


@pytest.mark.slow
def test_a_gap_holds_the_link_by_its_load(leg: Robot) -> None:
    """At rest the motor stands load / stiffness and half the gap away from the link, on the side of the load."""
    rest = []
    for encoder in ("motor", "link"):
        drives = [drive.with_values({"coulomb": 0.0}) for drive in drives_of(plant("backlash"), encoder)]
        dynamics = DriveDynamics(leg, drives)
        t = np.arange(0, 4.0, 0.004)
        command = np.tile(LEG.home, (len(t), 1))
        held, start = HeldCommand(t, command), Start(command[0], np.zeros(3))
        rest.append(simulate_drives(dynamics, held, t, start, dynamics.values, efforts=True))
    by_motor, by_link = rest
    assert by_motor.effort is not None
    assert by_link.effort is not None
    # The torque of the law is the load, as the motor has no friction.
    load = by_motor.effort[-1, 1]
    assert load == pytest.approx(LEG.kp[1] * (LEG.home[1] - by_motor.measured[-1, 1]))
    place = float(dynamics.twist(by_motor.measured[-1], np.append(dynamics.values, 1e-4), [])[0][0])
    assert place == pytest.approx(load / 400.0 + np.sign(load) * 0.03 / 2, rel=0.05)
    # An encoder on the link holds the link itself: the law's torque is as large, at the link's place.
    assert by_link.measured[-1, 1] == pytest.approx(LEG.home[1] - by_link.effort[-1, 1] / LEG.kp[1])
    assert by_link.effort[-1, 1] == pytest.approx(load, rel=0.05)


def test_a_drive_changes_its_gear() -> None:
    """A gear is put between motor and link and taken out again, and the other values stay."""
    drive = Drive.usual(PdLaw(), values={"kp": 7.0, "torque_offset": 0.2})
    parted = drive.with_gear(Backlash()).with_values({"backlash": 0.01})
    names = [member.name for member in parted.members]
    assert names.index("position_friction") < names.index("backlash") < names.index("offset")
    assert (parted.values["kp"], parted.values["torque_offset"]) == (7.0, 0.2)
    assert parted.with_gear(None).values == drive.values


@pytest.mark.parametrize(
    ("text", "gear"),
    [
        ("stiffness: 900\n", ElasticGear()),
        ("stiffness: 900\nbacklash: {thigh: 0.01, calf: 0.02}\n", Backlash()),
        ("", None),
    ],
)
def test_gains_files_state_gears(tmp_path: Path, text: str, gear: ElasticGear | None) -> None:
    """A stiffness makes a gear elastic, a backlash gives it a gap; a servo's encoder shows the link."""
    (tmp_path / "leg.xml").write_text(mjcf(LEG, laws=False))
    (tmp_path / "gains.yaml").write_text(f"law: servo\nkp: 20\nkd: 1\n{text}")
    chains = load_branches(tmp_path / "leg.xml")
    drive = described_drives(chains, tmp_path / "gains.yaml").drives[2]
    assert (drive.gear, drive.encoder) == (gear, "link")
    (tmp_path / "gains.yaml").write_text("law: pd\nkp: 20\nkd: 1\nbacklash: 0.1\n")
    with pytest.raises(InputError, match=r"gains.yaml: joint hip_joint: backlash without a stiffness"):
        described_drives(chains, tmp_path / "gains.yaml")
