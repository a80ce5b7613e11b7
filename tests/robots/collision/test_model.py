from __future__ import annotations

import dataclasses
import pickle

import casadi
import numpy as np
import pytest

from robots.collision import Box, Capsule, CoalChecker, CollisionModel, Plane, Scene, collision_model, floor
from robots.collision.kinematics import symbolic_frames
from robots.collision.pairs import random_poses
from robots.common.errors import InputError
from robots.geometry.chain import Chain, Joint, homogeneous, rotation_from_rpy
from robots.loading import load_robot

ROBOTS = ("er3a", "ur10", "panda")


def _scene() -> Scene:
    box = Box(name="table", size=[0.5, 0.8, 0.3], pose=homogeneous(rotation_from_rpy([0.1, 0.2, 0.5]), [0.6, 0.4, 0.2]))
    post = Capsule(name="post", link=0, start=[-0.5, 0, 0], end=[-0.5, 0, 1.0], radius=0.06)
    return Scene(obstacles=(floor(-0.1), box, post, Plane(name="wall", normal=[0, 1, 0.2], offset=-1.0)))


@pytest.fixture(scope="module", params=ROBOTS)
def model(request):
    return collision_model(load_robot(request.param), scene=_scene())


@pytest.fixture
def poses(model):
    return random_poses(model.limits, 200, seed=3)


def test_clearances_are_coals(model, poses):
    """The clearances of 200 poses, all pairs, are coal's where bodies are apart, and below zero where coal's are."""
    ours, expected = model.clearance(poses), CoalChecker(model).clearance(poses)
    assert ours.shape == (200, len(model.pairs))
    free = expected > 0
    np.testing.assert_array_equal(ours > 0, free)
    # coal's boxes come from an iteration that ends at 1e-6
    np.testing.assert_allclose(ours[free], expected[free], rtol=0, atol=5e-6)
    assert 0.005 < (~free).mean() < 0.9


@pytest.mark.slow
def test_smooth_clearances_are_a_little_smaller(model, poses):
    """Of free pairs the smooth clearance is at most the exact one and at least that less the smoothing."""
    exact, (smooth, _) = model.clearance(poses), model.smooth_clearance(poses)
    free = exact >= 0
    assert (smooth <= exact + 1e-12)[free].all()
    assert (smooth >= exact - model.smoothing - 1e-12)[free].all()
    assert (smooth[~free] < 0).all()


@pytest.mark.slow
def test_gradients_are_exact(model, poses):
    """Gradients agree with central differences of the smooth clearance and are zero for joints that don't matter."""
    q, step = poses[:60], 1e-6
    exact, (_, gradients) = model.clearance(q), model.smooth_clearance(q)
    for joint in range(model.chain.n):
        shift = step * np.eye(model.chain.n)[joint]
        difference = (model.smooth_clearance(q + shift)[0] - model.smooth_clearance(q - shift)[0]) / (2 * step)
        # The slope turns over rho c / (d L), some 1e-2 rad, at the sharpest: differences are good to step / that.
        apart = exact > -0.02
        np.testing.assert_allclose(gradients[..., joint][apart], difference[apart], rtol=0, atol=2e-4)
        still = [row for row, pair in enumerate(model.pairs) if joint not in pair.joints]
        np.testing.assert_array_equal(gradients[:, still, joint], 0.0)


@pytest.mark.slow
def test_compiled_and_vectorised_agree(monkeypatch):
    """The compiled clearances are the vectorised ones."""
    robot = load_robot("er3a")
    q = random_poses(robot.limits, 50)
    capsules = collision_model(robot).capsules[:3]
    results = []
    for backend in ("vectorised", "auto"):
        monkeypatch.setenv("ROBOT_OED_BACKEND", backend)
        scene = Scene(obstacles=_scene().obstacles[:2])
        small = CollisionModel(name="er3a", chain=robot.chain, limits=robot.limits, capsules=capsules, scene=scene)
        results.append(small.smooth_clearance(q))
    for ours, other in zip(*results, strict=True):
        np.testing.assert_allclose(ours, other, rtol=0, atol=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_symbolic_frames_are_the_chain(seed, random_robot):
    """Frames as expressions are the chain's own transforms, for joints of both kinds about oblique axes."""
    robot = random_robot(seed, 5)
    frames = symbolic_frames(robot.chain)
    f = casadi.Function("f", [frames.q], [*frames.rotations, *frames.origins, frames.flange_point(np.ones(3))])
    q = np.random.default_rng(seed).uniform(-3, 3, 5)
    *parts, tool = (np.array(part) for part in f(q))
    poses = robot.chain.transforms(q)
    for link in range(5):
        np.testing.assert_allclose(parts[link + 1], poses[link, :3, :3], rtol=0, atol=1e-14)
        np.testing.assert_allclose(parts[6 + link + 1][:, 0], poses[link, :3, 3], rtol=0, atol=1e-14)
    flange = robot.chain.flange(q)
    np.testing.assert_allclose(tool[:, 0], flange[:3, 3] + flange[:3, :3] @ np.ones(3), rtol=0, atol=1e-14)


def test_prismatic_and_revolute_joints_move_bodies(slider_chain, arm, limits):
    """A slide and a turning arm before a wall: clearance and gradient in closed form."""
    wall = Plane(name="wall", normal=[-1.0, 0, 0], offset=-2.0)  # x <= 2
    model = CollisionModel(
        name="s", chain=slider_chain, limits=limits(2), capsules=(arm,), scene=Scene(obstacles=(wall,))
    )
    q = np.array([[0.3, 0.2], [1.0, -0.5], [-0.4, 0.0]])
    np.testing.assert_allclose(model.clearance(q)[:, 0], 1.95 - q[:, 0] - 0.5 * np.cos(q[:, 1]), rtol=0, atol=1e-15)
    _, gradients = model.smooth_clearance(q)
    np.testing.assert_allclose(gradients[:, 0, 0], -1.0, rtol=0, atol=1e-15)
    # the smooth minimum of two ends 0.5 m apart in height is off by (c / 0.5)^2 of their difference
    np.testing.assert_allclose(gradients[:, 0, 1], 0.5 * np.sin(q[:, 1]), rtol=0, atol=2e-5)


def test_neighbours_and_what_always_touches_are_not_watched():
    """Capsules of one link and of neighbours are no pair; those that always overlap are listed with the reason."""
    model = collision_model(load_robot("er3a"), scene=Scene(obstacles=(floor(0.0),)))
    names = set(model.names)
    assert "base / upper arm" in names
    assert "upper arm / flange" in names
    assert "floor / flange" in names
    assert all(pair.second.link - pair.first.link > 1 or pair.first.name == "floor" for pair in model.pairs)
    assert "floor / base" not in names
    assert dict(model.excluded) == {"forearm tube / flange": "touch in every pose"}
    for text in ("forearm tube / flange (touch in every pose)", "25 pairs checked", "radius 80 mm", "assumed"):
        assert text in model.summary()


@pytest.mark.slow
def test_the_choice_of_pairs_is_the_same_every_time():
    """Pairs and exclusions do not change from one making to the next."""
    robot = load_robot("panda")
    first, second = collision_model(robot), collision_model(robot)
    assert (first.names, first.excluded) == (second.names, second.excluded)


def test_a_pair_that_touches_at_zero_is_watched(limits):
    """Links that overlap at the pose zero only, as a folded arm's do, are watched: elsewhere they may collide."""
    joints = tuple(Joint(f"j{i}", "revolute", np.eye(3), np.array([0.3, 0, 0])) for i in range(3))
    first = Capsule(name="first", link=1, start=[0, 0, 0], end=[0.5, 0, 0], radius=0.05)
    third = Capsule(name="third", link=3, start=[0, 0, 0], end=[0.3, 0, 0], radius=0.11)
    model = CollisionModel(name="m", chain=Chain(joints), limits=limits(3), capsules=(first, third))
    assert model.names == ("first / third",)
    assert model.clearance(np.zeros((1, 3))) < 0.0
    short = dataclasses.replace(first, end=[0.7, 0, 0], radius=0.2)
    always = CollisionModel(name="m", chain=Chain(joints), limits=limits(3), capsules=(short, third))
    assert always.excluded == (("first / third", "touch in every pose"),)
    assert always.clearance(np.zeros((4, 3))).shape == (4, 0)
    assert always.smooth_clearance(np.zeros((4, 3)))[1].shape == (4, 0, 3)


def test_pairs_may_be_ignored(arm, slider_chain, limits):
    """Pairs are ignored by link numbers and obstacle names; one that does not exist is refused."""
    scene = Scene(obstacles=(floor(0.0), Box(name="table", size=[1, 1, 1])))
    base = Capsule(name="base", link=0, start=[2, 0, 0], end=[2, 0, 1], radius=0.1)
    common = {"name": "m", "chain": slider_chain, "limits": limits(2), "capsules": (base, arm), "scene": scene}
    assert CollisionModel(**common).names == ("base / arm", "floor / arm", "table / arm")
    ignored = (frozenset({0, 2}), frozenset({2, "floor"}))
    model = CollisionModel(**common, ignored=ignored)
    assert model.names == ("table / arm",)
    assert dict(model.excluded)["floor / arm"] == "to be ignored"
    with pytest.raises(InputError, match="'sofa'"):
        CollisionModel(**common, ignored=(frozenset({2, "sofa"}),))


@pytest.mark.parametrize("name", ["er3a", "ur10"])
def test_capsules_enclose_the_arm(name):
    """Where capsules are ours, each joint's origin and the flange are inside of a capsule of a link that ends there."""
    robot = load_robot(name)
    model, q = collision_model(robot), np.zeros((1, robot.n))
    poses = robot.chain.transforms(q)[0]
    places = [*poses[1:, :3, 3], robot.chain.flange(q[0])[:3, 3]]
    for link, place in enumerate(places, start=1):
        inside = []
        for capsule in model.capsules:
            if capsule.link in (link, link + 1):
                pose = poses[capsule.link - 1]
                spine = [pose[:3, :3] @ end + pose[:3, 3] for end in (capsule.start, capsule.end)]
                share = np.linspace(0, 1, 101)[:, None]
                inside.append(
                    np.linalg.norm(spine[0] + share * (spine[1] - spine[0]) - place, axis=1).min() <= capsule.radius
                )
        assert any(inside), f"{name}: the end of link {link}"


@pytest.mark.slow
def test_models_cross_process_borders():
    """A pickled model gives the same clearances."""
    model = collision_model(load_robot("er3a"), scene=_scene())
    q = random_poses(model.limits, 5)
    model.smooth_clearance(q)
    copy = pickle.loads(pickle.dumps(model))
    np.testing.assert_array_equal(copy.clearance(q), model.clearance(q))
    np.testing.assert_array_equal(copy.smooth_clearance(q)[0], model.smooth_clearance(q)[0])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Capsule(name="c", link=1, start=[0, 0, 0], end=[0, 0, 1], radius=0.0), "radius of 0.0 m"),
        (lambda: Capsule(name="c", link=-1, start=[0, 0, 0], end=[0, 0, 1], radius=0.1), "link -1"),
        (lambda: Capsule(name="c", link=1, start=[0, 0], end=[0, 0, 1], radius=0.1), "c: start"),
        (lambda: Box(name="b", size=[1, 0, 1]), "b: the size"),
        (lambda: Box(name="b", size=[1, 1, 1], pose=2 * np.eye(4)), "b: the pose"),
        (lambda: Plane(name="p", normal=[0, 0, 0], offset=0.0), "p: normal"),
        (lambda: Scene(obstacles=(floor(0), floor(1))), "two obstacles are called 'floor'"),
        (
            lambda: Scene(obstacles=(Capsule(name="c", link=1, start=[0, 0, 0], end=[0, 0, 1], radius=1),)),
            "'c' is on link 1",
        ),
    ],
)
def test_impossible_bodies_are_refused(make, message):
    """A body that cannot be is refused, by its name."""
    with pytest.raises(InputError, match=message):
        make()


def test_impossible_models_are_refused(arm, slider_chain, limits):
    """A link that the chain has not, a name used twice and a smoothing beyond the radii are refused."""
    common = {"name": "m", "chain": slider_chain, "limits": limits(2)}
    far = Capsule(name="far", link=3, start=[0, 0, 0], end=[0, 0, 1], radius=0.1)
    with pytest.raises(InputError, match="far: on link 3"):
        CollisionModel(**common, capsules=(far,))
    with pytest.raises(InputError, match="two bodies are called 'arm'"):
        CollisionModel(**common, capsules=(arm, arm))
    with pytest.raises(InputError, match=r"smoothing of 0\.05"):
        CollisionModel(**common, capsules=(arm,), smoothing=0.05)
