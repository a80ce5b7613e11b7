from __future__ import annotations

import pickle

import casadi
import numpy as np
import pytest
from scipy.optimize import minimize

from oed.constraints.geometric import CollisionLimit, GeometricLimits
from oed.constraints.singularity import SINGULARITY_FLOOR, SingularityLimit
from oed.constraints.tool import PlaneLimit, ToolBox
from robots.collision import Box, Capsule, CollisionModel, Scene, collision_model, floor, reach
from robots.collision.pairs import random_poses
from robots.common.errors import InputError
from robots.geometry.chain import Chain, Joint
from robots.limits import Limits
from robots.loading import load_robot
from robots.robot import Robot

ROBOTS = ("er3a", "panda")


@pytest.fixture(autouse=True)
def _without_compiler(monkeypatch):
    """Compiling takes longer than these tests."""
    monkeypatch.setenv("ROBOT_OED_BACKEND", "vectorised")


def _planar(*, slide: bool = False, count: int = 2) -> Robot:
    """An arm in the plane x-y with links of 0.5 m, on a slide along x if asked."""
    joints = [Joint("slide", "prismatic", np.eye(3), np.zeros(3), np.array([1.0, 0, 0]))] if slide else []
    joints += [Joint(f"j{i}", "revolute", np.eye(3), np.array([0.5 if i else 0.0, 0, 0])) for i in range(count)]
    tip = np.eye(4)
    tip[0, 3] = 0.5
    ones = np.ones(len(joints))
    limits = Limits(-3 * ones, 3 * ones, 9 * ones, 99 * ones, 999 * ones, 99 * ones)
    return Robot(name="planar", chain=Chain(tuple(joints), tip=tip), limits=limits)


def _all_limits(robot: Robot) -> GeometricLimits:
    model = collision_model(robot, scene=Scene(obstacles=(floor(-0.1), Box(name="box", size=[0.3, 0.3, 0.3]))))
    limits = (
        CollisionLimit(model=model, margin=0.01),
        ToolBox(lower=(-0.4, -np.inf, 0.1), upper=(0.6, 0.5, np.inf), point=(0.01, 0.02, 0.1)),
        PlaneLimit(link=5, normal=(0.1, 0, 1), offset=0.2, point=(0, 0.03, 0)),
        SingularityLimit(smallest=0.05),
    )
    return GeometricLimits(robot=robot, limits=limits)


@pytest.fixture(scope="module", params=ROBOTS)
def everything(request):
    return _all_limits(load_robot(request.param))


def test_rows_are_labelled(everything):
    """Each row has a name and a unit; infinite sides of the tool box give none."""
    pairs = len(everything.limits[0].model.pairs)
    assert everything.size == pairs + 4 + 1 + 1
    assert everything.labels[pairs : pairs + 2] == ("tool x >= -0.4", "tool x <= 0.6")
    assert everything.labels[-2:] == ("link 5 beyond plane", "distance to singularity")
    assert everything.units[-2:] == ("m", "")
    assert len(set(everything.labels)) == everything.size
    np.testing.assert_array_equal(everything.lower, 0.0)
    assert np.isposinf(everything.upper).all()


@pytest.mark.slow
def test_values_are_the_geometry(everything):
    """Tool box, plane and collision rows are what the numeric kinematics say."""
    robot, q = everything.robot, random_poses(everything.robot.limits, 40, seed=1)
    values, _ = everything.linearise(q)
    flange, links = robot.chain.flange(q), robot.chain.transforms(q)
    tool = flange[:, :3, 3] + flange[:, :3, :3] @ [0.01, 0.02, 0.1]
    sides = np.column_stack([tool[:, 0] + 0.4, 0.6 - tool[:, 0], 0.5 - tool[:, 1], tool[:, 2] - 0.1])
    np.testing.assert_allclose(values[:, -6:-2][:, [0, 1, 2, 3]], sides, rtol=0, atol=1e-13)
    point = links[:, 4, :3, 3] + links[:, 4, :3, :3] @ [0, 0.03, 0]
    normal = np.array([0.1, 0, 1]) / np.hypot(0.1, 1)
    np.testing.assert_allclose(values[:, -2], point @ normal - 0.2, rtol=0, atol=1e-13)
    model = everything.limits[0].model
    np.testing.assert_array_equal(values[:, : len(model.pairs)], model.smooth_clearance(q)[0] - 0.01)


@pytest.mark.slow
def test_gradients_are_exact(everything):
    """Gradients of all rows agree with central differences."""
    robot, step = everything.robot, 1e-6
    q = random_poses(robot.limits, 60, seed=2)
    values, gradients = everything.linearise(q)
    for joint in range(robot.n):
        shift = step * np.eye(robot.n)[joint]
        difference = (everything.linearise(q + shift)[0] - everything.linearise(q - shift)[0]) / (2 * step)
        # deep inside of each other bodies have kinks; elsewhere slopes turn over 1e-2 rad at the sharpest
        error = np.abs(gradients[:, :, joint] - difference)[values > -0.03]
        assert error.max() < 2e-4


@pytest.mark.slow
def test_pullback_is_the_adjoint_of_the_gradients(everything):
    """The pullback of weights is the weighted sum of the gradients, and casadi's adjoint function gives the same."""
    robot = everything.robot
    q = random_poses(robot.limits, 5, seed=3)
    weights = np.random.default_rng(0).normal(size=(5, everything.size))
    _, gradients = everything.linearise(q)
    pulled = everything.pullback(q, weights)
    np.testing.assert_allclose(pulled, np.einsum("km,kmn->kn", weights, gradients), rtol=0, atol=1e-12)
    adjoint = everything.adjoint()
    for k in range(5):
        np.testing.assert_allclose(np.array(adjoint(q[k], weights[k]))[:, 0], pulled[k], rtol=0, atol=1e-10)


@pytest.mark.slow
def test_they_are_pointwise_limits(everything):
    """As a limit of the state, rows are zero or more, do not depend on dq and ddq, and pass it where negative."""
    n = everything.robot.n
    q = random_poses(everything.robot.limits, 6, seed=4)
    values, jacobian = everything.values(q, q, q), everything.jacobian(q, q, q)
    np.testing.assert_array_equal(values, everything.linearise(q)[0])
    np.testing.assert_array_equal(jacobian[:, :, :n], everything.linearise(q)[1])
    np.testing.assert_array_equal(jacobian[:, :, n:], 0.0)
    np.testing.assert_array_equal(everything.excess(q, q, q), -values)


def _scaled_jacobian(robot, q, length):
    """By differences of the flange's pose, without our symbolic Jacobian."""
    step, columns = 1e-6, []
    for joint in range(robot.n):
        shift = step * np.eye(robot.n)[joint]
        after, before = robot.chain.flange(q + shift), robot.chain.flange(q - shift)
        spin = (after[:3, :3] - before[:3, :3]) @ robot.chain.flange(q)[:3, :3].T / (2 * step)
        turn = [spin[2, 1], spin[0, 2], spin[1, 0]]
        columns.append([*((after - before)[:3, 3] / (2 * step) / length), *turn])
    return np.array(columns).T


@pytest.mark.slow
@pytest.mark.parametrize("name", [*ROBOTS, "ur10"])
def test_the_distance_to_singularity_is_a_bound(name):
    """It is at most the smallest singular value of the scaled Jacobian, and at least 6^(-1/4) of it less 1e-4."""
    robot = load_robot(name)
    limits = GeometricLimits(robot=robot, limits=(SingularityLimit(smallest=0.1),))
    q = random_poses(robot.limits, 200, seed=5)
    bound = limits.linearise(q)[0][:, 0] + 0.1
    length = reach(robot.chain) / 2
    smallest = np.array([np.linalg.svd(_scaled_jacobian(robot, x, length), compute_uv=False)[-1] for x in q])
    rounding = 1e-8  # of the differences
    assert (bound <= smallest + rounding).all()
    assert (bound >= 6**-0.25 * smallest - SINGULARITY_FLOOR - rounding).all()


def test_singular_poses_have_no_distance():
    """At zero the ER3A's wrist is stretched: the distance is zero there, and its gradient a number."""
    limits = GeometricLimits(robot=load_robot("er3a"), limits=(SingularityLimit(smallest=0.1),))
    values, gradients = limits.linearise(np.zeros((1, 6)))
    assert values[0, 0] == pytest.approx(-0.1, abs=1e-9)
    assert np.isfinite(gradients).all()


def test_arms_of_few_joints_have_a_distance_to_singularity():
    """An arm of two joints in a plane is singular when stretched; its Jacobian (6, 2) has two singular values."""
    robot = _planar()
    limits = GeometricLimits(robot=robot, limits=(SingularityLimit(smallest=1e-3, length=0.5),))
    q = np.array([[0.3, 0.0], [0.3, 1.2]])
    bound = limits.linearise(q)[0][:, 0] + 1e-3
    exact = [np.linalg.svd(_scaled_jacobian(robot, x, 0.5), compute_uv=False)[-1] for x in q]
    assert (bound <= np.array(exact) + 1e-8).all()
    assert (bound >= 2**-0.25 * np.array(exact) - SINGULARITY_FLOOR - 1e-8).all()


def test_prismatic_and_single_joints_work():
    """A slide with one turning joint, and one joint alone, have rows and gradients in closed form."""
    robot = _planar(slide=True, count=1)
    limits = GeometricLimits(robot=robot, limits=(ToolBox(lower=(0, -1, -1), upper=(0.8, 1, 1)),))
    q = np.array([[0.2, 0.5]])
    values, gradients = limits.linearise(q)
    assert values[0, 1] == pytest.approx(0.8 - 0.2 - 0.5 * np.cos(0.5), abs=1e-15)
    np.testing.assert_allclose(gradients[0, 1], [-1.0, 0.5 * np.sin(0.5)], rtol=0, atol=1e-15)
    alone = GeometricLimits(
        robot=_planar(count=1), limits=(PlaneLimit(link=1, normal=(0, 1, 0), offset=0, point=(1, 0, 0)),)
    )
    values, gradients = alone.linearise(np.array([[0.4]]))
    np.testing.assert_allclose([values.item(), gradients.item()], [np.sin(0.4), np.cos(0.4)], rtol=0, atol=1e-15)


def _farthest(limits, joint_cost):
    """Drives a planar arm along a cost until the limits stop it."""
    rows = {"type": "ineq", "fun": lambda q: limits.linearise(q)[0][0], "jac": lambda q: limits.linearise(q)[1][0]}
    result = minimize(joint_cost, [1.0, 1.0], constraints=[rows], method="SLSQP", options={"ftol": 1e-12})
    assert result.success, result.message
    return result.x


@pytest.mark.parametrize("kind", ["collision", "box", "plane", "singularity"])
def test_each_limit_stops_a_solver(kind):
    """A solver with exact gradients ends on each limit where it is the active one, and passes it without."""
    robot = _planar()
    arm = Capsule(name="arm", link=2, start=[0, 0, 0], end=[0.5, 0, 0], radius=0.05)
    post = Capsule(name="post", link=0, start=[0.7, 0, -1], end=[0.7, 0, 1], radius=0.05)
    model = CollisionModel(
        name="p", chain=robot.chain, limits=robot.limits, capsules=(arm,), scene=Scene(obstacles=(post,))
    )
    limit = {
        "collision": CollisionLimit(model=model, margin=0.005),
        "box": ToolBox(lower=(-1, -1, -1), upper=(0.9, 1, 1)),
        "plane": PlaneLimit(link=2, normal=(0, 1, 0), offset=0.2, point=(0.5, 0, 0)),
        "singularity": SingularityLimit(smallest=0.45, length=0.5),
    }[kind]

    def cost(q):
        return float((q - [0.0, 0.1]) @ (q - [0.0, 0.1]))

    limits = GeometricLimits(robot=robot, limits=(limit,))
    q = _farthest(limits, cost)
    value = limits.linearise(q)[0].min()
    assert value == pytest.approx(0.0, abs=1e-6)
    assert limits.linearise(np.array([0.0, 0.1]))[0].min() < -0.01
    if kind == "collision":
        assert 0.005 <= model.clearance(q)[0, 0] <= 0.005 + model.smoothing + 1e-6


@pytest.mark.slow
def test_no_limits_and_pickles(everything):
    """Without limits there are no rows; limits that crossed a process border give the same values."""
    none = GeometricLimits(robot=_planar())
    assert none.linearise(np.zeros((3, 2)))[1].shape == (3, 0, 2)
    assert none.symbolic()(np.zeros(2))[0].shape == (0, 1)
    q = random_poses(everything.robot.limits, 3)
    copy = pickle.loads(pickle.dumps(everything))
    np.testing.assert_array_equal(copy.linearise(q)[0], everything.linearise(q)[0])


@pytest.mark.slow
def test_the_symbolic_function_gives_the_same_rows(everything):
    """The CasADi function, for use within a solver's own graph, gives values and gradients of one sample."""
    q = random_poses(everything.robot.limits, 2)
    function = everything.symbolic()
    assert isinstance(function, casadi.Function)
    values, gradients = everything.linearise(q)
    np.testing.assert_allclose(np.array(function(q[1])[0])[:, 0], values[1], rtol=0, atol=1e-12)
    np.testing.assert_allclose(np.array(function(q[1])[1]), gradients[1], rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ToolBox(lower=(0, 0, 0), upper=(1, 0, 1)), "from 0.0 to 0.0 m in y"),
        (lambda: ToolBox(lower=(0, 0), upper=(1, 1, 1)), "lower is"),
        (lambda: PlaneLimit(link=1, normal=(0, 0, 0), offset=0), "normal"),
        (lambda: PlaneLimit(link=0, normal=(0, 0, 1), offset=0), "link 0"),
        (lambda: SingularityLimit(smallest=0.0), "singular value of 0.0"),
        (lambda: GeometricLimits(robot=_planar(), limits=(PlaneLimit(link=3, normal=(0, 0, 1), offset=0),)), "link 3"),
        (
            lambda: GeometricLimits(
                robot=_planar(), limits=(CollisionLimit(model=collision_model(load_robot("er3a"))),)
            ),
            "a collision model of er3a",
        ),
    ],
)
def test_impossible_limits_are_refused(make, message):
    """A limit that cannot be, or that does not suit the robot, is refused with what is wrong."""
    with pytest.raises(InputError, match=message):
        make()
