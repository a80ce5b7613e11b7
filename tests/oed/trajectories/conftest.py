import numpy as np
import pytest

from robots.limits import Limits


@pytest.fixture
def limits() -> Limits:
    """Three joints: one like a small arm's, one with a short range, one that turns without end."""
    return Limits(
        lower=np.array([-2.9, -0.2, -np.inf]),
        upper=np.array([2.9, 0.3, np.inf]),
        velocity=np.array([4.0, 4.0, 7.0]),
        acceleration=np.array([16.0, 16.0, 32.0]),
        jerk=np.array([320.0, 320.0, 640.0]),
        torque=np.array([120.0, 150.0, 12.0]),
    )
