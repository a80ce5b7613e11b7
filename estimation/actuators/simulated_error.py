"""The error of the simulated motion over runs, and its derivatives by the free parameters."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from estimation.actuators.freedom import Fleet, Freedom
from estimation.actuators.runs import Run
from robots.common.arrays import Array
from robots.drives import Start, simulate_drives
from robots.drives.simulation import WIDTH

NARROW = 1e-5
"""Speed [rad/s or m/s] below which dry friction fades in a refined simulation."""
CHAINS = ThreadPoolExecutor(2, "chains")
"""Threads in which chains are simulated: compiled steps run outside of Python."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Errors:
    """Errors of the simulated motion of one run.

    Attributes:
        run: the run.
        simulated: positions by the simulated encoders (N, n) [rad or m]; with currents these beside them (N, 2 n).
        jacobian: derivatives of these by the scaled free parameters (N, n or 2 n, K); None without.
    """

    run: Run
    simulated: Array
    jacobian: Array | None = None

    @property
    def error(self) -> Array:
        """Measured less simulated (N, n or 2 n); zero where samples do not count."""
        return (measured(self.run) - self.simulated) * self.run.counted[:, None]


def measured(run: Run) -> Array:
    """Positions of a run (N, n), and beside them its currents (N, 2 n) if it has them."""
    return run.q if run.current is None else np.hstack([run.q, run.current])


def simulate_runs(fleet: Fleet, values: Sequence[Array], runs: Sequence[Run], *, refinement: int = 1) -> list[Errors]:
    """Simulates all runs with given values, chain by chain.

    Args:
        fleet: the chains.
        values: their parameters, chain by chain.
        runs: what was commanded and measured.
        refinement: so many times shorter than usual are the steps; above 1 dry friction fades faster, too.

    Raises:
        SolverError: the loop is not stable.
    """
    return [Errors(run=run, simulated=_chains(fleet, values, run, refinement)[0]) for run in runs]


def linearised_runs(
    freedom: Freedom, values: Sequence[Array], runs: Sequence[Run], *, refinement: int = 1
) -> list[Errors]:
    """Simulates all runs with derivatives by the free parameters.

    Args:
        freedom: what is free.
        values: of all parameters, chain by chain.
        runs: what was commanded and measured.
        refinement: as in `simulate_runs`.

    Raises:
        SolverError: the loop is not stable.
    """
    directions = freedom.directions
    return [
        Errors(run=run, simulated=simulated, jacobian=jacobian * run.counted[:, None, None])
        for run in runs
        for simulated, jacobian in [_chains(freedom.fleet, values, run, refinement, directions)]
    ]


def _chains(
    fleet: Fleet, values: Sequence[Array], run: Run, refinement: int, directions: Sequence[Array] | None = None
) -> tuple[Array, Array]:
    """What all chains would have measured, and its derivatives by the directions; none without."""
    simulated = np.empty_like(measured(run))
    count = 0 if directions is None else directions[0].shape[1]
    jacobian = np.zeros((*simulated.shape, count))

    def fill(chain: int) -> None:
        columns = fleet.columns[chain]
        dynamics, own = fleet.dynamics[chain], values[chain]
        used = np.zeros(0, dtype=int) if directions is None else np.flatnonzero(directions[chain].any(axis=0))
        found = simulate_drives(
            dynamics,
            run.of(columns),
            run.t,
            Start(run.q[0, columns], run.start_velocity[columns]),
            own,
            directions=None if directions is None else directions[chain][:, used],
            longest=run.step / refinement,
            situation=run.situations[chain] if run.situations else None,
            efforts=run.current is not None,
            width=WIDTH if refinement == 1 else NARROW,
        )
        simulated[:, columns] = found.measured
        if directions is not None:
            assert found.sensitivity is not None
            jacobian[:, columns[:, None], used] = found.sensitivity
        if found.effort is None:
            return
        # The current is the motor's torque over its constant, which may be free itself.
        places = dynamics.layout.of("torque_constant")
        constant, shown = own[places], fleet.n + columns
        simulated[:, shown] = found.effort / constant
        if directions is not None:
            assert found.effort_sensitivity is not None
            jacobian[:, shown[:, None], used] = found.effort_sensitivity / constant[:, None]
            by_constant = -(found.effort / constant**2)[:, :, None] * directions[chain][places][:, used]
            jacobian[:, shown[:, None], used] += by_constant

    chains = range(len(fleet.columns))
    if len(chains) == 1:
        fill(0)
    else:
        list(CHAINS.map(fill, chains))
    return simulated, jacobian


def rms(errors: Sequence[Errors]) -> Array:
    """Root mean square error of each joint (n,) [rad or m] over runs; with currents, then that of these (2 n,)."""
    squares = sum((part.error**2).sum(axis=0) for part in errors)
    counts = sum(int(part.run.counted.sum()) for part in errors)
    return np.asarray(np.sqrt(squares / max(counts, 1)))


def prepare(fleet: Fleet) -> None:
    """Compiles the functions of all chains, several at a time: the compiler runs outside of Python."""
    with ThreadPoolExecutor(2) as pool:
        for result in [
            pool.submit(getattr, dynamics, name) for dynamics in fleet.dynamics for name in ("step", "slopes")
        ]:
            result.result()
