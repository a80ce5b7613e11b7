import numpy as np
import pytest

from oed.retiming import finite_limits, limit_usage
from robots.common.errors import InfeasibleError
from robots.limits import Limits
from robots.signals import Motion


def _limits(**changes) -> Limits:
    values = {
        "lower": [-1.0, -np.inf],
        "upper": [1.0, np.inf],
        "velocity": [2.0, 3.0],
        "acceleration": [np.inf, 5.0],
        "jerk": [np.inf, np.inf],
        "torque": [10.0, np.inf],
    }
    return Limits(**{name: np.array(value) for name, value in {**values, **changes}.items()})


def test_defaults_fill_only_what_is_infinite():
    """Acceleration becomes 4/s times velocity and jerk 20/s times acceleration; what is stated stays."""
    filled = finite_limits(_limits())
    np.testing.assert_array_equal(filled.acceleration, [8.0, 5.0])
    np.testing.assert_array_equal(filled.jerk, [160.0, 100.0])
    np.testing.assert_array_equal(filled.velocity, [2.0, 3.0])


@pytest.mark.parametrize("name", ["velocity", "acceleration", "jerk"])
def test_a_limit_of_zero_is_infeasible(name):
    """A limit of zero names its joint."""
    with pytest.raises(InfeasibleError, match=f"joint 2: its {name} limit is zero"):
        finite_limits(_limits(**{name: [1.0, 0.0]}))


def test_usage_is_peak_over_limit():
    """Each peak is divided by its limit; of an infinite limit nothing is used, of a zero one everything."""
    t = np.array([0.0, 0.1, 0.2])
    motion = Motion(t, np.zeros((3, 2)), np.array([[0.0, 0], [-1, 0], [0, 0]]), np.array([[0.0, 0], [1, 0], [0, 2]]))
    usage = limit_usage(motion, _limits(jerk=[100.0, 0.0]), torque=np.array([[0.0, 9], [-5, 0], [0, 0]]))
    np.testing.assert_allclose(usage["velocity"], [0.5, 0.0])
    np.testing.assert_allclose(usage["acceleration"], [0.0, 0.4])
    np.testing.assert_allclose(usage["jerk"], [0.1, np.inf])
    np.testing.assert_allclose(usage["torque"], [0.5, 0.0])
