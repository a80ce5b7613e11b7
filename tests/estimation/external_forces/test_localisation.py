"""The link that was touched."""

from __future__ import annotations

import numpy as np
import pytest

from estimation.external_forces.localisation import Localiser, fit_localiser
from robots import load_robot

NOISE = 0.05


@pytest.fixture(scope="module")
def six(twin_of):
    """An er3a, its twin, and the levels of 2000 healthy samples with independent noise."""
    robot = load_robot("er3a")
    twin, rng = twin_of(robot), np.random.default_rng(0)
    q = rng.uniform(robot.limits.lower, robot.limits.upper, (2000, 6)) * 0.5
    jacobian = np.array([twin.jacobian(x) for x in q])
    covariance = np.broadcast_to(NOISE**2 * np.eye(6), (2000, 6, 6))
    localiser = fit_localiser(robot.chain, q, rng.normal(size=q.shape) * NOISE, covariance, jacobian)
    return robot, twin, localiser


@pytest.mark.slow
def test_levels_are_quantiles_of_chi_squared(six):
    """Of independent noise, the levels are 99 % quantiles of chi-squared with n - rank degrees of freedom.

    A 99 % quantile of 2000 draws scatters by 4 to 9 %; 30 % is more than three of those.
    """
    from scipy.stats import chi2

    _, _, levels = six
    np.testing.assert_allclose(levels.joint, chi2.ppf(0.99, 1), rtol=0.3)
    np.testing.assert_allclose(levels.link[:5], chi2.ppf(0.99, [5, 4, 3, 2, 1]), rtol=0.3)
    assert levels.link[5] < 1e-6
    assert levels.tool == pytest.approx(chi2.ppf(0.99, 3), rel=0.3)


@pytest.mark.slow
@pytest.mark.parametrize("link", [1, 2, 3, 4, 5, 6])
def test_force_on_a_link_names_the_last_joint_that_feels_it(six, link):
    """A force of 60 N at a point off the axes of a link is placed on that link, by pinocchio's Jacobian.

    Without noise, so that only the rank of the Jacobians decides; a force nearly parallel to an axis is drawn again.
    """
    robot, twin, levels = six
    rng, found = np.random.default_rng(link), []
    while len(found) < 20:
        q = rng.uniform(-1.0, 1.0, 6)
        point, force = rng.uniform(-0.1, 0.1, 3), rng.normal(size=3)
        torque = twin.jacobian(q, link, point)[:3].T @ (60.0 * force / np.linalg.norm(force))
        if np.abs(torque[link - 1]) < 10 * NOISE:
            continue
        place = levels.locate(robot.chain, q, torque, NOISE**2 * np.eye(6), twin.jacobian(q))
        found.append(place.link)
        assert max(place.reacting) == link
    assert found == [link] * 20


def test_force_at_the_tool_is_named_so(six):
    """A force at the flange is accepted as one at the tool; a moment is not."""
    robot, twin, levels = six
    q = np.array([0.3, -0.4, 0.5, 0.6, -0.7, 0.2])
    jacobian, covariance = twin.jacobian(q), NOISE**2 * np.eye(6)
    at_tool = levels.locate(robot.chain, q, jacobian[:3].T @ [4.0, -6.0, 7.0], covariance, jacobian)
    assert at_tool.tool
    # The flange lies on the last axis: no force there turns joint 6.
    assert at_tool.link == 5
    assert at_tool.text(robot.joint_names).startswith("tool, or link 5")
    turned = levels.locate(robot.chain, q, jacobian[3:].T @ [0.0, 3.0, 2.0], covariance, jacobian)
    assert not turned.tool


def test_nothing_beyond_the_last_link_is_named():
    """A torque that no link explains is placed on the last."""
    none = Localiser(joint=np.full(6, 6.6), link=np.full(6, -1.0), tool=0.0)
    robot = load_robot("er3a")
    place = none.locate(robot.chain, np.zeros(6), np.ones(6), np.eye(6), np.ones((6, 6)))
    assert place.link == 6
