"""What sets the scale without torque: currents and known payloads; and bases that move. MuJoCo is the oracle."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from benchmarks.actuators_parts.plants import STEP, mjcf, multisine, random_truth
from estimation.actuators import ActuatorOptions, identify_actuators
from estimation.actuators.base_motion import POSE, base_motion
from estimation.logs import read_log
from robots.common.errors import InputError
from robots.drives import Drive
from robots.signals import Log
from robots.terms.situations.flange_body import point_mass
from tests.estimation.actuators.conftest import LEG, Played

Array = NDArray[np.float64]

NO_EFFECTS = ActuatorOptions(effects=False)
HEAVIER = 1.3
"""Factor of the plant's masses on those described."""
CONSTANTS = np.array([0.5, 0.8, 1.1])
"""Torque constants of the plant [N m/A]."""


def rolled(text: str, t: Array, command: Array, delay: float) -> tuple[Array, Array, Array]:
    """Positions, torques of the actuators (N, 3), and the pose of the base (N, 7), of joints that come last."""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qpos[:] = model.qpos0
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    data.qpos[-3:] = command[0]
    substeps = round((t[1] - t[0]) / STEP)
    q, torque, pose = np.empty_like(command), np.empty_like(command), np.empty((len(t), 7))
    base = 1
    for k in range(len(t)):
        mujoco.mj_forward(model, data)
        q[k], torque[k] = data.qpos[-3:], data.actuator_force
        pose[k] = np.concatenate([data.xpos[base], data.xquat[base]])
        for s in range(substeps):
            at = max(int(np.floor((k * (t[1] - t[0]) + s * STEP - delay) / (t[1] - t[0]) + 1e-9)), 0)
            data.ctrl[:] = command[at]
            mujoco.mj_step(model, data)
    return np.round(q / LEG.encoder) * LEG.encoder, torque, pose


def heavier(payload: float = 0.0) -> str:
    """The plant: masses larger than described, and a point mass on the last link."""
    bodies = tuple(replace(b, mass=HEAVIER * b.mass, inertia=tuple(HEAVIER * x for x in b.inertia)) for b in LEG.bodies)
    text = mjcf(replace(LEG, bodies=bodies), random_truth(LEG, np.random.default_rng(5)))
    if not payload:
        return text
    carried = f'<body pos="0 0 -0.2"><inertial mass="{payload}" pos="0 0 0" diaginertia="1e-9 1e-9 1e-9"/></body>'
    last = text.rindex("<joint")
    end = text.index("/>", last) + 2
    return text[:end] + carried + text[end:]


def unknown_gains(leg: Played) -> list[Drive]:
    """Drives whose gains are guessed wrong."""
    return [drive.with_values({"kp": 30.0, "kd": 1.4}) for drive in leg.drives]


@pytest.mark.slow
def test_currents_set_the_scale(leg: Played) -> None:
    """With stated torque constants a current makes gains and masses known that the motion cannot tell apart."""
    t, command = multisine(LEG, 4.0, np.random.default_rng(1), 0.002)
    q, torque, _ = rolled(heavier(), t, command, 0.003)
    noise = 0.02 * np.random.default_rng(2).standard_normal(torque.shape)
    log = Log(t=t, q=q, command=command, current=torque / CONSTANTS + noise, name="run")
    free = replace(NO_EFFECTS, free=("kp", "mass_factor"))
    known = [d.with_values({"torque_constant": k}) for d, k in zip(unknown_gains(leg), CONSTANTS, strict=True)]
    known = [d.with_values({"kd": kd}) for d, kd in zip(known, LEG.kd, strict=True)]
    result = identify_actuators(leg.chains, log, known, options=free)
    for j, joint in enumerate(result.joints):
        assert result.value("kp", joint).value == pytest.approx(LEG.kp[j], rel=0.02)
    assert result.value("mass_factor", "thigh_joint").value == pytest.approx(HEAVIER, rel=0.03)
    assert any("stated torque constants set the scale" in note for note in result.notes)
    # The other way round: stated gains make the constants known.
    result = identify_actuators(leg.chains, log, leg.drives, options=NO_EFFECTS)
    for j, joint in enumerate(result.joints):
        assert result.value("torque_constant", joint).value == pytest.approx(CONSTANTS[j], rel=0.02)
    assert any("torque constants follow from the stated gains" in note for note in result.notes)
    with pytest.raises(InputError, match="current falls where the torque of the drive rises"):
        identify_actuators(leg.chains, replace(log, current=-log.current), leg.drives, options=NO_EFFECTS)


@pytest.mark.slow
def test_a_known_payload_sets_the_scale(leg: Played) -> None:
    """Logs with and without a known mass make gains and link masses known; without it they are not determined."""
    logs = []
    for seed, mass in ((1, 0.0), (2, 0.4)):
        t, command = multisine(LEG, 4.0, np.random.default_rng(seed), 0.002)
        q, *_ = rolled(heavier(mass), t, command, 0.003)
        payload = point_mass(mass, (0.0, 0.0, -0.2)) if mass else None
        logs.append(Log(t=t, q=q, command=command, payload=payload, name=f"run{seed}"))
    free = replace(NO_EFFECTS, free=("kp", "kd", "mass_factor"), share=("all",))
    # What is not identified is as the plant has it; friction and inertia of the joints differ.
    result = identify_actuators(leg.chains, logs, unknown_gains(leg), options=replace(free, share=()))
    for j, joint in enumerate(result.joints):
        assert result.value("kp", joint).value == pytest.approx(LEG.kp[j], rel=0.03)
    assert result.value("mass_factor", "calf_joint").value == pytest.approx(HEAVIER, rel=0.05)
    assert any("known payload sets the scale" in note for note in result.notes)
    assert any("determined by the known payload" in note and "kp" in note for note in result.notes)


def on_a_moving_base() -> str:
    """The leg on a base of 100 t, which springs move: 8 cm up and down at 1.1 Hz, and a pitch of 0.3 rad at 0.8 Hz."""
    mass, inertia = 1e5, 1e5
    text = mjcf(LEG, random_truth(LEG, np.random.default_rng(5)))
    joints = (
        f'<body name="base"><inertial mass="{mass}" pos="0 0 0" diaginertia="{inertia} {inertia} {inertia}"/>'
        f'<joint name="heave" type="slide" axis="0 0 1" stiffness="{mass * (2 * np.pi * 1.1) ** 2!r}"/>'
        f'<joint name="pitch" axis="0 1 0" stiffness="{inertia * (2 * np.pi * 0.8) ** 2!r}"/>'
    )
    start = '<keyframe><key qpos="0.08 0.3 0 0 0"/></keyframe>'
    text = text.replace("<worldbody>", f"<worldbody>{joints}").replace("</worldbody>", "</body></worldbody>")
    return text.replace("</mujoco>", f"{start}</mujoco>")


@pytest.mark.slow
def test_a_base_that_moves_is_followed(leg: Played, tmp_path: Path) -> None:
    """With the pose of the base in the log, drives are those of a held base; without it the motion is missed."""
    t, command = multisine(LEG, 4.0, np.random.default_rng(3), 0.002)
    q, _, pose = rolled(on_a_moving_base(), t, command, 0.003)
    columns = {"t": t} | {f"q{j + 1}": q[:, j] for j in range(3)} | {f"qref{j + 1}": command[:, j] for j in range(3)}
    names = ("base_x", "base_y", "base_z", "base_qw", "base_qx", "base_qy", "base_qz")
    path = tmp_path / "rocking.csv"
    pd.DataFrame(columns | dict(zip(names, pose.T, strict=True))).to_csv(path, index=False)
    result = identify_actuators(leg.chains, read_log(path, 3, torque=False), leg.drives, options=NO_EFFECTS)
    truth = random_truth(LEG, np.random.default_rng(5))
    for j, joint in enumerate(result.joints):
        assert result.value("armature", joint).value == pytest.approx(truth.armature[j], rel=0.03)
        assert result.value("coulomb", joint).value == pytest.approx(truth.coulomb[j], rel=0.05)
    held = identify_actuators(leg.chains, Log(t=t, q=q, command=command, name="run"), leg.drives, options=NO_EFFECTS)
    assert held.held_out_error > 5 * result.held_out_error


def test_the_motion_of_a_base_is_that_of_its_pose() -> None:
    """A base on a circle at constant speed that turns with it: the closed forms of acceleration and angular speed."""
    t = np.arange(0, 4.0, 0.004)
    speed, radius, gravity = 1.5, 0.4, np.array([0.0, 0.0, -9.81])
    pose = {
        "base_x": radius * np.cos(speed * t),
        "base_y": radius * np.sin(speed * t),
        "base_z": np.zeros(len(t)),
        "base_roll": np.zeros(len(t)),
        "base_pitch": np.zeros(len(t)),
        "base_yaw": speed * t,
    }
    found = base_motion(t, pose, gravity)[len(t) // 4 : -len(t) // 4]
    # Towards the centre, which is behind the base; upwards, because gravity is taken off.
    expected = np.array([-radius * speed**2, 0, 9.81, 0, 0, speed, 0, 0, 0])
    assert found == pytest.approx(np.tile(expected, (len(found), 1)), abs=2e-3)


def test_a_pose_that_is_given_is_used(leg: Played) -> None:
    """A pose in a log's metadata counts as that of its file does."""
    log = leg.log
    log = replace(log, metadata={POSE: {"base_roll": 0 * log.t, "base_pitch": 0 * log.t, "base_yaw": 0 * log.t}})
    assert base_motion(log.t, log.metadata[POSE], np.array([0, 0, -9.81]))[50] == pytest.approx([0, 0, 9.81] + 6 * [0])
