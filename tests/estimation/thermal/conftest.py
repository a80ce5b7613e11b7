"""Heatings and coolings of a joint, by a general integrator of the written-out heat balances."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from estimation.thermal import ThermalRun

# Thesis eq. 130, joint 4; and its power at full duty.
TRUTH = {"alpha": -0.0141, "beta": 0.9971, "K1": 4.41, "K2": 4.57, "C1": 737.61, "C2": 9163.45}
POWER, COLD = 97.65, 18.0


def slope(t, y, power, p, motor):
    """The heat balances of thesis eq. 116, with the motor's heat of eq. 146; temperatures above T0 and Te."""
    heat = power * (p["alpha"] * y[0] + p["beta"]) + motor
    through = p["K1"] * (y[0] - y[1])
    return [(heat - through) / p["C1"], (through - p["K2"] * y[1]) / p["C2"]]


def follow(stages, start=(0.0, 0.0), truth=TRUTH):
    """Times, power, drives and temperatures over stages of (duration, step, power, motor heat)."""
    t, power, drives, T = [np.zeros(1)], [], [], [np.array([start])]
    for duration, step, watts, motor in stages:
        at = np.arange(step, duration + step / 2, step)
        y = solve_ivp(
            slope, (0, at[-1]), T[-1][-1], t_eval=at, args=(watts, truth, motor), method="LSODA", rtol=1e-9, atol=1e-9
        ).y.T
        t.append(t[-1][-1] + at)
        T.append(y)
        power.append(np.full(len(at), watts))
        drives.append(np.full(len(at), float(motor > 0)))
    return (
        np.concatenate(t),
        np.append(np.concatenate(power), 0.0),
        np.append(np.concatenate(drives), 0.0),
        np.concatenate(T),
    )


def build_run(
    duty: float = 1.0,
    seed: int = 0,
    *,
    noise: float = 0.01,
    heating: float = 7200.0,
    cooling: float = 7200.0,
    start: tuple[float, float] = (0.0, 0.0),
    every: float = 10.0,
    **options: object,
) -> ThermalRun:
    """Friction every 10 s of heating at a duty, and every 5 min of cooling, with noise in proportion to it."""
    stages = [(heating, every, duty * POWER, 0.0)] if heating else []
    stages += [(cooling, 300.0, 0.0, 0.0)] if cooling else []
    t, power, _, T = follow(stages, start)
    tau = COLD * (TRUTH["alpha"] * T[:, 0] + TRUTH["beta"])
    tau = tau * (1.0 + noise * np.random.default_rng(seed).standard_normal(len(tau)))
    known = {"ambient": 20.0, "name": f"duty {duty:g}", **options}
    return ThermalRun(t=t, power=power, friction=tau, cold_friction=COLD, **known)


@pytest.fixture(scope="session")
def heated() -> Callable[..., ThermalRun]:
    """Build one run of the thesis' joint 4."""
    return build_run


@pytest.fixture(scope="session")
def stages() -> Callable[..., tuple[np.ndarray, ...]]:
    """Follow the thesis' joint 4 through stages of power."""
    return follow


@pytest.fixture(scope="session")
def four_duties() -> Callable[[int], list[ThermalRun]]:
    """Build the thesis' experiment: duty cycles of 20, 40, 60 and 100 %, with noise of a seed."""
    clean = {duty: build_run(duty, noise=0.0) for duty in (0.2, 0.4, 0.6, 1.0)}

    def build(seed: int) -> list[ThermalRun]:
        rng = np.random.default_rng(seed)
        return [
            ThermalRun(
                t=run.t,
                power=run.power,
                friction=run.friction * (1.0 + 0.01 * rng.standard_normal(len(run.t))),
                cold_friction=COLD,
                name=run.name,
            )
            for run in clean.values()
        ]

    return build
