"""Drives identified from MuJoCo's motion, without torque."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from benchmarks.actuators_parts.plants import random_truth
from estimation.actuators import (
    ActuatorOptions,
    Actuators,
    LoopDiagnosis,
    identify_actuators,
    load_actuators,
    loop_diagnosis,
)
from estimation.actuators.exports import drives_mjcf, expressible, isaac_lab_text, newton_text
from robots.common.errors import InputError, NotIdentifiableError
from robots.drives import Drive
from tests.estimation.actuators.conftest import LEG, Played, played

pytestmark = pytest.mark.slow


def test_values_are_the_plants(leg: Played, identified: Actuators) -> None:
    """Delay within 0.1 ms, rotor inertia and friction within 5 %, and no error beyond the encoder's."""
    truth = leg.truth
    assert identified.success
    assert identified.value("delay", "hip_joint").value == pytest.approx(truth.delay, abs=1e-4)
    for name, true in (("armature", truth.armature), ("viscous", truth.viscous), ("coulomb", truth.coulomb)):
        for j, joint in enumerate(identified.joints):
            assert identified.value(name, joint).value == pytest.approx(true[j], rel=0.05), f"{name} {joint}"
    # The encoder's steps make an error of step / sqrt(12); MuJoCo's soft friction adds as much at most.
    assert identified.held_out_error < 2 * LEG.encoder / np.sqrt(12)
    assert identified.described_error > 20 * identified.held_out_error


def test_a_motion_that_no_drive_explains_is_unexplained(leg: Played, identified: Actuators) -> None:
    """A joint that swings by itself is named: the simulation misses a fifth of what it does beside the command."""
    assert not identified.unexplained
    swing = np.zeros(leg.log.q.shape)
    swing[:, 1] = 0.1 * np.sin(2 * np.pi * 0.9 * leg.log.t)
    swung = replace(leg.log, q=leg.log.q + swing)
    result = identify_actuators(leg.chains, swung, leg.drives, options=ActuatorOptions(effects=False))
    assert [error.name for error in result.unexplained] == [result.joints[1]]
    assert loop_diagnosis(result).verdict == "unexplained"


def test_intervals_hold_the_truth(leg: Played, identified: Actuators) -> None:
    """Most 95 % intervals hold the plant's values: at least ten of thirteen, which fails by chance once in 600."""
    truth = {"armature": leg.truth.armature, "viscous": leg.truth.viscous, "coulomb": leg.truth.coulomb}
    held = 0
    for value in identified.parameters:
        j = identified.joints.index(value.joints[0])
        true = leg.truth.delay if value.parameter == "delay" else truth.get(value.parameter, np.zeros(3))[j]
        held += value.lower <= true <= value.upper
    assert held >= 10


def test_unknown_gains_are_identified_by_the_masses(leg: Played) -> None:
    """Gains that nobody states follow from the described masses, and the result says what sets the scale."""
    drives = [drive.with_values({"kp": 30.0, "kd": 2.0}) for drive in leg.drives]
    result = identify_actuators(leg.chains, leg.log, drives, options=ActuatorOptions(free=("kp", "kd"), effects=False))
    for j, joint in enumerate(result.joints):
        assert result.value("kp", joint).value == pytest.approx(LEG.kp[j], rel=0.03)
    # Viscous friction and the law's damping brake alike: only their sum is known.
    damping = result.value("kd", "calf_joint")
    assert damping.status == "not determined"
    assert "viscous calf_joint" in damping.partners
    assert any("masses of the description set the scale" in note for note in result.notes)


def test_a_hidden_effect_is_named(tmp_path: Path) -> None:
    """Stribeck friction of one joint is found, with its size within a fifth; nothing else is."""
    truth = replace(random_truth(LEG, np.random.default_rng(5)), effect="stribeck", joint=1, size=0.4)
    case = played(tmp_path, truth)
    result = identify_actuators(case.chains, case.log, case.drives, held_out=case.held_out)
    assert [(finding.effect, finding.name) for finding in result.findings] == [("stribeck", "thigh_joint")]
    assert result.value("stribeck", "thigh_joint").value == pytest.approx(0.4, rel=0.2)
    # Three times the error of the encoder's steps: without the effect it is fifty times as large.
    assert result.held_out_error < 3 * LEG.encoder / np.sqrt(12)


@pytest.mark.parametrize(
    ("effect", "size", "notes"),
    [
        ("joint_elasticity", 160.0, {"gear_damping": 0.2}),
        ("backlash", 0.02, {"gear_damping": 0.06, "stiffness": 400.0}),
    ],
)
def test_a_gear_is_named(tmp_path: Path, effect: str, size: float, notes: dict[str, float]) -> None:
    """An elastic gear or play of one joint is found, with its size; the diagnosis says the same."""
    truth = replace(random_truth(LEG, np.random.default_rng(5)), effect=effect, joint=1, size=size, notes=notes)
    case = played(tmp_path, truth)
    result = identify_actuators(case.chains, case.log, case.drives, held_out=case.held_out)
    assert [(finding.effect, finding.name) for finding in result.findings] == [(effect, "thigh_joint")]
    name = "stiffness" if effect == "joint_elasticity" else "backlash"
    assert result.value(name, "thigh_joint").value == pytest.approx(size, rel=0.1)
    diagnosis = loop_diagnosis(result)
    assert (diagnosis.verdict, diagnosis.findings[0].joint) == ("named", 2)
    assert LoopDiagnosis.from_dict(diagnosis.to_dict()).summary() == diagnosis.summary()
    assert any(name in text for text in expressible(result).left_out for name in ("elastic gear", "backlash"))


def test_shared_parameters_are_one(leg: Played) -> None:
    """Joints of one class have one value each of rotor inertia and friction."""
    options = ActuatorOptions(share=("hip", "thigh"), effects=False)
    result = identify_actuators(leg.chains, leg.log, leg.drives, options=options)
    armature = [value for value in result.parameters if value.parameter == "armature"]
    assert [value.group for value in armature] == ["hip", "thigh", "calf_joint"]
    with pytest.raises(InputError, match="no joint's name contains 'knee'"):
        identify_actuators(leg.chains, leg.log, leg.drives, options=ActuatorOptions(share=("knee",)))


def test_the_written_mjcf_moves_as_the_report_says(leg: Played, identified: Actuators, tmp_path: Path) -> None:
    """MuJoCo's own simulation of the written file errs by what the result says, within a tenth."""
    text = drives_mjcf(identified, tmp_path).text
    model = mujoco.MjModel.from_xml_string(text)
    data, log = mujoco.MjData(model), leg.held_out
    assert model.actuator_delay[0] == pytest.approx(identified.value("delay", "hip_joint").value)
    data.qpos[:] = log.q[0]
    q = np.empty_like(log.q)
    substeps = round(float(np.diff(log.t).mean()) / model.opt.timestep)
    for k, command in enumerate(log.command):
        q[k] = data.qpos
        data.ctrl[:] = command
        mujoco.mj_step(model, data, substeps)
    # MuJoCo's history of commands begins with zeros, and friction keeps the kick for a while.
    late = log.t > 1.0
    error = float(np.mean(np.sqrt(np.mean((q - log.q)[late] ** 2, axis=0))))
    assert error == pytest.approx(identified.written_error, rel=0.1)


def test_a_result_survives_its_file(identified: Actuators, tmp_path: Path) -> None:
    """A saved result reads back with the same summary, table and motion."""
    identified.save(tmp_path)
    again = load_actuators(tmp_path)
    assert again.summary() == identified.summary()
    assert again.to_frame().equals(identified.to_frame())
    assert np.array_equal(again.traces[0].identified, identified.traces[0].identified)
    with pytest.raises(InputError):
        identified.save(tmp_path)
    (tmp_path / "other.json").write_text("{}")
    with pytest.raises(InputError, match="is not an actuators file"):
        load_actuators(tmp_path / "other.json")


def test_configurations_hold_the_values(identified: Actuators) -> None:
    """The files of Isaac Lab and Newton state the identified numbers; the first is Python that compiles."""
    text = isaac_lab_text(identified)
    compile(text, "isaac_lab.py", "exec")
    assert f"'calf_joint': {identified.value('armature', 'calf_joint').value:.6g}" in text
    assert repr(identified.value("coulomb", "hip_joint").value) in newton_text(identified)


def test_a_plot_is_drawn(identified: Actuators) -> None:
    """A result draws two bars a joint."""
    assert len(identified.plot().patches) == 2 * len(identified.joints)


def test_constant_commands_are_refused(leg: Played) -> None:
    """A command that does not change identifies nothing."""
    still = replace(leg.log, command=np.tile(leg.log.command[0], (len(leg.log), 1)))
    with pytest.raises(NotIdentifiableError, match="does not change"):
        identify_actuators(leg.chains, still, leg.drives)


def test_an_unknown_parameter_is_named(leg: Played) -> None:
    """A free parameter that no drive has is refused with those that exist."""
    with pytest.raises(InputError, match=r"no drive has a parameter 'mass'; allowed: .*armature"):
        identify_actuators(leg.chains, leg.log, leg.drives, options=ActuatorOptions(free=("mass",)))
    with pytest.raises(InputError, match="2 drives; allowed: 3"):
        identify_actuators(leg.chains, leg.log, [Drive.usual(d.members[1]) for d in leg.drives[:2]])
