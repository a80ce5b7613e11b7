"""Arrays of the size and shape of a real experiment: 60 s at 250 Hz."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from oed.reports import (
    Picture,
    error_bars_picture,
    friction_picture,
    margins_picture,
    parameter_picture,
    residual_picture,
    spectrum_picture,
    torque_picture,
    trajectory_picture,
)
from robots.limits import Limits, symmetric_margins
from robots.signals import Motion

Array = NDArray[np.float64]

SEGMENTS = (
    {"kind": "approach", "start": 0.0, "end": 2.0, "joint": None},
    {"kind": "fourier", "start": 2.0, "end": 42.0, "joint": None},
    {"kind": "friction", "start": 42.0, "end": 51.0, "joint": 1},
    {"kind": "friction", "start": 51.0, "end": 60.0, "joint": 2},
)


@dataclass(frozen=True)
class Case:
    """A robot of n joints, the last of them prismatic where there are two or seven."""

    n: int
    motion: Motion
    limits: Limits
    measured: Array
    predicted: Array

    @property
    def kinds(self) -> list[str]:
        return ["revolute"] * (self.n - 1) + ["prismatic" if self.n in (2, 7) else "revolute"]

    def pictures(self) -> tuple[Picture, ...]:
        """Draws everything there is."""
        n, motion, rng = self.n, self.motion, np.random.default_rng(1)
        margins = self.limits.margins(motion)
        margins += symmetric_margins("torque", motion.t, self.predicted, self.limits.torque)
        names = [f"{kind}_{joint}" for joint in range(1, n + 1) for kind in ("Ixx - Iyy + 0.4 mPx", "mPx", "f1")]
        values = rng.normal(size=3 * n)
        coefficients = np.column_stack([rng.uniform(1, 9, n), rng.uniform(1, 9, n), np.zeros(n), rng.uniform(0, 1, n)])
        return (
            trajectory_picture(
                motion.t, motion.q, motion.dq, motion.ddq, limits=self.limits, kinds=self.kinds, segments=SEGMENTS
            ),
            margins_picture(margins),
            spectrum_picture({"excitation": np.geomspace(200, 5, 6 * n), "whole": np.geomspace(250, 6, 6 * n)}),
            torque_picture(motion.t, self.measured, self.predicted, kinds=self.kinds),
            residual_picture(self.measured - self.predicted, motion.dq, period=0.004, kinds=self.kinds),
            parameter_picture(names, values, 0.1 * np.abs(values), ["kg m²", "kg m", "N m"] * n, references=values),
            friction_picture(
                coefficients,
                self.limits.velocity,
                covariances=np.tile(0.01 * np.eye(4), (n, 1, 1)),
                references=1.1 * coefficients,
                kinds=self.kinds,
            ),
            error_bars_picture({"before": np.full(n, 0.08), "after": np.full(n, 0.03)}, references={"target": 0.05}),
        )


def build(n: int) -> Case:
    rng = np.random.default_rng(n)
    t = 0.004 * np.arange(15_001)
    phases = 2 * np.pi * 0.1 * np.arange(1, 6) * t[:, None]
    q, dq, ddq = np.zeros((3, len(t), n))
    for joint in range(n):
        a, b = rng.normal(size=(2, 5)) * 0.3
        w = 2 * np.pi * 0.1 * np.arange(1, 6)
        q[:, joint] = np.sin(phases) @ a + np.cos(phases) @ b
        dq[:, joint] = np.cos(phases) @ (a * w) - np.sin(phases) @ (b * w)
        ddq[:, joint] = -np.sin(phases) @ (a * w**2) - np.cos(phases) @ (b * w**2)
    ones = np.ones(n)
    limits = Limits(-3 * ones, 3 * ones, 2.5 * ones, 30 * ones, np.inf * ones, 200 * ones)
    predicted = 30 * ddq + 8 * np.sign(dq) + 10 * dq
    measured = predicted + rng.normal(size=predicted.shape)
    measured[5000:5600, 0] = np.nan
    return Case(n, Motion(t, q, dq, ddq), limits, measured, predicted)


@pytest.fixture(scope="session", params=[1, 2, pytest.param(7, marks=pytest.mark.longer)], ids=lambda n: f"{n} joints")
def case(request: pytest.FixtureRequest) -> Case:
    return build(request.param)


@pytest.fixture(scope="session")
def six() -> Case:
    return build(6)
