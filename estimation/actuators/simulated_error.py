"""The error of the simulated motion over runs, and its derivatives by the free parameters."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.actuators.freedom import Fleet, Freedom
from estimation.actuators.runs import Run
from robots.drives import Start, simulate_drives

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Errors:
    """Errors of the simulated motion of one run.

    Attributes:
        run: the run.
        simulated: positions by the simulated encoders (N, n) [rad or m].
        jacobian: derivatives of these by the scaled free parameters (N, n, K); None without.
    """

    run: Run
    simulated: Array
    jacobian: Array | None = None

    @property
    def error(self) -> Array:
        """Measured less simulated (N, n) [rad or m]; zero where samples do not count."""
        return (self.run.q - self.simulated) * self.run.counted[:, None]


def simulate_runs(fleet: Fleet, values: Sequence[Array], runs: Sequence[Run], *, refinement: int = 1) -> list[Errors]:
    """Simulates all runs with given values, chain by chain.

    Args:
        fleet: the chains.
        values: their parameters, chain by chain.
        runs: what was commanded and measured.
        refinement: so many times shorter than usual are the steps.

    Raises:
        SolverError: the loop is not stable.
    """
    return [Errors(run=run, simulated=_chains(fleet, values, run, refinement)) for run in runs]


def linearised_runs(freedom: Freedom, values: Sequence[Array], runs: Sequence[Run]) -> list[Errors]:
    """Simulates all runs with derivatives by the free parameters.

    Raises:
        SolverError: the loop is not stable.
    """
    fleet = freedom.fleet
    found = []
    directions = freedom.directions
    for run in runs:
        simulated = np.empty_like(run.q)
        jacobian = np.zeros((*run.q.shape, len(freedom.free)))
        for chain, columns in enumerate(fleet.columns):
            used = np.flatnonzero(directions[chain].any(axis=0))
            start = Start(run.q[0, columns], run.start_velocity[columns])
            own = run.of(columns)
            result = simulate_drives(
                fleet.dynamics[chain],
                own,
                run.t,
                start,
                values[chain],
                directions=directions[chain][:, used],
                longest=run.step,
            )
            simulated[:, columns] = result.measured
            assert result.sensitivity is not None
            jacobian[:, columns[:, None], used] = result.sensitivity
        jacobian *= run.counted[:, None, None]
        found.append(Errors(run=run, simulated=simulated, jacobian=jacobian))
    return found


def _chains(fleet: Fleet, values: Sequence[Array], run: Run, refinement: int) -> Array:
    simulated = np.empty_like(run.q)
    for chain, columns in enumerate(fleet.columns):
        start = Start(run.q[0, columns], run.start_velocity[columns])
        longest = run.step / refinement
        result = simulate_drives(fleet.dynamics[chain], run.of(columns), run.t, start, values[chain], longest=longest)
        simulated[:, columns] = result.measured
    return simulated


def rms(errors: Sequence[Errors]) -> Array:
    """Root mean square error of each joint (n,) [rad or m] over runs."""
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
