"""MJCF models for tests, and MuJoCo's own inverse dynamics of them."""

import mujoco
import numpy as np

# Anchors off the bodies' origins, a reference position, defaults and classes, degrees, tilted base, inertia from geoms,
# principal axes, a body fixed in between, a finger on a joint of its own, a site at the tool.
ARM = """
<mujoco model="arm3">
  <compiler angle="degree"/>
  <option timestep="0.0005" gravity="0.5 0 -9.7"/>
  <default>
    <joint damping="0.8" armature="0.05"/>
    <default class="wrist"><joint damping="0.2" frictionloss="0.4" armature="0.02"/></default>
  </default>
  <worldbody>
    <!-- the arm -->
    <body name="base" pos="0 0 0.1" quat="0.9 0.1 0 0.2">
      <geom type="cylinder" size="0.08 0.1"/>
      <body name="upper" pos="0 0 0.2">
        <joint name="shoulder" axis="0 0 1" pos="0.01 0.02 0" ref="20" range="-170 170" frictionloss="1.5"/>
        <inertial pos="0.02 0.01 0.15" mass="4" fullinertia="0.06 0.055 0.02 0.001 -0.002 0.003"/>
        <body name="fore" pos="0.05 0 0.3" euler="10 80 0">
          <joint name="elbow" axis="0 1 0.2" range="-120 120" frictionloss="1.2" actuatorfrcrange="-80 80"/>
          <geom type="capsule" fromto="0 0 0 0.3 0 0.05" size="0.04"/>
          <body name="adapter" pos="0.3 0 0">
            <geom type="sphere" size="0.03"/>
            <body name="hand" pos="0.02 0 0" quat="0.7 0.7 0 0">
              <joint name="turn" class="wrist" axis="1 0 0" range="-180 180"/>
              <geom type="box" size="0.05 0.03 0.08" pos="0.05 0.01 0"/>
              <site name="tool" pos="0.1 0 0" euler="0 90 0"/>
              <body name="finger" pos="0.1 0.02 0">
                <joint name="grip" type="slide" axis="0 1 0" range="0 0.04" ref="0.01"/>
                <geom type="box" size="0.01 0.01 0.03"/>
              </body>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor name="m1" joint="shoulder" gear="50" ctrlrange="-2 2"/>
    <position name="p2" joint="elbow" kp="100" forcerange="-100 100"/>
    <position name="p3" joint="turn" kp="100"/>
  </actuator>
</mujoco>
"""

# A linear axis and a hinge, radians, and no limits on the hinge.
GANTRY = """
<mujoco model="gantry">
  <compiler angle="radian"/>
  <option timestep="0.0005"/>
  <worldbody>
    <body name="carriage" pos="0.2 0 1">
      <joint name="rail" type="slide" axis="1 0.5 0" range="-0.5 0.7" damping="30" frictionloss="12" armature="3"/>
      <inertial pos="0 0.1 0" mass="8" diaginertia="0.1 0.2 0.15" quat="0.9 0.3 0.1 0"/>
      <body name="arm" pos="0 0.1 0.05">
        <joint name="swing" axis="0 1 1" pos="0 0 0.1" damping="0.4" frictionloss="0.6" armature="0.01"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.4" size="0.03"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def states(n, count=40, seed=0):
    """Random states (3, count, n) whose speeds are above those at which MuJoCo's dry friction fades."""
    rng = np.random.default_rng(seed)
    q, ddq = rng.uniform(-2, 2, (count, n)), rng.uniform(-5, 5, (count, n))
    return q, rng.choice([-1.0, 1.0], (count, n)) * rng.uniform(0.3, 2.0, (count, n)), ddq


def inverse_dynamics(model, names, q, dq, ddq, *, solver_friction):
    """MuJoCo's torques (N, n); dry friction by its solver, or exactly as ``frictionloss sign(dq)``."""
    bits = mujoco.mjtDisableBit
    off = bits.mjDSBL_CONTACT | bits.mjDSBL_LIMIT | bits.mjDSBL_EQUALITY
    model.opt.disableflags |= off if solver_friction else bits.mjDSBL_CONSTRAINT
    data = mujoco.MjData(model)
    at = [model.joint(name).qposadr[0] for name in names]
    dofs = [model.joint(name).dofadr[0] for name in names]
    torques = []
    for row in zip(q, dq, ddq, strict=True):
        data.qpos[:], data.qvel[:], data.qacc[:] = model.qpos0, 0.0, 0.0
        data.qpos[at], data.qvel[dofs], data.qacc[dofs] = row
        mujoco.mj_inverse(model, data)
        dry = 0.0 if solver_friction else model.dof_frictionloss[dofs] * np.sign(row[1])
        torques.append(data.qfrc_inverse[dofs] + dry)
    return np.array(torques)
