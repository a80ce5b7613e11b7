"""Forces that MuJoCo applied while it simulated a controlled arm."""

from __future__ import annotations

import numpy as np
import pytest

from estimation.external_forces import ForceOptions, estimate_forces
from robots import load_robot
from robots.signals import Log

pytestmark = pytest.mark.slow

ARM = """
<mujoco model="arm">
  <compiler angle="radian" autolimits="true"/>
  <option timestep="0.001" integrator="RK4" gravity="0 0 -9.81"/>
  <worldbody>
    <body name="link_1" pos="0 0 0.3">
      <inertial pos="0.02 0.01 0.05" mass="5" diaginertia="0.06 0.05 0.04"/>
      <joint name="waist" type="hinge" axis="0 0 1" range="-3 3" armature="0.3"/>
      <body name="link_2" pos="0.1 0 0">
        <inertial pos="0.2 0 0.01" mass="4" diaginertia="0.02 0.09 0.08"/>
        <joint name="shoulder" type="hinge" axis="0 1 0" range="-3 3" armature="0.2"/>
        <body name="link_3" pos="0.4 0 0">
          <inertial pos="0.15 0.02 0" mass="2" diaginertia="0.01 0.03 0.03"/>
          <joint name="elbow" type="hinge" axis="0 1 0" range="-3 3" armature="0.1"/>
          <geom type="sphere" size="0.05" pos="0.3 0 0" mass="0" contype="0" conaffinity="0"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor joint="waist" ctrlrange="-200 200"/>
    <motor joint="shoulder" ctrlrange="-200 200"/>
    <motor joint="elbow" ctrlrange="-200 200"/>
  </actuator>
</mujoco>
"""
AT, LENGTH, FORCE = 6.0, 0.2, np.array([5.0, 7.0, -6.0])
POINT = np.array([0.15, 0.02, 0.0])


@pytest.fixture(scope="module")
def arm(tmp_path_factory, model_of):
    """The exact model, and a maker of logs: a position controller tracks sines while a force acts on link 3."""
    mujoco = pytest.importorskip("mujoco")
    file = tmp_path_factory.mktemp("mujoco") / "arm.xml"
    file.write_text(ARM)
    model = mujoco.MjModel.from_xml_string(ARM)

    def play(seed: int, duration: float, force: np.ndarray) -> Log:
        data, rng = mujoco.MjData(model), np.random.default_rng(seed)
        w, phase = 2 * np.pi * rng.uniform(0.15, 0.5, (2, 3)), rng.uniform(0, 6, (2, 3))
        rows, last = [], model.body("link_3").id
        data.qpos = (0.4 * np.sin(phase)).sum(axis=0)
        data.qvel = (0.4 * w * np.cos(phase)).sum(axis=0)
        for k in range(round(duration / 0.001)):
            t = 0.001 * k
            wanted = (0.4 * np.sin(w * t + phase)).sum(axis=0)
            speed = (0.4 * w * np.cos(w * t + phase)).sum(axis=0)
            if k % 4 == 0:
                mujoco.mj_forward(model, data)
                data.ctrl = data.qfrc_bias + 400 * (wanted - data.qpos) + 40 * (speed - data.qvel)
                rows.append(np.concatenate([[t], data.qpos, data.qvel, data.ctrl]))
            pushed = AT <= t < AT + LENGTH
            # Force and moment at the body's centre of mass, in the world frame.
            data.xfrc_applied[last, :3] = force * pushed
            mujoco.mj_step(model, data)
        table = np.array(rows)
        noise = 0.1 * rng.normal(size=(len(table), 3))
        return Log(table[:, 0], table[:, 1:4], table[:, 7:10] + noise, dq=table[:, 4:7], name=f"mujoco {seed}")

    robot = load_robot(file)
    return robot, model_of(robot), play


@pytest.mark.parametrize("velocity", ["smoothed", "logged"])
def test_force_of_mujoco_is_found(arm, velocity):
    """A force of 10.5 N for 0.2 s at link 3: its time to 20 ms, its components to 0.8 N, and no other contact.

    The torque is held over four steps of the simulation, and the noise of 0.1 N m leaves some 0.1 N.
    """
    robot, model, play = arm
    tip = np.asarray(robot.chain.tip)
    tool = tip[:3, :3].T @ (POINT - tip[:3, 3])
    healthy = play(1, 25.0, 0 * FORCE)
    found = estimate_forces(
        model, play(2, 12.0, FORCE), healthy=[healthy], options=ForceOptions(tool=tool, velocity=velocity)
    )
    assert len(found.contacts) == 1
    contact = found.contacts[0]
    assert contact.start == pytest.approx(AT, abs=0.02)
    assert contact.end == pytest.approx(AT + LENGTH, abs=0.02)
    np.testing.assert_allclose(contact.force, FORCE, atol=0.8)
    assert contact.place.link == 3
