"""Smooth motions of random robots, as the base model sees them."""

from __future__ import annotations

import numpy as np
import pytest

from robots.regressor import default_model
from robots.terms.effects import situation

PERIOD = 0.004


def _harmonics(n, seed, scale=0.4):
    random = np.random.default_rng(seed)
    k = np.arange(1, 6)
    return k, random.normal(size=(n, 5)) * scale / k, random.uniform(0, 2 * np.pi, (n, 5))


def _motion(robot, t, seed=0):
    """A sum of sines per joint with its exact derivatives, (N, n) each."""
    k, size, phase = _harmonics(robot.n, seed)
    w = 2 * np.pi * 0.2 * k
    angle = t[:, None, None] * w + phase
    return (
        (size * np.sin(angle)).sum(axis=2),
        (size * w * np.cos(angle)).sum(axis=2),
        -(size * w**2 * np.sin(angle)).sum(axis=2),
    )


@pytest.fixture(scope="session")
def motion():
    """Build a smooth motion of a robot at given times."""
    return _motion


@pytest.fixture(scope="session")
def seen(random_robot):
    """Build the situation of a random robot of n joints in one smooth motion, or in several."""

    def build(n=4, *, seed=3, times=None, starts=(0,), velocity_scale=0.0, robot=None):
        robot = robot or random_robot(seed, n)
        t = PERIOD * np.arange(1500) if times is None else times
        model = default_model(robot, velocity_scale=velocity_scale)
        return situation(model, model.nominal, t, *_motion(robot, t), starts=starts)

    return build


@pytest.fixture(params=[1, 3, 6])
def now(request, seen):
    """Give three random robots of five joints, each in one smooth motion."""
    return seen(5, seed=request.param)
