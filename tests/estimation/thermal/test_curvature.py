"""Intervals of a fit with a linear fall of friction, where it falls exponentially, and where it falls linearly."""

import numpy as np
import pytest

from estimation.thermal import ThermalRun, fit_thermal

pytestmark = pytest.mark.slow

# Heat exchanges [W/K] and capacities [J/K] of a gear with time constants of minutes, and its friction power [W].
K1, K2, C1, C2, POWER = 1.4, 0.5, 190.0, 900.0, 10.0
NOISE = 0.001


def campaign(fall, seed):
    """Ten logs of 2 min with short pauses and a long one: the friction, its span, and the true slow time constant."""
    t, on = np.arange(0.0, 2400.0, 10.0), np.ones(240)
    on[(t % 130 > 115) | ((t > 700) & (t < 1000))] = 0.0
    T1 = T2 = 0.0
    factor = np.empty(len(t))
    for k in range(len(t)):
        factor[k] = fall(T1)
        for _ in range(20):
            heat = POWER * on[k] * fall(T1)
            T1, T2 = T1 + 0.5 * (heat - K1 * (T1 - T2)) / C1, T2 + 0.5 * (K1 * (T1 - T2) - K2 * T2) / C2
    steady = 0.0
    for _ in range(200):
        steady = 0.5 * steady + 0.5 * POWER * fall(steady) * (1 / K1 + 1 / K2)
    slope = POWER * (fall(steady + 1e-4) - fall(steady - 1e-4)) / 2e-4
    A = np.array([[(slope - K1) / C1, K1 / C1], [K1 / C2, -(K1 + K2) / C2]])
    noisy = factor + NOISE * np.random.default_rng(seed).standard_normal(len(t))
    seen = on > 0
    run = ThermalRun(
        t=t, power=POWER * on, friction=np.where(seen, noisy, np.nan), cold_friction=1.0, ambient=20.0, name="campaign"
    )
    return run, factor[seen].max() / factor[seen].min(), float(np.max(-1.0 / np.linalg.eigvals(A).real))


@pytest.mark.parametrize("seed", [0, 1])
def test_intervals_hold_the_truth_of_an_exponential_fall(seed):
    """The slow time constant errs by more than its noise explains, and its interval says so; the span is right."""
    run, span, slow = campaign(lambda T: np.exp(-0.02 * T), seed)
    found = fit_thermal(run, start="ambient", starts=1)
    assert abs(found.time_constants[0].value - slow) < found.time_constants[0].half_width
    # The noise alone would state less than half of the error.
    plain = fit_thermal(run, start="ambient", starts=1, bounds=False).time_constants[0]
    assert abs(plain.value - slow) > 2.0 * plain.half_width
    assert found.span is not None
    assert abs(found.span.value - span) < found.span.half_width
    # Friction was measured to 0.1 %: its span is known to a percent, however little the steady state is.
    assert found.span.half_width < 0.01 * found.span.value


def test_a_linear_fall_keeps_narrow_intervals():
    """Where the logs show that friction falls linearly, the intervals are those of the noise, within 30 %."""
    run, span, slow = campaign(lambda T: 1.0 - 0.02 * T, 0)
    found = fit_thermal(run, start="ambient", starts=1)
    plain = fit_thermal(run, start="ambient", starts=1, bounds=False).time_constants[0]
    assert found.time_constants[0].half_width < 1.3 * plain.half_width
    assert abs(found.time_constants[0].value - slow) < found.time_constants[0].half_width
    assert found.span is not None
    assert found.span.value == pytest.approx(span, rel=0.01)
