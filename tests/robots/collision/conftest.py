"""Random segments and boxes, and small robots for which distances are known in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from robots.collision import Capsule
from robots.geometry.chain import Chain, Joint
from robots.limits import Limits


@pytest.fixture(autouse=True)
def _without_compiler(monkeypatch):
    """Compiling takes longer than these tests; that both evaluators agree is tested once."""
    monkeypatch.setenv("ROBOT_OED_BACKEND", "vectorised")


@pytest.fixture
def segments():
    """Draw N pairs of segments (4, N, 3): general ones, and near-parallel, parallel and degenerate ones."""

    def draw(count: int, seed: int = 0) -> np.ndarray:
        random = np.random.default_rng(seed)
        a0, a1, b0, b1 = random.uniform(-0.4, 0.4, (4, count, 3))
        part = count // 8
        tilt = 10.0 ** random.uniform(-12, -1, (part, 1)) * random.normal(size=(part, 3))
        b1[:part] = b0[:part] + (a1 - a0)[:part] * random.uniform(-1.5, 1.5, (part, 1)) + tilt
        b1[part : 2 * part] = b0[part : 2 * part] + (a1 - a0)[part : 2 * part]
        a1[2 * part : 3 * part] = a0[2 * part : 3 * part]
        b1[int(2.5 * part) : int(3.5 * part)] = b0[int(2.5 * part) : int(3.5 * part)]
        return np.stack([a0, a1, b0, b1])

    return draw


@pytest.fixture
def limits():
    """Make limits of n joints, wide enough not to matter."""

    def make(n: int, span: float = 3.0) -> Limits:
        ones = np.ones(n)
        return Limits(-span * ones, span * ones, 9 * ones, 99 * ones, 999 * ones, 99 * ones)

    return make


@pytest.fixture
def slider_chain():
    """A slide along x with a turning arm of 0.5 m in the plane x-y."""
    slide = Joint("slide", "prismatic", np.eye(3), np.zeros(3), np.array([1.0, 0.0, 0.0]))
    turn = Joint("turn", "revolute", np.eye(3), np.array([0.0, 0.0, 0.3]))
    tip = np.eye(4)
    tip[0, 3] = 0.5
    return Chain((slide, turn), tip=tip)


@pytest.fixture
def arm():
    """The capsule on the turning arm: along its x, radius 50 mm."""
    return Capsule(name="arm", link=2, start=np.zeros(3), end=np.array([0.5, 0, 0]), radius=0.05)
