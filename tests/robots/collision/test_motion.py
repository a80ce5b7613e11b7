from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from robots.collision import (
    Box,
    Capsule,
    CollisionModel,
    Plane,
    Scene,
    check_motion,
    collision_model,
    floor,
    travel_bound,
)
from robots.collision.pairs import poses_of, spine
from robots.common.errors import InputError
from robots.geometry.chain import Chain, Joint, homogeneous
from robots.loading import load_robot
from robots.signals import Motion


def _wave(n, amplitude, frequency, duration, step, centre=0.0):
    t = np.arange(round(duration / step) + 1) * step
    w = 2 * np.pi * frequency * np.arange(1, n + 1)
    q = centre + amplitude * np.sin(w * t[:, None])
    return Motion(t, q, amplitude * w * np.cos(w * t[:, None]), -amplitude * w**2 * np.sin(w * t[:, None]))


def _between(motion, parts):
    """Many instants of the cubic through positions and velocities, by scipy."""
    return CubicHermiteSpline(motion.t, motion.q, motion.dq)(
        motion.t[:-1, None] + np.diff(motion.t)[:, None] * np.linspace(0, 1, parts)
    )


@pytest.fixture(params=["er3a", "ur10", "panda", "slider"])
def model(request, slider_chain, arm, limits):
    if request.param == "slider":
        base = Capsule(name="base", link=0, start=[0.5, 0.9, 0.3], end=[0.5, 0.9, 0.5], radius=0.1)
        return CollisionModel(
            name="s", chain=slider_chain, limits=limits(2), capsules=(base, arm), scene=Scene(obstacles=(floor(0.0),))
        )
    return collision_model(load_robot(request.param), scene=Scene(obstacles=(floor(-0.5),)))


@pytest.mark.slow
def test_no_point_travels_farther_than_the_bound(model):
    """Seen from the first body, no end of the second's spine moves more between two samples than the bound says."""
    motion = _wave(model.chain.n, 0.5, 0.3, 2.0, 0.1)
    bound = travel_bound(model, motion)
    dense = _between(motion, 30)
    tightest = np.inf
    for interval, q in enumerate(dense):
        poses = poses_of(model.chain, q)
        for column, pair in enumerate(model.pairs):
            frame = np.linalg.inv(poses[:, pair.first.link])
            for end in spine(pair.second, poses):
                seen = np.einsum("kij,kj->ki", frame[:, :3, :3], end) + frame[:, :3, 3]
                path = np.linalg.norm(np.diff(seen, axis=0), axis=1).sum()
                assert path <= bound[interval, column] * (1 + 1e-9) + 1e-12
                if path > 1e-6:
                    tightest = min(tightest, bound[interval, column] / path)
    assert tightest < 2.0  # the bound is no wild exaggeration


def test_clearance_between_samples_stays_above_what_is_proved(model):
    """On 200 ms samples, what is proved is never above the clearance at any of 100 instants between."""
    motion = _wave(model.chain.n, 0.35, 0.2, 4.0, 0.2)
    report = check_motion(model, motion, margin=-1.0)
    dense = _between(motion, 100).reshape(-1, motion.n)
    assert report.certified
    assert (report.lower_bound <= model.clearance(dense).min(axis=0) + 1e-12).all()
    assert (report.clearance >= report.lower_bound - 1e-12).all()


def _pendulum(limits, box):
    tip = np.eye(4)
    tip[0, 3] = 1.0
    chain = Chain((Joint("turn", "revolute", np.eye(3), np.zeros(3)),), tip=tip)
    capsule = Capsule(name="arm", link=1, start=[0.2, 0, 0], end=[1, 0, 0], radius=0.05)
    return CollisionModel(name="p", chain=chain, limits=limits(1), capsules=(capsule,), scene=Scene(obstacles=(box,)))


def test_a_collision_between_two_samples_is_found(limits):
    """Samples on both sides of a post do not hide that the arm passes through it."""
    post = Box(name="post", size=[0.02, 0.02, 1.0], pose=homogeneous(np.eye(3), [0.9, 0, 0]))
    model = _pendulum(limits, post)
    t, speed = np.array([0.0, 0.25, 0.5]), np.full((3, 1), 4.0)
    motion = Motion(t, (t[:, None] - 0.375) * 4, speed, 0 * speed)
    assert (model.clearance(motion.q) > 0).all()
    report = check_motion(model, motion)
    assert report.collides
    assert not report.certified
    assert report.names[report.worst] == "post / arm"
    assert report.clearance[0] < 0
    # the arm is in the post while |angle| < (0.05 + 0.01) / 0.89, about 0.375 s
    assert abs(report.time[0] - 0.375) < 0.07 / 0.85 / 4
    assert "not free" in report.summary()


def test_a_narrow_miss_is_proved_free(limits):
    """An arm that stops 2 mm before a post is proved to keep 1 mm, and not 3 mm."""
    angle = np.deg2rad(30)
    # The closest point of the box's edge lies 0.9 m out; the capsule's side is 50 mm from its spine.
    t = np.linspace(0, 1, 6)
    q = angle * (10 * t**3 - 15 * t**4 + 6 * t**5)[:, None]
    dq = angle * (30 * t**2 - 60 * t**3 + 30 * t**4)[:, None]
    motion = Motion(t, q, dq, np.gradient(dq, t, axis=0))
    distance = 0.05 + 0.002
    normal = np.array([-np.sin(angle), np.cos(angle), 0])
    middle = 0.6 * np.array([np.cos(angle), np.sin(angle), 0])
    size = np.array([0.1, 0.2, 0.2])
    turn = np.column_stack([[np.cos(angle), np.sin(angle), 0], normal, [0, 0, 1]])
    box = Box(name="post", size=size, pose=homogeneous(turn, middle + normal * (distance + 0.1)))
    model = _pendulum(limits, box)
    report = check_motion(model, motion, margin=0.001)
    assert report.certified
    assert report.confirmed
    assert 0.001 <= report.lower_bound[0] <= report.clearance[0] == pytest.approx(0.002, abs=1e-12)
    assert report.evaluations > len(motion)
    assert check_motion(model, motion, margin=0.003).collides


def test_what_cannot_be_decided_is_not_certified(limits):
    """With no halvings allowed, a motion that is free but coarsely sampled is neither certified nor a collision."""
    post = Box(name="post", size=[0.02, 0.02, 1.0], pose=homogeneous(np.eye(3), [-0.9, 0, 0]))
    model = _pendulum(limits, post)
    motion = Motion(np.array([0.0, 1.0]), np.array([[-1.5], [1.5]]), np.full((2, 1), 3.0), np.zeros((2, 1)))
    report = check_motion(model, motion, max_halvings=0)
    assert not report.certified
    assert not report.collides
    assert "not proved between samples" in report.summary()
    assert check_motion(model, motion).certified


def test_coal_confirms_at_the_samples(model):
    """Coal finds the same distances along a motion at the controller's period."""
    report = check_motion(model, _wave(model.chain.n, 0.3, 0.2, 2.0, 0.01))
    assert report.confirmed
    assert report.disagreement < 1e-5


def test_a_disagreement_is_not_confirmed(monkeypatch, limits):
    """Were our distances wrong by a tenth of a millimetre, the report would say so."""
    post = Box(name="post", size=[0.1, 0.1, 1.0], pose=homogeneous(np.eye(3), [-0.9, 0, 0]))
    model = _pendulum(limits, post)
    true = CollisionModel.clearance
    monkeypatch.setattr(CollisionModel, "clearance", lambda self, q: true(self, q) + 1e-4)
    report = check_motion(model, _wave(1, 0.3, 0.5, 1.0, 0.01))
    assert report.confirmed is False


@pytest.mark.slow
def test_blocks_of_a_long_motion_meet(monkeypatch, model):
    """A motion searched in blocks gives what it gives in one."""
    motion = _wave(model.chain.n, 0.3, 0.2, 2.0, 0.02)
    whole = check_motion(model, motion, confirm=False)
    monkeypatch.setattr("robots.collision.motion.SAMPLES_AT_A_TIME", 17)
    parts = check_motion(model, motion, confirm=False)
    # How far an interval is halved depends on what was found before, and so do the last digits of the smallest value.
    np.testing.assert_allclose(parts.clearance, whole.clearance, rtol=0, atol=1e-4)
    assert (parts.certified, parts.collides) == (whole.certified, whole.collides)
    assert (parts.lower_bound <= whole.clearance + 1e-12).all()
    assert (model.clearance(motion.q).min(axis=0) >= parts.clearance).all()


def test_edge_cases(limits, slider_chain, arm):
    """A single sample, a model without pairs and a motion of another robot."""
    wall = Plane(name="wall", normal=[-1.0, 0, 0], offset=-2.0)
    common = {"name": "s", "chain": slider_chain, "limits": limits(2), "capsules": (arm,)}
    model = CollisionModel(**common, scene=Scene(obstacles=(wall,)))
    still = Motion(np.zeros(1), np.zeros((1, 2)), np.zeros((1, 2)), np.zeros((1, 2)))
    report = check_motion(model, still)
    assert report.certified
    assert report.clearance[0] == pytest.approx(1.45, abs=1e-15)
    empty = check_motion(CollisionModel(**common), _wave(2, 0.3, 0.2, 1.0, 0.1))
    assert empty.certified
    assert empty.worst is None
    assert "no pair" in empty.summary()
    with pytest.raises(InputError, match="the motion has 3 joints"):
        check_motion(model, _wave(3, 0.3, 0.2, 1.0, 0.1))
