import numpy as np
import pytest

from robots.limits import Limits

_DEGREES = np.pi / 180


@pytest.fixture
def limits() -> Limits:
    """Six joints of a small arm."""
    return Limits(
        lower=-_DEGREES * np.array([167.0, 130.0, 71.0, 180.0, 113.0, 360.0]),
        upper=_DEGREES * np.array([167.0, 90.0, 101.0, 180.0, 113.0, 360.0]),
        velocity=_DEGREES * np.array([230.0, 230.0, 250.0, 320.0, 320.0, 420.0]),
        acceleration=np.array([16.0, 16.0, 18.0, 24.0, 24.0, 32.0]),
        jerk=np.array([320.0, 320.0, 360.0, 480.0, 480.0, 640.0]),
        torque=np.array([120.0, 150.0, 70.0, 25.0, 20.0, 12.0]),
    )
