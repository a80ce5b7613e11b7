"""Ripple, and the spectrum over the angle that finds its order."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from robots.geometry.chain import Chain
from robots.terms.effects import EFFECTS, situation
from robots.terms.effects.torque_ripple import angle_spectrum

RIPPLE = EFFECTS["torque_ripple"]


def test_the_spectrum_is_the_sum_over_the_angle(seen):
    """Binned and transformed at once, the spectrum equals the sum of cosines and sines."""
    q = seen().q[:, 1]
    values = np.random.default_rng(0).normal(size=len(q))
    orders = np.linspace(3, 60, 40)
    exact = np.array([abs(np.sum(values * np.exp(-1j * h * q))) ** 2 for h in orders])
    # Bins of an eighth of a period, and interpolation in a spectrum four times as fine as its resolution.
    np.testing.assert_allclose(angle_spectrum(q, values, orders), exact, atol=0.12 * exact.max())


@pytest.mark.parametrize("order", [13.0, 17.3, 60.0])
def test_an_unknown_order_is_found(seen, order):
    """Of all resolvable orders, a hidden one is proposed first, to its resolution, in noise as large as it is."""
    now = seen(2, seed=2)
    joint = 1 + int(np.argmax(np.ptp(now.q, axis=0)))
    q = now.q[:, joint - 1]
    residual = np.random.default_rng(1).normal(size=now.q.shape)
    residual[:, joint - 1] += np.cos(order * q + 0.7)
    found = RIPPLE.propose(now, joint, residual, 8)
    assert min(abs(point[0] - order) for point in found[:3]) <= np.pi / np.ptp(q)


def test_what_else_varies_over_the_angle_hides_no_order(seen):
    """Noise of slow waves a hundred times as strong as that of quick ones does not pass for a ripple, nor do rests."""
    now = seen(2, seed=2)
    joint = 1 + int(np.argmax(np.ptp(now.q, axis=0)))
    q = now.q[:, joint - 1]
    rng = np.random.default_rng(2)
    residual = rng.normal(size=now.q.shape)
    for order in np.arange(3.0, 12.0, 0.25):
        residual[:, joint - 1] += np.cos(order * q + rng.uniform(0, 2 * np.pi))
    residual[:, joint - 1] += np.cos(60.0 * q + 0.7)
    residual[now.t > 0.7 * now.t[-1]] = 0.0
    found = RIPPLE.propose(now, joint, residual, 6)
    assert min(abs(point[0] - 60.0) for point in found) <= np.pi / np.ptp(q)


def test_fewer_than_two_waves_are_no_ripple(seen):
    """What does not repeat over the joint's range may be any smooth function: no such order is tried."""
    now = seen(2, seed=2)
    for joint in (1, 2):
        lowest = 2 * 2 * np.pi / np.ptp(now.q[:, joint - 1])
        assert min(order for order, *_ in RIPPLE.grid(now, joint)) >= min(lowest, 500.0)
        assert RIPPLE.bounds(now, joint)[0][0] == pytest.approx(max(lowest, 2.5))


def test_a_known_gear_gives_its_orders(random_robot, seen):
    """Once, twice and four times a motor turn are on the grid, where the samples resolve them."""
    robot = replace(random_robot(3, 4), gear_ratio=np.full(4, 30.0))
    now = seen(robot=robot)
    assert {30.0, 60.0, 120.0} <= {order for order, *_ in RIPPLE.grid(now, 2)}


def test_an_order_too_fast_for_the_samples_is_left_out(seen):
    """An order that passes between two samples is not looked for."""
    slow = seen()
    fast = situation(slow.model, slow.parameters, 10 * slow.t, slow.q, 20 * slow.dq, slow.ddq)
    assert RIPPLE.bounds(fast, 2)[0][1] < RIPPLE.bounds(slow, 2)[0][1] <= 1000


def test_a_joint_that_does_not_move_has_no_order(seen):
    """A joint at rest shows no ripple: there is nothing to scan."""
    now = seen()
    still = situation(now.model, now.parameters, now.t, 0 * now.q, 0 * now.dq, 0 * now.ddq)
    assert RIPPLE.grid(still, 2) == ()


def test_orders_of_a_known_gear_and_whole_ones_are_likely(random_robot, seen):
    """Near an order that was found, whole ones are offered; those of the gear wherever it is, late only near it."""
    robot = replace(random_robot(3, 4), gear_ratio=np.full(4, 30.5))
    now = seen(robot=robot)
    joint = 1 + int(np.argmax(np.ptp(now.q, axis=0)))
    resolution = np.pi / np.ptp(now.q[:, joint - 1])
    low, high = RIPPLE.bounds(now, joint)[0]
    gear = [order for order in (30.5, 61.0, 122.0) if low <= order <= high]
    assert 61.0 in gear
    waves, plain = np.ones(4), [(None, None), (None, 0.0)]
    for away, near in ((0.5, [61.0]), (1.5, [])):
        forms = [*plain, *((order, late) for order in near for late in (None, 0.0))]
        forms += [(order, 0.0) for order in gear if order not in near]
        found = RIPPLE.likely(now, joint, (61.0 + away * resolution, 0.001, 0.0), waves)
        assert found == tuple((*form, share) for share in (0.0, 1.0) for form in forms)
    assert {order for order, *_ in RIPPLE.likely(now, joint, (45.3, 0.001, 0.0), waves)} == {None, *gear}


def test_a_gear_s_order_is_scanned_whatever_else_ripples(random_robot, seen):
    """Beside louder lines that take all places; and of one line, no neighbour takes another place."""
    robot = replace(random_robot(3, 4), gear_ratio=np.full(4, 30.5))
    now = seen(robot=robot)
    joint = 1 + int(np.argmax(np.ptp(now.q, axis=0)))
    q = now.q[:, joint - 1]
    residual = np.random.default_rng(1).normal(size=now.q.shape)
    residual[:, joint - 1] += sum(np.cos(order * q) for order in (45.0, 80.0, 100.0))
    found = [order for order, *_ in RIPPLE.propose(now, joint, residual, 3)]
    assert {30.5, 61.0} <= set(found)
    for line in (45.0, 80.0, 100.0):
        assert min(abs(order - line) for order in found[:3]) <= np.pi / np.ptp(q)


def test_a_late_ripple_is_the_one_before(seen):
    """A ripple that is logged late is the one of the moment before, to the second order of the delay."""
    late, order, joint = 0.002, 60.0, 2
    now = seen()
    before = seen(times=now.t - late)
    change = RIPPLE.columns(now, joint, (order, late, 0.0))[:, joint - 1, :2]
    wanted = RIPPLE.columns(before, joint, (order, 0.0, 0.0))[:, joint - 1, :2]
    turned = order * np.abs(now.ddq[:, joint - 1]).max() * late**2 / 2
    assert np.abs(change - wanted).max() < 1.1 * turned
    assert np.abs(RIPPLE.columns(now, joint, (order, 0.0, 0.0))[:, joint - 1, :2] - wanted).max() > 5 * turned


@pytest.fixture(scope="module")
def sliding(seen, random_robot):
    """A smooth motion of three joints, the second of which slides."""
    robot = random_robot(2, 3)
    joints = tuple(
        replace(joint, kind="prismatic" if k == 1 else "revolute") for k, joint in enumerate(robot.chain.joints)
    )
    return seen(3, robot=replace(robot, chain=Chain(joints)))


def test_a_ripple_of_a_linear_axis_is_one_of_its_length(sliding):
    """A screw's wave of 3 mm over a tenth of a metre is proposed, reported in mm and N, its order in rad/m."""
    now, q = sliding, sliding.q[:, 1]
    now = replace(now, q=now.q * 0.1 / np.ptp(q), dq=now.dq * 0.1 / np.ptp(q))
    order = 2 * np.pi / 0.003
    residual = np.random.default_rng(1).normal(size=now.q.shape)
    residual[:, 1] += np.cos(order * now.q[:, 1] + 0.7)
    found = RIPPLE.propose(now, 2, residual, 8)
    assert min(abs(point[0] - order) for point in found[:3]) <= np.pi / 0.1
    assert "every 3 mm" in RIPPLE.describe(2, np.ones(4), (order, 0.0, 0.0), force="N", length="m")
    assert [shape.unit_at(now.robot, 2) for shape in RIPPLE.shapes] == ["rad/m", "s", ""]
    assert [shape.unit_at(now.robot, 1) for shape in RIPPLE.shapes] == ["periods per turn", "s", ""]


def test_friction_by_the_position_of_a_linear_axis_goes_by_waves_over_its_range(sliding):
    """No order per turn would show over a tenth of a metre; one wave and three over it are near the scan's points."""
    now = replace(sliding, q=sliding.q * 0.1 / np.ptp(sliding.q[:, 1]))
    effect = EFFECTS["position_dependent_friction"]
    orders = np.array([order for (order,) in effect.grid(now, 2)])
    ((low, high),) = effect.bounds(now, 2)
    assert np.all((orders > low) & (orders < high))
    for waves in (1.0, 3.0):
        assert np.min(np.abs(orders - 2 * np.pi * waves / 0.1)) * 0.1 < 1.5
    assert "every 50 mm" in effect.describe(2, np.ones(2), (2 * np.pi / 0.05,), force="N", length="m")


def test_the_sentence_tells_what_grows_with_the_load():
    """A motor's constant that ripples does so by a share of its torque: that is no small ripple."""
    for share, what in ((0.0, "load"), (1.0, "motor torque")):
        reported = RIPPLE.describe(3, np.array([0.003, 0.004, 0.03, -0.04]), (12.0, 0.0, share))
        assert (
            reported
            == f"The torque of joint 3 ripples with an amplitude of 0.005 N m and 5 % of its {what}, 12 times per turn."
        )


def test_a_motors_constant_ripples_by_all_of_its_torque(seen):
    """What a motor's constant makes of its torque, friction included, is the wave times what was logged of it."""
    now, joint, order = seen(), 2, 12.0
    whole, wave = now.torque[:, joint - 1], np.cos(order * now.q[:, joint - 1])
    X = RIPPLE.columns(now, joint, (order, 0.0, 1.0))[:, joint - 1]
    np.testing.assert_allclose(X[:, 2], wave * whole, atol=1e-9 * np.abs(whole).max())
    gear = RIPPLE.columns(now, joint, (order, 0.0, 0.0))[:, joint - 1]
    np.testing.assert_allclose(gear[:, 2], wave * now.rigid[:, joint - 1], atol=1e-9 * np.abs(whole).max())
    assert np.abs(X[:, 2] - gear[:, 2]).max() > 0.01 * np.abs(whole).max()
