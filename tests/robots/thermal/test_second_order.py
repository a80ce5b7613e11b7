"""The second-order thermal model against a general integrator and the published time constants."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from robots.common.errors import InputError
from robots.loading import load_robot
from robots.thermal import SecondOrder, known_thermal

THESIS = SecondOrder(alpha=-0.0141, beta=0.9971, K1=4.41, K2=4.57, C1=737.61, C2=9163.45, ambient=20.0)


def integrated(model: SecondOrder, power: np.ndarray, steps: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Temperatures after each step, by the heat balances written out (thesis eq. 116)."""
    states = [start]
    for W, h in zip(power, steps, strict=True):

        def slope(_: float, y: np.ndarray, W: float = W) -> list[float]:
            heat = W * (model.alpha * (y[0] - model.ambient) + model.beta)
            through = model.K1 * (y[0] - y[1])
            return [(heat - through) / model.C1, (through - model.K2 * (y[1] - model.ambient)) / model.C2]

        states.append(solve_ivp(slope, (0.0, h), states[-1], method="LSODA", rtol=1e-10, atol=1e-10).y[:, -1])
    return np.array(states)


def test_time_constants_are_those_of_the_thesis() -> None:
    """At 97.65 W the time constants are 28.55 and 2.02 min (eq. 126 and 127; two decimals are stated)."""
    np.testing.assert_allclose(THESIS.time_constants(97.65) / 60.0, [28.55, 2.02], atol=0.005)


def test_time_constants_solve_the_quadratic_of_the_thesis() -> None:
    """The time constants are those of s^2 + p s + q with the thesis' p and q, at any power."""
    m = THESIS
    for W in (0.0, 10.0, 97.65, 500.0):
        p = (m.C1 * (m.K1 + m.K2) + m.C2 * (m.K1 - W * m.alpha)) / (m.C1 * m.C2)
        q = -((m.K1 + m.K2) * W * m.alpha - m.K1 * m.K2) / (m.C1 * m.C2)
        # Rounding of a well-conditioned quadratic.
        np.testing.assert_allclose(m.time_constants(W), np.sort(-1.0 / np.roots([1.0, p, q]))[::-1], rtol=1e-9)


def test_more_power_warms_up_faster() -> None:
    """Both time constants fall as the power rises, because friction falls with temperature."""
    constants = THESIS.time_constants(np.linspace(0.0, 300.0, 31))
    assert np.all(np.diff(constants, axis=0) < 0.0)


def test_temperatures_follow_the_heat_balances() -> None:
    """Steps of any length, with the power of each constant, agree with a general integrator of the heat balances."""
    rng = np.random.default_rng(1)
    power, steps = rng.uniform(0.0, 200.0, 25), rng.uniform(0.5, 900.0, 25)
    start = np.array([31.0, 24.0])
    ours = THESIS.temperatures(power, steps, start=start)
    # The integrator's tolerance, over 25 steps.
    np.testing.assert_allclose(ours, integrated(THESIS, power, steps, start), rtol=0, atol=1e-6)


def test_a_long_step_equals_many_short_ones() -> None:
    """The discretisation is exact: an hour in one step ends where an hour in steps of 4 ms would, but for rounding."""
    whole = THESIS.temperatures([97.65], [3600.0])[-1]
    parts = THESIS.temperatures(np.full(9000, 97.65), 0.4)[-1]
    np.testing.assert_allclose(parts, whole, rtol=0, atol=1e-9)


def test_steady_state_balances() -> None:
    """At the steady state, A T + b is zero, and the temperatures of a long time reach it."""
    A, b = THESIS.system(97.65)
    limit = THESIS.steady_state(97.65)
    np.testing.assert_allclose(A @ limit + b, 0.0, atol=1e-14)
    np.testing.assert_allclose(THESIS.temperatures([97.65], [1e6])[-1], limit, atol=1e-9)


def test_a_joint_that_rests_stays_at_the_ambient_temperature() -> None:
    """Without power and from the surroundings' temperature nothing changes."""
    np.testing.assert_array_equal(THESIS.temperatures(np.zeros(3), 100.0), 20.0)


def test_friction_of_the_warm_joint_is_lower() -> None:
    """At 97.65 W friction ends at some 60 % of that at the surroundings' temperature: cold is up to 70 % above warm."""
    factor = THESIS.friction_factor(THESIS.steady_state(97.65)[0])
    assert 1.0 / 1.75 < factor < 1.0 / 1.5


@settings(max_examples=50, deadline=None)
@given(
    power=st.floats(0.0, 1e4),
    step=st.floats(0.0, 1e6),
    ratio=st.floats(1e-3, 1e3),
    alpha=st.floats(-0.05, 0.0),
)
def test_temperatures_stay_between_start_and_steady_state(
    power: float, step: float, ratio: float, alpha: float
) -> None:
    """From the surroundings' temperature a joint warms up towards its steady state and never beyond it."""
    model = SecondOrder(alpha=alpha, beta=1.0, K1=4.0 * ratio, K2=4.0, C1=700.0, C2=9000.0 / ratio)
    end, limit = model.temperatures([power], [step])[-1], model.steady_state(power)
    slack = 1e-9 * np.maximum(limit, 1.0)
    assert np.all(end >= model.ambient - slack)
    assert np.all(end <= limit + slack)


@pytest.mark.parametrize("change", [{"K1": 0.0}, {"C2": -1.0}, {"alpha": 0.1}, {"beta": np.nan}, {"ambient": np.inf}])
def test_parameters_out_of_range_are_refused(change: dict[str, float]) -> None:
    """A heat capacity, an exchange or a slope of the wrong sign is bad input that is named."""
    values = {"alpha": -0.01, "beta": 1.0, "K1": 4.0, "K2": 4.0, "C1": 700.0, "C2": 9000.0, **change}
    (name,) = change
    with pytest.raises(InputError, match=name.replace("ambient", "ambient temperature")):
        SecondOrder(**values)


def test_bad_signals_are_refused() -> None:
    """Negative powers and times, and arrays of wrong shapes, are bad input."""
    for power, steps, start in (([-1.0], 1.0, None), ([1.0], -1.0, None), ([[1.0]], 1.0, None), ([1.0], 1.0, [20.0])):
        with pytest.raises(InputError, match="thermal model"):
            THESIS.temperatures(power, steps, start=start)


def test_known_parameters_say_where_they_come_from() -> None:
    """The er3a's fourth joint has the thesis' parameters, the others have them as assumed; other robots have none."""
    known = known_thermal(load_robot("er3a"), ambient=25.0)
    assert known is not None
    assert [model.ambient for model in known.models] == [25.0] * 6
    assert known.models[3].K1 == 4.41
    assert ["assumed" in source for source in known.sources] == [True, True, True, False, True, True]
    assert known_thermal(load_robot("ur10")) is None
