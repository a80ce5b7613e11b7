"""Small designs of several robots, made once, and what is needed to look at them from outside."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
import pytest
from numpy.typing import NDArray

from oed.experiments import Design, Effort, InteriorPoint
from robots.geometry.chain import Chain, Joint
from robots.limits import Limits
from robots.loading import load_robot
from robots.robot import Robot
from tests.oed import flat

Array = NDArray[np.float64]

TINY = Effort(islands=1, starts=1, screened=10, hops=0, finish_samples=100)
BRIEF = InteriorPoint(max_iter=25, finish_iter=15)


def _turned(alpha: float) -> Array:
    cosine, sine = np.cos(alpha), np.sin(alpha)
    return np.array([[1.0, 0.0, 0.0], [0.0, cosine, -sine], [0.0, sine, cosine]])


def _made(kinds: str, name: str, **changes: Array) -> Robot:
    """A chain of revolute (R) and prismatic (P) joints, each square to the one before, without nominal dynamics."""
    joints = tuple(
        Joint(
            f"j{i + 1}",
            "revolute" if kind == "R" else "prismatic",
            _turned(np.pi / 2 * (-1) ** i),
            np.array([0.1 + 0.05 * i, 0.0, 0.2]),
            np.array([0.0, 0.0, 1.0]),
        )
        for i, kind in enumerate(kinds)
    )
    turning = np.array([kind == "R" for kind in kinds])
    limits = {
        "lower": np.where(turning, -2.0, -0.1),
        "upper": np.where(turning, 2.5, 0.5),
        "velocity": np.where(turning, 3.0, 0.8),
        "acceleration": np.where(turning, 15.0, 5.0),
        "jerk": np.where(turning, 300.0, 100.0),
        "torque": np.full(len(kinds), np.inf),
    }
    return Robot(name=name, chain=Chain(joints), limits=Limits(**{**limits, **changes}))


@lru_cache(maxsize=1)
def _robots() -> dict[str, Robot]:
    made = {
        "prismatic": _made("RPR", "prismatic"),
        "single": _made("RR"[:1], "single"),
        "seven": _made("RRRRRRR", "seven"),
        # Joint 2 has no room to reach its speed.
        "narrow": _made("RR", "narrow", lower=np.array([-2.0, 0.1]), upper=np.array([2.5, 0.3])),
    }
    return made | {name: load_robot(name) for name in ("er3a", "ur10", "panda")}


@lru_cache(maxsize=32)
def _designed(name: str, friction: str, criterion: str, seed: int) -> Design:
    return flat.design(
        _robots()[name],
        criterion=criterion,
        friction=friction,
        effort=TINY,
        solver=BRIEF,
        seed=seed,
        periods=1,
        workers=1,
    )


@pytest.fixture(scope="session")
def tiny() -> Effort:
    return TINY


@pytest.fixture(scope="session")
def brief() -> InteriorPoint:
    return BRIEF


@pytest.fixture(scope="session")
def make_robot() -> Callable[..., Robot]:
    """Build a robot of R and P joints."""
    return _made


@pytest.fixture(scope="session")
def robot_named() -> Callable[[str], Robot]:
    """Give a robot of the catalogue or of this file."""
    return lambda name: _robots()[name]


@pytest.fixture(scope="session")
def designed() -> Callable[..., Design]:
    """Design with tiny effort, once for each robot, friction, criterion and seed."""

    def run(name: str, friction: str = "coulomb-viscous", criterion: str = "cond", seed: int = 0) -> Design:
        return _designed(name, friction, criterion, seed)

    return run
