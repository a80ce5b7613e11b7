"""Specification of a robot's forward motion under a position loop, against a solver of differential equations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from robots.plants.closed_loop import Loop, Reference, Tangent, drive

STEP = 0.004
INERTIA, WEIGHT, VISCOUS, WIDTH = 2.0, 9.0, 0.8, 0.002
T = STEP * np.arange(1250)


def wanted(t):
    """A motion with slow and quick reversals: position, velocity and acceleration."""
    q = 0.6 * np.sin(1.3 * t) + 0.2 * np.sin(3.1 * t)
    v = 0.78 * np.cos(1.3 * t) + 0.62 * np.cos(3.1 * t)
    return q, v, -1.014 * np.sin(1.3 * t) - 1.922 * np.sin(3.1 * t)


def torque(t):
    """A driving torque that is not quite what the motion needs."""
    q, v, a = wanted(t)
    return 2.2 * a + 8.0 * np.sin(q) + 0.5 * v + np.tanh(v / 0.1)


def one_joint(turning, spring, passes=25):
    """The pendulum of one joint, driven."""
    q, v, a = (part[:, None] for part in wanted(T))
    rows = np.ones((len(T), 1, 1))
    return drive(
        Reference(step=STEP, q=q, dq=v, ddq=a, torque=torque(T)[:, None]),
        lambda q, v, a: (INERTIA * a + WEIGHT * np.sin(q) + VISCOUS * v + spring(q), turning(v)),
        Tangent(inertia=INERTIA * rows, damping=VISCOUS * rows, stiffness=WEIGHT * np.cos(q)[:, :, None]),
        inertia=np.array([INERTIA]),
        sign_width=np.array([WIDTH]),
        loop=Loop(),
        passes=passes,
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("turning", "spring"),
    [
        (lambda v: np.full_like(v, 1.5), lambda q: 0.0 * q),
        (lambda v: 1.5 + 1.2 * np.exp(-((np.abs(v) / 0.05) ** 2)), lambda q: 0.0 * q),
        (lambda v: np.full_like(v, 1.5), lambda q: 40.0 * q - 25.0 * q**3),
    ],
    ids=["Coulomb", "Stribeck", "spring"],
)
def test_a_joint_moves_as_a_stiff_solver_says(turning, spring):
    """Motion and loop torque are those of scipy's Radau of the same equation, sticking at reversals included.

    The midpoint rule at 4 ms errs by (5 Hz x 2 pi x 4 ms)^2 / 12 = 0.1 %; the backward rule of the sign, by up to a
    sample at a reversal: 2 % of an RMS that reversals make for the most part.
    """
    found = one_joint(turning, spring)
    assert found.converged
    stiffness, damping = (float(gain[0]) for gain in Loop().gains(np.array([INERTIA])))

    def rate(t, state):
        q, v = state
        a, b, _ = wanted(t)
        push = torque(t) + stiffness * (a - q) + damping * (b - v)
        return v, (push - WEIGHT * np.sin(q) - VISCOUS * v - spring(q) - turning(v) * np.tanh(v / WIDTH)) / INERTIA

    first = wanted(0.0)
    begin = (first[0] - STEP / 2 * first[1], first[1] - STEP / 2 * first[2])
    exact = solve_ivp(rate, (-STEP / 2, T[-1]), begin, method="Radau", t_eval=T, rtol=1e-6, atol=1e-9, max_step=0.01).y
    q, v, _ = wanted(T)
    error = exact[0] - q
    loop = -stiffness * error - damping * (exact[1] - v)
    assert np.sqrt(np.mean((found.q[:, 0] - exact[0]) ** 2)) < 0.01 * np.sqrt(np.mean(error**2))
    assert np.sqrt(np.mean((found.correction[:, 0] - loop) ** 2)) < 0.02 * np.sqrt(np.mean(loop**2))


def test_a_true_robot_needs_nothing_of_the_loop():
    """Driven by the torque that its motion needs, a robot makes that motion: the loop adds a thousandth and less."""
    q, v, a = (part[:, None] for part in wanted(T))
    rows = np.ones((len(T), 1, 1))
    needed = INERTIA * a + WEIGHT * np.sin(q) + VISCOUS * v
    found = drive(
        Reference(step=STEP, q=q, dq=v, ddq=a, torque=needed),
        lambda q, v, a: (INERTIA * a + WEIGHT * np.sin(q) + VISCOUS * v, np.zeros_like(v)),
        Tangent(inertia=INERTIA * rows, damping=VISCOUS * rows, stiffness=WEIGHT * np.cos(q)[:, :, None]),
        inertia=np.array([INERTIA]),
        sign_width=np.array([WIDTH]),
    )
    assert found.converged
    assert np.sqrt(np.mean(found.correction**2)) < 1e-3 * np.sqrt(np.mean(needed**2))


def test_joints_that_turn_together_obey_their_equations():
    """Two coupled joints with sticking friction: at every step the torques balance to the passes' tolerance."""
    M = np.array([[2.0, 0.9], [0.9, 0.8]])
    friction, width = np.array([1.5, 1.0]), np.array([0.002, 0.004])
    t = T[:, None] * np.array([1.0, 1.7])
    q, v, a = wanted(t)
    v, a = v * [1.0, 1.7], a * [1.0, 1.7**2]
    push = a @ M.T + 1.2 * np.tanh(v / 0.1)
    rows = np.ones((len(T), 1, 1))
    found = drive(
        Reference(step=STEP, q=q, dq=v, ddq=a, torque=push),
        lambda q, v, a: (a @ M.T, np.broadcast_to(friction, v.shape)),
        Tangent(inertia=M * rows, damping=np.zeros((2, 2)) * rows, stiffness=np.zeros((2, 2)) * rows),
        inertia=np.diag(M).copy(),
        sign_width=width,
    )
    # The velocity at the end of each step, at which friction is taken.
    ends = v[0] - STEP / 2 * a[0] + STEP * np.cumsum(found.ddq, axis=0)
    left = found.ddq @ M.T + friction * np.tanh(ends / width) - push - found.correction
    assert np.abs(left).max() < 1e-3 * np.abs(push).max()
    stuck = np.abs(ends) < width
    assert stuck.any(axis=0).all()


def test_an_inertia_below_zero_is_filled_up():
    """A model whose inertia is negative in a direction is held by the loop, and the result says so."""
    q, v, a = (part[:, None] * np.ones(2) for part in wanted(T))
    M = np.array([[1.0, 1.1], [1.1, 1.0]])
    rows = np.ones((len(T), 1, 1))
    found = drive(
        Reference(step=STEP, q=q, dq=v, ddq=a, torque=a @ M.T),
        lambda q, v, a: (a @ M.T, np.zeros_like(v)),
        Tangent(inertia=M * rows, damping=np.zeros((2, 2)) * rows, stiffness=np.zeros((2, 2)) * rows),
        inertia=np.ones(2),
        sign_width=np.full(2, WIDTH),
    )
    assert (found.filled > 0.1).all()
    assert np.isfinite(found.q).all()
    assert np.abs(found.q - q).max() < 1e-3


def test_what_does_not_settle_says_so():
    """A single pass confirms nothing."""
    found = one_joint(lambda v: np.full_like(v, 1.5), lambda q: 40.0 * q, passes=1)
    assert not found.converged
