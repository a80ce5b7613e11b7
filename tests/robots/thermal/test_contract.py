"""What all thermal models promise, against general integrators of the written-out heat balances."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from robots.common.errors import InputError
from robots.thermal import (
    THERMAL_MODELS,
    Advanced,
    Fractional,
    ThermalModel,
    build_thermal_model,
    simulate_cycles,
    simulate_motion,
    thermal_model_class,
)

_SPEC = importlib.util.spec_from_file_location("thermal_oracles", Path(__file__).with_name("oracles.py"))
assert _SPEC is not None
oracles = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(oracles)


def graded(end: float, count: int) -> np.ndarray:
    """Times that are dense at the start, where a fractional response is steep."""
    return end * np.linspace(0.0, 1.0, count) ** 3


def oracle(model: ThermalModel, power: float, t: np.ndarray, start: float) -> np.ndarray:
    """Temperature where heat is produced, from a uniform start, at constant power."""
    if isinstance(model, Fractional):
        return oracles.fractional(model.values, np.full(len(t), power), t, start)
    begin = np.full(len(model.zones), start)
    return oracles.integrate(model.name, model.values, lambda _: power, t, begin)[:, 0]


@pytest.mark.slow
@pytest.mark.parametrize(("power", "start"), [(97.65, 20.0), (0.0, 45.0), (40.0, 33.0)])
def test_the_response_to_constant_power_is_the_solution(model: ThermalModel, power: float, start: float) -> None:
    """The closed form (eq. 110, 122, 141) solves the heat balance to 1e-6 of the temperature's change."""
    t = graded(7200.0, 1500 if isinstance(model, Fractional) else 60)
    ours = model.response(t, power, start=np.full(len(model.zones), start))[:, 0]
    theirs = oracle(model, power, t, start)
    # The fractional oracle is of second order: its own error at these times is some 2e-6 of 30 K.
    scale = np.abs(theirs - start).max()
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=(3e-6 if isinstance(model, Fractional) else 1e-6) * scale)


@pytest.mark.slow
def test_steps_of_any_length_agree(model: ThermalModel) -> None:
    """Powers that change from step to step, over seconds or hours, are followed exactly."""
    rng = np.random.default_rng(1)
    power, steps = rng.uniform(0.0, 200.0, 12), rng.uniform(20.0, 900.0, 12)
    ours = model.temperatures(power, steps)[:, 0]
    edges = np.concatenate([[0.0], np.cumsum(steps)])
    if isinstance(model, Fractional):
        # Each piece is dense at its start; the power at a time is that of the piece which ends there.
        pieces = [edges[k] + graded(steps[k], 160)[1:] for k in range(12)]
        t, W = np.concatenate([[0.0], *pieces]), np.concatenate([[power[0]], np.repeat(power, 159)])
        theirs = oracles.fractional(model.values, W, t, 20.0)[np.arange(13) * 159]
        # The oracle's g jumps with the power within its first, shortest step of a piece.
        tolerance = 2e-3
    else:
        values = oracles.integrate(
            model.name,
            model.values,
            lambda time: power[min(int(np.searchsorted(edges, time, side="right")) - 1, 11)],
            edges,
            np.full(len(model.zones), 20.0),
            breaks=edges,
        )
        theirs, tolerance = values[:, 0], 1e-6
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=tolerance)


def test_the_steady_state_is_the_end(model: ThermalModel) -> None:
    """A long time at constant power ends at the steady state; a fractional model goes there as a power of time."""
    limit = model.steady_state(97.65)
    end = model.response(np.array([1e9]), 97.65)[0]
    np.testing.assert_allclose(end, limit, atol=1e-2 if isinstance(model, Fractional) else 1e-9)


def test_time_constants_fall_with_power(model: ThermalModel) -> None:
    """The more power, the faster the warm-up, because friction falls with temperature (eq. 112)."""
    constants = model.time_constants(np.linspace(0.0, 300.0, 13))
    assert np.all(np.diff(constants, axis=0) < 0.0)
    assert np.all(np.diff(constants, axis=1) < 0.0)


def test_the_slope_is_the_derivative(model: ThermalModel) -> None:
    """dx/dt is A x + b."""
    rng = np.random.default_rng(2)
    x = 20.0 + rng.normal(size=model.state_count())
    A, b = model.system(55.0, ambient=17.0)
    np.testing.assert_allclose(model.derivative(x, 55.0, ambient=17.0), A @ x + b, rtol=1e-9, atol=1e-9)


def test_the_ambient_temperature_is_felt(model: ThermalModel) -> None:
    """Surroundings that are warmer by ten degrees end ten degrees higher where friction does not depend on it."""
    cool = replace(model, alpha=0.0)
    difference = cool.steady_state(50.0, ambient=30.0) - cool.steady_state(50.0, ambient=20.0)
    np.testing.assert_allclose(difference, 10.0, rtol=1e-9)


@pytest.mark.slow
def test_any_motion_is_followed(model: ThermalModel) -> None:
    """A motion of strokes and pauses gives the temperatures of its momentary power, within the stated error."""
    t = np.arange(0.0, 400.0, 0.02)
    moving = (t % 200.0) < 120.0
    dq = np.where(moving, 3.0 * np.sin(2 * np.pi * t / 4.0), 0.0)
    cold = 9.0 * np.sign(dq) + 6.0 * dq
    path = simulate_motion(model, t, dq, cold, resolution=1.0)
    power = cold * dq
    if isinstance(model, Fractional):
        coarse = t[::20]
        theirs = oracles.fractional(model.values, power[::20], coarse, 20.0)
        ours, allowed = path.temperatures[::20, 0], path.averaging_error + 0.02
    else:
        at = np.linspace(0.0, t[-1], 61)
        theirs = oracles.integrate(
            model.name,
            model.values,
            lambda time: float(np.interp(time, t, power)),
            at,
            np.full(len(model.zones), 20.0),
            breaks=np.arange(0.0, t[-1], 100.0),
        )[:, 0]
        ours, allowed = np.interp(at, t, path.temperatures[:, 0]), path.averaging_error
    assert 0.0 < path.averaging_error < (3.0 if isinstance(model, Fractional) else 0.2)
    assert np.abs(ours - theirs).max() < allowed
    np.testing.assert_allclose(path.friction, cold * model.friction_factor(path.temperatures[:, 0]), atol=1e-12)
    assert path.energy[-1] == pytest.approx(np.trapezoid(path.power, t), rel=1e-9)


@pytest.mark.slow
def test_repeated_cycles_may_be_averaged(model: ThermalModel) -> None:
    """One step a cycle gives what the momentary power gives, within the stated error (eq. 129)."""
    t = np.arange(0.0, 4.0, 0.02)
    dq = 3.0 * np.sin(2 * np.pi * t / 4.0)
    cold = 9.0 * np.sign(dq) + 6.0 * dq
    averaged = simulate_cycles(model, t, dq, cold, 100, pause=2.0)
    whole = np.concatenate([t + 5.98 * k for k in range(100)])
    fine = simulate_motion(
        model,
        np.arange(0.0, 598.0, 0.02),
        np.interp(np.arange(0.0, 598.0, 0.02) % 5.98, t, dq, right=0.0),
        np.interp(np.arange(0.0, 598.0, 0.02) % 5.98, t, cold, right=0.0),
        resolution=0.1,
    )
    assert whole[-1] < averaged.t[-1]
    gap = np.interp(averaged.t[:-1], fine.t, fine.temperatures[:, 0]) - averaged.temperatures[:-1, 0]
    assert np.abs(gap).max() < averaged.averaging_error
    assert averaged.averaging_error < (3.0 if isinstance(model, Fractional) else 1.0)


def test_a_pause_between_logs_is_a_rest(model: ThermalModel) -> None:
    """Samples that are far apart in time make no heat between them."""
    t = np.concatenate([np.arange(0.0, 60.0, 0.1), 600.0 + np.arange(0.0, 60.0, 0.1)])
    path = simulate_motion(model, t, np.full(t.shape, 2.0), np.full(t.shape, 20.0))
    at = path.temperatures[:, 0]
    assert at[600] < at[599]
    assert path.energy[600] == path.energy[599]


def test_models_are_written_and_read(model: ThermalModel) -> None:
    """A model survives its plain data."""
    assert build_thermal_model(model.to_dict()) == model
    assert thermal_model_class(model.name) is type(model)


def test_bad_values_are_refused(model: ThermalModel) -> None:
    """Each parameter out of range is named; so are powers, times and starts that make no sense."""
    for parameter in model.parameters:
        wrong = 0.1 if parameter.name == "alpha" else -1.0
        with pytest.raises(InputError, match=parameter.name):
            replace(model, **{parameter.name: wrong})
    with pytest.raises(InputError, match="friction power"):
        model.temperatures([-1.0], 1.0)
    with pytest.raises(InputError, match="time step"):
        model.temperatures([1.0], -1.0)
    with pytest.raises(InputError, match="start temperatures"):
        model.temperatures([1.0], 1.0, start=[20.0, 20.0, 20.0])
    with pytest.raises(InputError, match="do not increase"):
        simulate_motion(model, [0.0, 0.0], [1.0, 1.0], [1.0, 1.0])
    with pytest.raises(InputError, match="shapes"):
        simulate_motion(model, [0.0, 1.0], [1.0], [1.0, 1.0])


def test_parameters_state_units_and_bounds() -> None:
    """Every parameter has a unit, bounds, and a value in between to begin with."""
    for kind in THERMAL_MODELS.values():
        for parameter in kind.parameters:
            assert parameter.unit
            assert parameter.lower <= parameter.typical <= parameter.upper
    with pytest.raises(InputError, match="unknown thermal model"):
        thermal_model_class("third")
    with pytest.raises(InputError, match="thermal model first"):
        build_thermal_model({"model": "first", "K9": 1.0})


def test_a_thermocouple_is_an_input() -> None:
    """With T3 given, the advanced model is eq. 147 as it stands; the drives' heat stops where they are off."""
    model = Advanced(alpha=-0.0141, beta=1.0, K12=4.4, K2e=4.6, C1=740.0, C2=9200.0, W_e=12.0, K13=1.5, K23=0.8)
    steps = np.full(40, 60.0)
    for drives in (0.0, 1.0):
        ours = model.temperatures(np.full(40, 50.0), steps, T3=np.full(40, 24.0), drives=drives)
        at = np.concatenate([[0.0], np.cumsum(steps)])
        theirs = oracles.integrate("advanced", model.values, lambda _: 50.0, at, [20.0, 20.0], drives=drives, T3=24.0)
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-6)
