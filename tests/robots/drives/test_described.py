"""Drives from gains files and MJCF actuators."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import mujoco
import pytest

from benchmarks.actuators_parts.plants import MACHINES, mjcf
from robots.common.errors import InputError
from robots.drives import described_drives
from robots.drives.branches import load_branches

LEG = MACHINES["leg"]()


@pytest.fixture
def leg(tmp_path: Path) -> Callable[..., Path]:
    """Write the leg's MJCF, with or without its position actuators, and changes of its text."""

    def write(laws: bool = True, **changes: str) -> Path:
        text = mjcf(LEG, laws=laws)
        for old, new in changes.items():
            text = text.replace(old.replace("_", " "), new)
        path = tmp_path / "leg.xml"
        path.write_text(text)
        return path

    return write


def test_position_actuators_are_pd_laws(leg: Callable[..., Path]) -> None:
    """Gains, limits, rotor inertia and friction come from an MJCF's actuators and joints."""
    known = described_drives(load_branches(leg()))
    assert known.unknown == ()
    values = known.drives[2].values
    assert (values["kp"], values["kd"], values["torque_limit"]) == (LEG.kp[2], LEG.kd[2], LEG.limit[2])
    assert (values["armature"], values["viscous"], values["coulomb"]) == (
        LEG.armature[2],
        LEG.viscous[2],
        LEG.coulomb[2],
    )


DC = (
    '<dcmotor name="{0}" joint="{0}_joint" gear="10" motorconst="0.05" resistance="2" input="pos" '
    'controller="0.3 {1} 0.02" saturation="0.5 0 0"/>'
)


@pytest.mark.skipif(not hasattr(mujoco.mjtGain, "mjGAIN_DCMOTOR"), reason="MuJoCo before version 3.7 has no dcmotor")
def test_dc_motors_are_pd_laws(tmp_path: Path) -> None:
    """A dcmotor with a position input is PD control; MuJoCo's own torque at a joint is that of the law that is read."""
    names = [body.name for body in LEG.bodies]

    def written(integral: float) -> Path:
        motors = "".join(DC.format(name, integral) for name in names)
        path = tmp_path / f"dc{integral}.xml"
        path.write_text(mjcf(LEG, laws=False).replace("</mujoco>", f"<actuator>{motors}</actuator></mujoco>"))
        return path

    values = described_drives(load_branches(written(0.0))).drives[1].values
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "dc0.0.xml"))
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.ctrl[:] = 0.1, 0.05, 1.2
    mujoco.mj_forward(model, data)
    # The command counts at the motor, behind a gear of 10.
    expected = values["kp"] * (1.2 / 10 - 0.1) - values["kd"] * 0.05
    assert data.qfrc_actuator[1] == pytest.approx(expected)
    data.ctrl[:] = 1e3
    mujoco.mj_forward(model, data)
    assert values["torque_limit"] == pytest.approx(data.qfrc_actuator[1])
    with pytest.raises(InputError, match=r"control law of hip_joint, .* is not known"):
        described_drives(load_branches(written(0.1)))


def test_motors_need_a_gains_file(leg: Callable[..., Path]) -> None:
    """A robot whose actuators are motors is refused without gains, with what to write."""
    chains = load_branches(leg(laws=False))
    with pytest.raises(InputError, match=r"control law of hip_joint, .* is not known.*--gains"):
        described_drives(chains)


def test_gains_go_by_parts_of_names(leg: Callable[..., Path], tmp_path: Path) -> None:
    """Values hold for all joints, one each, or by parts of names; gains that are left out are unknown."""
    gains = tmp_path / "gains.yaml"
    gains.write_text("law: servo\nkp: {hip: 10, thigh: 20, calf: 30}\ntorque_limit: [1, 2, 3]\nstep: 0.001\n")
    known = described_drives(load_branches(leg(laws=False)), gains)
    assert [drive.values["kp"] for drive in known.drives] == [10, 20, 30]
    assert [drive.values["torque_limit"] for drive in known.drives] == [1, 2, 3]
    assert known.unknown == ("kd",)
    assert known.drives[0].step == 0.001


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("law: pid\n", "column law, row 1"),
        ("law: pd\nkpp: 3\n", "unknown key 'kpp'.*did you mean 'kp'"),
        ("law: pd\nkr: 3\n", "kr is no gain of the law pd; allowed: kp, kd"),
        ("law: pd\nkp: [1, 2]\n", "2 values; allowed: 3: hip_joint"),
        ("law: pd\nkp: {wrist: 2}\n", "no joint's name contains 'wrist'"),
        ("law: pd\nkp: -2\n", "kp -2 N m/rad"),
        ("law: pd\nstep: 0.1\n", "step belongs to the law servo"),
    ],
)
def test_wrong_gains_are_named(leg: Callable[..., Path], tmp_path: Path, text: str, message: str) -> None:
    """Each fault of a gains file is one message that names the key."""
    gains = tmp_path / "gains.yaml"
    gains.write_text(text)
    chains = load_branches(leg())
    with pytest.raises(InputError, match=message):
        described_drives(chains, gains)


def test_branches_of_a_held_base(data: Callable[[str], Path]) -> None:
    """A quadruped on a free joint is read as four legs, whose base is held."""
    legs = load_branches(data("go2_dls") / "go2_no_meshes.xml")
    assert [leg.n for leg in legs] == [3, 3, 3, 3]
    assert legs[2].joint_names == ("RL_hip_joint", "RL_thigh_joint", "RL_calf_joint")
    some = load_branches(data("go2_dls") / "go2_no_meshes.xml", joints=["RL_thigh_joint", "RL_calf_joint"])
    assert [leg.joint_names for leg in some] == [("RL_thigh_joint", "RL_calf_joint")]


def test_a_joint_of_several_branches_is_refused(tmp_path: Path) -> None:
    """A torso that carries two arms has to be locked, and then both arms are read."""
    arm = '<inertial mass="1" pos="0 0 .1" diaginertia="1e-3 1e-3 1e-3"/><joint name="{}" axis="0 1 0"/>'
    text = (
        '<mujoco><worldbody><body><inertial mass="1" pos="0 0 0" diaginertia="1 1 1"/><joint name="torso" '
        f'axis="0 0 1"/><body>{arm.format("left")}</body><body pos="0 1 0">{arm.format("right")}</body>'
        "</body></worldbody></mujoco>"
    )
    path = tmp_path / "torso.xml"
    path.write_text(text)
    with pytest.raises(InputError, match="joint torso: it carries several branches"):
        load_branches(path)
    assert [chain.joint_names for chain in load_branches(path, locked={"torso": 0.0})] == [("left",), ("right",)]
