"""Measured poses of an arm that shares no code with the calibration."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.calibration_parts import oracle
from robots import load_robot
from robots.geometry_errors import Markers, MeasuredPoses, random_positions
from robots.geometry_errors.poses import approaches

NOISE = 5e-5  # m


def measured(robot, count, errors, *, seed=0, noise=NOISE, setup_seed=0):
    """Poses of the oracle's arm with three markers."""
    rng = np.random.default_rng(seed)
    q = random_positions(robot, count, seed=seed)
    pose = oracle.flange(oracle.Arm.of(robot), q, errors)
    observed = oracle.markers(pose, *oracle.usual_setup(np.random.default_rng(setup_seed)))
    observed = observed + noise * rng.standard_normal(observed.shape)
    return MeasuredPoses(q=q, measurement=Markers(count=3), observed=observed, approach=approaches(q))


@pytest.fixture(scope="session")
def ur10():
    return load_robot("ur10")


@pytest.fixture(scope="session")
def truth(ur10):
    """Zeros of 5 mrad, links of 1 mm and 1 mrad, eccentricity and compliance."""
    return oracle.usual_errors(oracle.Arm.of(ur10), np.random.default_rng(7))


@pytest.fixture(scope="session")
def poses(ur10, truth):
    return measured(ur10, 40, truth, seed=1)


@pytest.fixture(scope="session")
def calibration(ur10, truth, poses):
    """A calibration with all that the command does, and another session to check it on."""
    from estimation import calibrate

    return calibrate(ur10, poses, held_out=measured(ur10, 30, truth, seed=2))
