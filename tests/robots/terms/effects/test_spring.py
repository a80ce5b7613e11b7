"""A spring between two pivots: its torque is the slope of its energy, whatever the formula says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from robots.terms.effects import EFFECTS, situation

SPRING = EFFECTS["spring"]


def _distance(q, near, far, centre):
    """Distance of two pivots at `near` and `far` [m] from the joint, by their places in the plane."""
    moving = near * np.column_stack([np.cos(q - centre), np.sin(q - centre)])
    return np.linalg.norm(moving - [far, 0.0], axis=1)


@pytest.mark.parametrize(("near", "far", "centre"), [(0.1, 0.4, 0.5), (0.25, 0.3, -2.0)])
def test_a_lever_spring_pushes_as_its_energy_falls(seen, near, far, centre):
    """A linear spring with slack between two pivots is `preload` and `stiffness` at their ratio: by differences."""
    now = seen(2, seed=2)
    joint, stiffness, slack = 1, 900.0, 0.7 * (far - near)
    q = now.q[:, joint - 1]

    def energy(x):
        return 0.5 * stiffness * (_distance(x, near, far, centre) - slack) ** 2

    h = 1e-5
    expected = (energy(q + h) - energy(q - h)) / (2 * h)
    ratio = near / far
    X = SPRING.columns(now, joint, (ratio, centre, 3.0))[:, joint - 1]
    # s = (L - 1) / r, L the distance over `far`: k (far L - slack) far dL/dq = k far^2 r (r s + 1 - slack / far) s'.
    scale = stiffness * far**2 * ratio
    got = X @ [scale * ratio, 0.0, 0.0, scale * (1 - slack / far)]
    assert got == pytest.approx(expected, abs=1e-6 * np.abs(expected).max())


def test_a_spring_without_levers_is_a_polynomial(seen):
    """Its columns are powers of the position from the middle of the joint's range, and the offset."""
    now = seen(2, seed=2)
    limits = now.robot.limits
    x = now.q[:, 1] - (limits.lower[1] + limits.upper[1]) / 2
    one = np.ones(len(x))
    X = SPRING.columns(now, 2, (0.0, 0.0, 3.0))[:, 1]
    np.testing.assert_allclose(X, np.column_stack([x, x**2, x**3, one]), atol=1e-12)
    linear = SPRING.columns(now, 2, (0.0, 0.0, 1.0))[:, 1]
    np.testing.assert_allclose(linear, np.column_stack([x, 0 * x, 0 * x, one]), atol=1e-12)
    names = [coefficient.name for coefficient in SPRING.described(now.robot, 2, (0.0, 0.0, 1.0))]
    assert names == ["stiffness", "", "", ""]


def test_a_joint_that_hardly_turns_tells_no_lever(seen):
    """Over less than a radian plain springs are all that is tried; over more, levers too."""
    now = seen(2, seed=2)
    joint = 1

    def over(reach):
        factor = reach / np.ptp(now.q[:, joint - 1])
        motion = (factor * now.q, factor * now.dq, factor * now.ddq)
        return situation(now.model, now.model.nominal, now.t, *motion)

    assert len(SPRING.grid(over(2.0), joint)) > 1
    assert SPRING.grid(over(0.8), joint) == ((0.0, 0.0, 1.0), (0.0, 0.0, 3.0))
    assert SPRING.bounds(over(0.8), joint)[:2] == ((0.0, 0.0), (0.0, 0.0))


@pytest.mark.parametrize(
    ("ratio", "angle", "believed"),
    [(0.75, 0.3, True), (0.9, 0.3, False), (0.9, 0.3 - 2 * np.pi, False), (0.9, 2.5, True), (0.0, 0.0, True)],
)
def test_the_ends_of_a_spring_do_not_meet_where_the_joint_passes(random_robot, ratio, angle, believed):
    """On a joint that turns a radian each way: at an angle there, or a turn from it; beyond its stops they may."""
    robot = random_robot(2, 2)
    robot = replace(robot, limits=replace(robot.limits, lower=np.full(2, -1.0), upper=np.full(2, 1.0)))
    assert SPRING.is_plausible(robot, 1, np.array([400.0, -300.0, 0.0, 900.0]), (ratio, angle, 3.0)) is believed
