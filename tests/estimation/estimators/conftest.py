"""Problems that every estimator must solve: robots of several kinds, their truth, and exact or noisy data."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest

from estimation.estimators import RegressionData
from estimation.regressions.moments import Moments
from estimation.regressions.preparation import Rows
from robots.base_parameters import BaseParameters, find_base_parameters
from robots.geometry.chain import Chain, Joint
from robots.limits import Limits
from robots.loading import load_robot
from robots.regressor import default_model
from robots.robot import Robot
from robots.signals import Motion

PROBLEMS = ("one joint", "two joints", "with a prismatic joint", "seven joints")
BODY = np.array([2.0, 0.3, 0.1, -0.1, 0.06, -0.01, 0.02, 0.11, 0.01, 0.1])  # a body that can exist


@dataclass(frozen=True)
class Problem:
    """A robot with its true parameters."""

    base: BaseParameters
    standard: np.ndarray

    @property
    def truth(self) -> np.ndarray:
        """True base parameters (b,)."""
        return self.base.from_standard(self.standard)

    def motion(self, seed: int = 0, rows: int = 600, period: float = 0.02) -> Motion:
        """A Fourier motion, its derivatives in closed form."""
        n = self.base.model.robot.n
        rng = np.random.default_rng(seed)
        t = period * np.arange(rows)
        w = 2 * np.pi * np.arange(1, 6) / t[-1]
        a, b = rng.normal(size=(2, 5, n))
        s, c = np.sin(np.outer(t, w)), np.cos(np.outer(t, w))
        q = s @ (a / w[:, None]) - c @ (b / w[:, None])
        dq, ddq = c @ a + s @ b, c @ (b * w[:, None]) - s @ (a * w[:, None])
        scale = 1.2 / np.abs(dq).max(axis=0)
        return Motion(t=t, q=scale * q + 0.3, dq=scale * dq, ddq=scale * ddq)

    def data(self, noise: float = 0.0, seed: int = 0, parts: int = 2, ridge: float = 0.0, **options) -> RegressionData:
        """Exact motion, and torque with white noise of that share of its RMS."""
        rng = np.random.default_rng(seed)
        rows = []
        for index in range(parts):
            motion = self.motion(index, **options)
            tau = self.base.torque(motion.q, motion.dq, motion.ddq, self.truth)
            tau = tau + noise * np.sqrt(np.mean(tau**2, axis=0)) * rng.standard_normal(tau.shape)
            rows.append(Rows(motion, tau, np.ones_like(tau)))
        return make_data(self.base, rows, ridge)


def make_data(base: BaseParameters, rows: list[Rows], ridge: float = 0.0) -> RegressionData:
    """Sums the normal equations of parts."""
    total = None
    for part in rows:
        moments = Moments.of(base.regressor(part.motion.q, part.motion.dq, part.motion.ddq), part.tau, part.mask)
        total = moments if total is None else total + moments
    return RegressionData(base=base, moments=total, parts=rows, ridge=ridge)


def _chain(kinds: str) -> Robot:
    """A short arm of revolute (R) and prismatic (P) joints, with described bodies."""
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    joints = tuple(
        Joint(
            f"joint{i + 1}",
            "revolute" if kind == "R" else "prismatic",
            turn if i != 1 else np.eye(3),
            np.array([0.3 * (i > 0), 0.0, 0.1 * (i > 1)]),
            np.array([0.0, 0.0, 1.0]),
        )
        for i, kind in enumerate(kinds)
    )
    free = np.full(len(kinds), 3.0)
    limits = Limits(lower=-free, upper=free, velocity=free, acceleration=10 * free, jerk=free * 100, torque=free * 100)
    inertia = np.array([BODY * (1.0 + 0.5 * i) for i in range(len(kinds))])
    return Robot(name=kinds, chain=Chain(joints), limits=limits, inertia=inertia)


@cache
def _problem(name: str) -> Problem:
    robot = {
        "one joint": lambda: _chain("R"),
        "two joints": lambda: _chain("RR"),
        "with a prismatic joint": lambda: _chain("RPR"),
        "seven joints": lambda: load_robot("panda"),
    }[name]()
    model = default_model(robot, friction="coulomb-viscous", velocity_scale=1e-3)
    rng = np.random.default_rng(3)
    plausible = {"f1": 0.8, "f2": 0.5, "Im": 0.1, "offset": 0.2}
    standard = np.array(
        [
            plausible[column.symbol] * rng.uniform(0.7, 1.3) if column.symbol in plausible else value
            for column, value in zip(model.columns, model.nominal, strict=True)
        ]
    )
    return Problem(find_base_parameters(model), standard)


@pytest.fixture(scope="session")
def problem_named() -> Callable[[str], Problem]:
    """Give a problem by its name, one of `PROBLEMS`."""
    return _problem


@pytest.fixture(scope="session", params=PROBLEMS)
def problem(request: pytest.FixtureRequest) -> Problem:
    """Every problem in turn."""
    return _problem(request.param)


@pytest.fixture(scope="session")
def assemble() -> Callable[..., RegressionData]:
    """Make regression data of a list of rows."""
    return make_data
