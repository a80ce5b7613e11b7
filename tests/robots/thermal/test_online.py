"""The online estimator against the offline simulation, in Python and in C."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from robots.common.errors import InputError
from robots.thermal import (
    ObserverSettings,
    OnlineFriction,
    SecondOrder,
    ThermalModel,
    cold_friction,
    generate_c,
    simulate_motion,
)

COEFFICIENTS = np.array([9.0, 6.0, -0.3, 0.02])


def motion(period: float, end: float) -> tuple[np.ndarray, np.ndarray]:
    """Strokes of 4 s, with rests."""
    t = np.arange(0.0, end, period)
    return t, np.where((t % 100.0) < 70.0, 3.0 * np.sin(2 * np.pi * t / 4.0), 0.0)


@pytest.mark.slow
@pytest.mark.parametrize("period", [0.02, 0.1, 0.5])
def test_algorithm_one_follows_the_simulation(model: ThermalModel, period: float) -> None:
    """At any sample time the estimate is that of the offline simulation."""
    t, dq = motion(period, 400.0)
    online = OnlineFriction(model, COEFFICIENTS, period, observer=ObserverSettings(window=1e6))
    torques, temperatures = np.empty(len(t)), np.empty(len(t))
    for k, v in enumerate(dq):
        temperatures[k] = online.temperatures[0]
        torques[k] = online.step(v)
    path = simulate_motion(model, t, dq, cold_friction(dq, COEFFICIENTS), resolution=max(period, 0.1))
    # The online step holds each sample's power for one period, the simulation joins samples by lines.
    allowed = 2.0 * path.averaging_error + 400.0 * model.rise(period)
    assert np.abs(temperatures - path.temperatures[:, 0]).max() < allowed
    np.testing.assert_allclose(torques, path.friction, atol=np.abs(path.friction).max() * abs(model.alpha) * allowed)
    assert online.heat == pytest.approx(path.energy[-1], rel=5e-3)


def test_a_long_period_is_stable(model: ThermalModel) -> None:
    """Steps of ten minutes at high power neither blow up nor swing: the feedback is implicit."""
    online = OnlineFriction(model, COEFFICIENTS, 600.0)
    seen = []
    for _ in range(400):
        online.step(3.0)
        seen.append(online.temperatures[0])
    power = float(cold_friction(np.array([3.0]), COEFFICIENTS)[0] * 3.0)
    # 67 h; a fractional model is then still a few degrees off its limit.
    assert seen[-1] == pytest.approx(model.response(np.array([240e3]), power)[0, 0], abs=0.5)
    assert np.all(np.diff(seen) > -1.0)


@pytest.mark.slow
def test_an_unknown_temperature_is_found(model: ThermalModel) -> None:
    """After a restart of a warm robot the observer finds the temperature from measured friction within minutes."""
    rng = np.random.default_rng(3)
    period = 0.05
    t, dq = motion(period, 600.0)
    truth = OnlineFriction(model, COEFFICIENTS, period)
    truth.reset(np.full(len(model.zones), 48.0))
    online = OnlineFriction(model, COEFFICIENTS, period, observer=ObserverSettings(torque_noise=1.0))
    online.reset(spread=20.0)
    errors, spreads = np.empty(len(t)), np.empty(len(t))
    for k, v in enumerate(dq):
        torque = truth.step(v)
        online.step(v, measured=torque + rng.normal(0.0, 1.0))
        errors[k] = online.temperatures[0] - truth.temperatures[0]
        spreads[k] = online.spread
    assert abs(errors[0]) > 20.0
    late = t > 300.0
    # The filter takes the noise of a window for constant, so that its own standard deviation is a safe one.
    assert np.abs(errors[late]).max() < 3.0 * spreads[late].max()
    assert np.abs(errors[late]).max() < 2.5


def test_a_zero_spread_ignores_residuals_at_first() -> None:
    """A joint that is known to be cold is not moved by one noisy torque."""
    model = SecondOrder(alpha=-0.01, beta=1.0, K1=4.0, K2=4.0, C1=700.0, C2=9000.0)
    online = OnlineFriction(model, COEFFICIENTS, 1.0)
    online.step(2.0, measured=100.0)
    assert online.temperatures[0] == pytest.approx(20.0, abs=0.5)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc on the path")
def test_c_does_the_same(model: ThermalModel, tmp_path: Path) -> None:
    """The generated C compiles without warnings and gives Python's torques and temperatures to rounding."""
    rng = np.random.default_rng(4)
    period = 0.1
    online = OnlineFriction(model, COEFFICIENTS, period, observer=ObserverSettings(window=0.5))
    source, library = tmp_path / "joint4.c", tmp_path / "joint4.so"
    source.write_text(generate_c(online, name="joint4"), encoding="utf-8")
    flags = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC"]
    subprocess.run(["gcc", *flags, str(source), "-o", str(library), "-lm"], check=True, capture_output=True)
    c = ctypes.CDLL(str(library))
    c.joint4_step.restype = c.joint4_temperature.restype = ctypes.c_double
    c.joint4_step.argtypes = [ctypes.c_void_p] + [ctypes.c_double] * 5
    c.joint4_temperature.argtypes = [ctypes.c_void_p, ctypes.c_int]
    c.joint4_reset.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_double]
    size = len(online.state)
    state = ctypes.create_string_buffer(8 * (size * size + size + 16))
    begin = np.full(len(model.zones), 25.0)
    c.joint4_reset(state, begin.ctypes.data, 15.0)
    online.reset(begin, spread=15.0)
    _, dq = motion(period, 120.0)
    for k, v in enumerate(dq):
        seen = float(online.cold(v) * 0.8 + rng.normal()) if k % 3 else float("nan")
        python = online.step(v, measured=seen, ambient=21.0)
        compiled = c.joint4_step(state, v, seen, 21.0, 1.0, 0.0)
        # The order of sums differs: rounding, over 1200 steps.
        assert compiled == pytest.approx(python, rel=1e-8, abs=1e-8)
    for zone, value in enumerate(online.temperatures):
        assert c.joint4_temperature(state, zone) == pytest.approx(value, rel=1e-8)


def test_bad_settings_are_refused(model: ThermalModel) -> None:
    """Periods, names, coefficients and settings that make no sense are named."""
    with pytest.raises(InputError, match="period"):
        OnlineFriction(model, COEFFICIENTS, 0.0)
    with pytest.raises(InputError, match="cold friction"):
        OnlineFriction(model, COEFFICIENTS[:3], 1.0)
    with pytest.raises(InputError, match="torque_noise"):
        ObserverSettings(torque_noise=0.0)
    online = OnlineFriction(model, COEFFICIENTS, 1.0)
    with pytest.raises(InputError, match="start temperatures"):
        online.reset([1.0, 2.0, 3.0])
    with pytest.raises(InputError, match="name in C"):
        generate_c(online, name="joint 4")
