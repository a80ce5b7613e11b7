"""The base on springs of the independent plant leans and rings as closed forms say."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from scipy.linalg import eigh

from oed.benchmarks.truth.effects.compliant_base import LeaningBase
from oed.benchmarks.truth.machines import Machine, draw_machine
from oed.benchmarks.truth.ride import Ride

STEP = 0.002


@pytest.fixture(scope="module")
def machine() -> Machine:
    """Draws an arm of six joints."""
    return draw_machine("ur10", np.random.default_rng(5))


def _ride(machine: Machine, share: np.ndarray) -> Ride:
    """Moves all joints on one line between two poses by a course (N,), at rest at its end."""
    t = STEP * np.arange(len(share))
    way = np.array([0.6, -0.4, 0.8, 0.3, -0.5, 0.2])
    q = np.array([0.4, -1.1, 0.9, 0.2, 0.5, 0.0]) + share[:, None] * way
    v, a = (
        np.gradient(np.gradient(q, STEP, axis=0), STEP, axis=0) if n else np.gradient(q, STEP, axis=0) for n in (0, 1)
    )
    return Ride(machine=machine, t=t, starts=(0,), q=q, v=v, a=a)


def test_a_robot_at_rest_leans_by_its_weight(machine: Machine) -> None:
    """The torque at rest is that of gravity in the frame of a base in equilibrium with its springs."""
    ride = _ride(machine, np.zeros(100))
    base = LeaningBase(amount=1e-4, ratio=1.5)
    model, q = machine.model, ride.q[0]
    data = model.createData()
    level = pin.computeGeneralizedGravity(model, data, q).copy()
    weight = sum(body.mass for body in list(model.inertias)[1:]) * np.array([0.0, 0.0, -9.81])
    centre = pin.centerOfMass(model, data, q).copy()
    lean = np.zeros(2)
    for _ in range(30):
        about_x, about_y = pin.utils.rotate("x", lean[0]), pin.utils.rotate("y", lean[1])
        moment = np.cross(about_x @ about_y @ centre, weight)
        lean = 1e-4 * np.array([moment[0], 1.5 * (about_x @ np.array([0.0, 1.0, 0.0])) @ moment])
    turned = pin.Model(model)
    turned.gravity.linear = (about_x @ about_y).T @ np.array([0.0, 0.0, -9.81])
    expected = pin.computeGeneralizedGravity(turned, turned.createData(), q) - level
    assert np.abs(expected).max() > 0.3
    np.testing.assert_allclose(base.torque(ride)[[0, 50, 99]], np.tile(expected, (3, 1)), atol=1e-6)


def test_a_base_rings_at_its_resonances_after_a_stop(machine: Machine) -> None:
    """Two frequencies follow from stiffness and inertia about the base; the slower one stays longest."""
    share = np.ones(4000)
    share[:1000] = np.sin(np.linspace(0.0, np.pi / 2, 1000)) ** 2 * np.linspace(0, 1, 1000)
    ride = _ride(machine, share)
    base = LeaningBase(amount=2e-5, ratio=1.5, own=0.1, damping=0.01)
    model, still = machine.model, ride.q[-1]
    data = model.createData()

    def about_base(q: np.ndarray) -> np.ndarray:
        pin.ccrba(model, data, q, np.zeros(model.nv))
        shift = pin.SE3(np.eye(3), data.com[0])
        return shift.act(pin.Inertia(data.Ig)).matrix()[3:, 3:][:2, :2]

    mean = np.mean([about_base(q)[[0, 1], [0, 1]].mean() for q in ride.q[:: len(ride.q) // 50]])
    resonances = np.sqrt(eigh(np.diag([5e4, 5e4 / 1.5]), about_base(still) + 0.1 * mean * np.eye(2))[0]) / (2 * np.pi)
    ringing = base.torque(ride)[1200:, 1]
    spectrum = np.abs(np.fft.rfft((ringing - ringing.mean()) * np.hanning(len(ringing)), 1 << 16))
    found = np.fft.rfftfreq(1 << 16, STEP)[np.argmax(spectrum)]
    assert np.abs(resonances / found - 1.0).min() < 0.02
