import numpy as np
import pytest

from robots.limits import Limits


@pytest.fixture(scope="session")
def limits() -> Limits:
    return Limits(
        lower=np.array([-2.9, -0.2]),
        upper=np.array([2.9, 0.3]),
        velocity=np.array([4.0, 3.0]),
        acceleration=np.array([16.0, 12.0]),
        jerk=np.array([320.0, 200.0]),
        torque=np.array([120.0, 150.0]),
    )
