"""Specification of causes: base, order of columns and single units are named, and the advice leads to a fit."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from estimation import identify, read_log, write_log
from estimation.gate import check_log
from robots.plants import Sensors, nominal_plant, simulate
from tests.estimation.gate.findings_of import found

OPTIONS = {"friction": "coulomb-viscous", "position": False}


@pytest.fixture(scope="module")
def stands(arm, fourier_motion):
    """Simulate the arm, 20 % off its description, on a base under some gravity."""

    def build(gravity, seed=0):
        robot = arm.under(gravity)
        plant = nominal_plant(robot, friction="coulomb-viscous", spread=0.2, seed=seed, sensors=Sensors())
        return simulate(plant, fourier_motion(arm, seed), seed=seed)

    return build


@pytest.mark.slow
@pytest.mark.parametrize(
    "gravity",
    [(-9.81, 0.0, 0.0), (0.0, 0.0, 9.81), (3.36, 0.0, -9.22)],
    ids=["wall", "ceiling", "tilted by 20 degrees"],
)
@pytest.mark.parametrize("seed", [0])
def test_a_base_mounted_otherwise_is_named_with_its_gravity(arm, stands, gravity, seed):
    """The gravity in the advice is within 3 degrees of the true one, and with it the log fits.

    The arm moves in the x-z plane. What gravity has along y acts on no joint, and is left out.
    """
    log = stands(gravity, seed)
    report = check_log(arm, log)
    (finding,) = found(report, "gravity_direction")
    values = re.search(r"--gravity K=([-0-9.,e]+)", finding.action)
    advised = np.array([float(value) for value in values[1].split(",")])
    cosine = advised @ gravity / np.linalg.norm(advised) / np.linalg.norm(gravity)
    assert np.degrees(np.arccos(min(cosine, 1.0))) < 3.0
    mended = replace(log, gravity=advised)
    assert not found(check_log(arm, mended), "gravity_direction")
    if gravity[2]:
        return
    right = identify(arm, replace(log, gravity=np.array(gravity)), **OPTIONS)
    for one, other in zip(identify(arm, mended, **OPTIONS).joints, right.joints, strict=True):
        assert one.held_out_rms < 1.5 * other.held_out_rms


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "order"),
    [("both", [5, 4, 3, 2, 1, 0]), ("torques", [0, 2, 1, 3, 4, 5]), ("positions", [1, 0, 2, 3, 4, 5])],
)
def test_exchanged_columns_are_named_in_their_order(er3a, good, kind, order):
    """The order in the text puts the columns back."""
    log = good()
    q = log.q if kind == "torques" else log.q[:, order]
    tau = log.tau if kind == "positions" else log.tau[:, order]
    report = check_log(er3a, replace(log, q=q, tau=tau))
    (finding,) = found(report, "swapped_columns")
    assert report.refused
    lists = dict(re.findall(r"(position|torque): \{columns: \[([^\]]+)\]", finding.text))
    places = {key: [int(re.sub(r"\D", "", name)) - 1 for name in names.split(",")] for key, names in lists.items()}
    straight = list(range(6))
    mended_q, mended_tau = q[:, places.get("position", straight)], tau[:, places.get("torque", straight)]
    assert check_log(er3a, replace(log, q=mended_q, tau=mended_tau)).findings == ()


@pytest.mark.slow
@pytest.mark.parametrize(("axis", "joint", "factor", "torques"), [(3, 2, 1, False), (3, 2, -1, False), (6, 5, 1, True)])
def test_coupled_axes_are_named(er3a, good, axis, joint, factor, torques, tmp_path):
    """The mapping in the advice gives the joints' positions and torques back."""
    log = good()
    coupling = np.eye(6)
    coupling[axis - 1, joint - 1] = factor
    tau = log.tau @ np.linalg.inv(coupling) if torques else log.tau
    read = replace(log, q=log.q @ coupling.T, tau=tau)
    (finding,) = check_log(er3a, read).findings
    assert finding.name == "coupled_axes"
    assert (finding.severity, finding.joint) == ("refuse", axis)
    (tmp_path / "mapping.yaml").write_text("\n".join(re.findall(r"`([^`]+)`", finding.action)))
    write_log(tmp_path / "log.csv", read)
    mended = read_log(tmp_path / "log.csv", mapping=tmp_path / "mapping.yaml")
    np.testing.assert_allclose(mended.q, log.q, atol=1e-9)
    np.testing.assert_allclose(mended.tau, log.tau, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("joint", [0, 1])
def test_one_joint_in_degrees_is_named_with_its_scale(arm, arm_log, joint):
    """A motion in degrees that stays inside the limits shows in the torques; the scale in the advice mends it."""
    log = arm_log(seed=2, motion_seed=2)
    q = np.array(log.q)
    q[:, joint] = np.rad2deg(q[:, joint])
    wide = replace(arm, limits=replace(arm.limits, lower=np.full(2, -300.0), upper=np.full(2, 300.0)))
    for robot in (arm, wide):
        (finding,) = found(check_log(robot, replace(log, q=q)), "unit_of_position")
        assert (finding.severity, finding.joint) == ("refuse", joint + 1)
        scale = [float(value) for value in re.search(r"scale: \[([^\]]+)\]", finding.action)[1].split(",")]
        assert check_log(robot, replace(log, q=q * scale)).findings == ()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kind", ["held", "averaged"])
def test_static_poses_are_named(arm, seed, kind):
    """Poses that are held still, or one averaged row each, determine gravity only; nothing else is said."""
    rng = np.random.default_rng(seed)
    rows, pause = (40, 1.0) if kind == "held" else (1, 4.0)
    poses = rng.uniform(-1.5, 1.5, (30, 2))
    q = np.repeat(poses, rows, axis=0) + 1e-5 * rng.normal(size=(30 * rows, 2))
    t = (np.arange(rows)[None, :] * 0.05 + np.arange(30)[:, None] * (0.05 * rows + pause)).ravel()
    log = replace(simulate(nominal_plant(arm), _still(t, q)), q=q)
    report = check_log(arm, log)
    assert [finding.name for finding in report.findings] == ["static_poses"]
    assert report.findings[0].value == 30


def _still(t, q):
    from robots.signals import Motion

    return Motion(t, q, np.zeros_like(q), np.zeros_like(q))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_a_slow_log_does_not_determine_inertias(arm, fourier_motion, seed):
    """At a hundredth of the speed, inertias are below three standard errors; at full speed they are not."""
    fast = fourier_motion(arm, seed)
    slow = replace(fast, t=60 * fast.t, dq=fast.dq / 60, ddq=fast.ddq / 3600)
    plant = nominal_plant(arm, friction="coulomb-viscous", sensors=Sensors())
    assert found(check_log(arm, simulate(plant, slow, seed=seed)), "undetermined")
    assert not found(check_log(arm, simulate(plant, fast, seed=seed)), "undetermined")
