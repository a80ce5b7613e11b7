"""Logs of the six-joint robot of the catalogue."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation.gate import GateReport, check_log
from robots.loading import load_robot
from robots.plants import Sensors, nominal_plant, simulate
from robots.robot import Robot
from robots.signals import Log


@pytest.fixture(scope="session")
def er3a() -> Robot:
    """A six-joint robot with limits, gears and a description."""
    return load_robot("er3a")


@pytest.fixture(scope="session")
def good(er3a: Robot, fourier_motion: Callable) -> Callable[..., Log]:
    """Simulate a good log: five harmonics, encoders, 2 % torque noise, half of it coloured."""
    kept: dict[object, Log] = {}

    def build(seed: int = 1, *, duration: float = 20.0, period: float = 0.004, **sensors: float) -> Log:
        key = (seed, duration, period, tuple(sorted(sensors.items())))
        if key not in kept:
            plant = nominal_plant(er3a, friction="coulomb-viscous", sensors=Sensors(**sensors))
            kept[key] = simulate(plant, fourier_motion(er3a, seed, duration, period), seed=seed)
        return kept[key]

    return build


@pytest.fixture
def spoilt(er3a: Robot, good: Callable[..., Log]) -> Callable[..., GateReport]:
    """Check a good log with some of its fields replaced."""

    def check(**fields: np.ndarray) -> GateReport:
        return check_log(er3a, replace(good(), **fields))

    return check
