"""The search of a thermal fit: where it begins, the weights, which start temperatures are free, how fine the mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimation.thermal.runs.thermal_run import ThermalRun
from estimation.thermal.transcriptions.coordinates import DEGREES_PER_COORDINATE, from_coordinate
from estimation.thermal.transcriptions.information import Information, gather
from estimation.thermal.transcriptions.mesh import MeshSettings
from estimation.thermal.transcriptions.noise import NoiseLevels, estimate_levels, first_guess
from estimation.thermal.transcriptions.solve import solve
from estimation.thermal.transcriptions.structure import Structure
from estimation.thermal.transcriptions.transcription import Solution, Transcription
from robots.common.arrays import Array
from robots.common.errors import SolverError
from robots.thermal import ThermalModel


@dataclass
class Search:
    """The state of one fit.

    Attributes:
        kind: the thermal model.
        runs: the data.
        structure: what is searched.
        T0: temperature at which the cold friction holds [degC].
        start: ``auto``, ``ambient`` or ``free``, see `fit_thermal`.
    """

    kind: type[ThermalModel]
    runs: list[ThermalRun]
    structure: Structure
    T0: float
    start: str

    def __post_init__(self) -> None:
        first = 1.0 if self.kind.name == "fractional" else MeshSettings.first
        self.settings = MeshSettings(first=first)
        self.problem = Transcription(self.kind, self.runs, self.settings, self.T0)
        self.layout = self.problem.layout
        self.levels: NoiseLevels = first_guess(self.problem.rows)
        self.weights = self.levels.weights(self.problem.rows, self.problem.measured)
        self.heat_known = self.runs[0].power is not None
        # Surroundings that were not measured are those of T0, give or take so much [K]. Those of an unknown heat take
        # its constant part.
        spread = 3.0 if self.heat_known else 100.0
        unknown = np.array([run.ambient is None for run in self.runs])
        self.prior = np.where(unknown, DEGREES_PER_COORDINATE / spread, 0.0)
        self.free = np.zeros(self.problem.size, dtype=bool)
        for i, parameter in enumerate(self.kind.parameters):
            self.free[i] = parameter.name not in self.structure.fixed
        for r, run in enumerate(self.runs):
            zones = self.layout.start_slots(r)
            # A thermometer gives the start temperature of its zone.
            seen = self.start == "auto" and bool(run.readings(self.kind))
            self.free[zones] = self.start == "free" or seen
            self.free[self.layout.ambient_slot(r)] = run.ambient is None

    # Where to begin.

    def guess(self, rng: np.random.Generator | None) -> Array:
        """Typical coordinates, or those with every free positive parameter off by up to five times."""
        values = {}
        for parameter in self.kind.parameters:
            value = self.structure.fixed.get(parameter.name, parameter.typical)
            if parameter.name not in self.structure.fixed and rng is not None:
                if parameter.name == "nu":
                    value = float(rng.uniform(0.4, 0.95))
                elif parameter.name == "beta":
                    value = float(rng.uniform(0.9, 1.1))
                elif parameter.positive or parameter.name == "alpha":
                    value = float(value * np.exp(rng.uniform(-1.6, 1.6)))
            values[parameter.name] = float(np.clip(value, parameter.lower, parameter.upper))
            if parameter.name == "beta" and not self.heat_known:
                values["beta"] = 50.0 * value
        starts, ambients = [], []
        for r, run in enumerate(self.runs):
            around = first_ambient(run, self.T0)
            open_ = self.free[self.layout.start_slots(r)].any()
            seen = [values[np.isfinite(values)][0] for values in run.readings(self.kind).values()]
            starts.append(np.full(len(self.kind.zones), seen[0] if seen and open_ else around))
            ambients.append(around if run.ambient is not None or not seen else seen[0])
        return self.layout.to_coordinates(values, starts, ambients)

    def cost(self, coordinates: Array) -> float:
        """Half the weighted squares at coordinates."""
        return self.problem.solution_at(
            coordinates, self.weights, self.prior, success=False, status="", iterations=0
        ).cost

    def solve(self, coordinates: Array) -> Solution:
        """Minimises from coordinates."""
        return solve(self.problem, self.tied(coordinates), self.free, self.weights, self.prior)

    def tied(self, coordinates: Array) -> Array:
        """Moves fixed starts to the surroundings."""
        tied = coordinates.copy()
        for r, run in enumerate(self.runs):
            slots = self.layout.start_slots(r)
            if not self.free[slots].any() and run.ambient is None:
                tied[slots] = tied[self.layout.ambient_slot(r)]
        return tied

    def search(self, starts: int, rng: np.random.Generator) -> Solution:
        """Solves from the typical values and from the best of many random ones."""
        # Random guesses that are looked at for every one that is solved.
        looks = [self.guess(None), *(self.guess(rng) for _ in range(12 * (starts - 1)))]
        costs = np.array([self.cost(look) for look in looks])
        order = [0, *(np.argsort(costs[1:])[: starts - 1] + 1)]
        found = [self.solve(looks[k]) for k in order]
        usable = [solution for solution in found if np.isfinite(solution.cost)]
        best = min(usable, key=lambda solution: solution.cost, default=None)
        if best is None:
            raise SolverError(
                "thermal model: the fit converged from none of its starting points",
                remedy="check the units of power and torque",
            )
        return best

    def reweighted(self, solution: Solution) -> Solution:
        """Estimates the noise of each channel and fits again, until the levels settle."""
        for _ in range(4):
            rows = self.problem.rows
            predicted = self.problem.predict(solution.coordinates, solution.states)
            levels = estimate_levels(rows, predicted, int(self.free.sum()))
            before, self.levels = self.levels, levels
            weights = levels.weights(rows, predicted)
            change = np.abs(np.log(weights / self.weights))
            same = float(np.ptp(np.log(weights / self.weights))) < 0.02 and levels.proportional == before.proportional
            self.weights = weights
            solution = self.solve(solution.coordinates)
            if same or float(change.max()) < 0.02:
                break
        return solution

    def warm_starts(self, solution: Solution) -> tuple[Solution, tuple[int, ...]]:
        """Frees the start temperatures of runs that ask for it: those that come out far from the surroundings'."""
        closed = [r for r in range(len(self.runs)) if not self.free[self.layout.start_slots(r)].any()]
        before, levels, weights = self.free.copy(), self.levels, self.weights
        if not closed:
            return solution, ()
        self._open(closed)
        tried = self.reweighted(self.solve(solution.coordinates))
        info = gather(self.problem, tried, self.free, self.weights, self.prior)
        warm = [r for r in closed if self._hot(tried, info, r)]
        self.free = before
        if not warm:
            self.levels, self.weights = levels, weights
            return solution, ()
        self._open(warm)
        return self.reweighted(self.solve(tried.coordinates)), tuple(warm)

    def _open(self, runs: Sequence[int]) -> None:
        for r in runs:
            self.free[self.layout.start_slots(r)] = True

    def _hot(self, solution: Solution, info: Information, run: int) -> bool:
        """Whether a run's start is further from the surroundings than chance and half a degree allow."""
        slots = self.layout.start_slots(run)
        around = np.zeros(self.problem.size)
        gap = self.layout.start_at(solution.coordinates, run) - first_ambient(self.runs[run], self.T0)
        if self.runs[run].ambient is None:
            gap = self.layout.start_at(solution.coordinates, run) - self.layout.ambient_at(solution.coordinates, run)
            around[self.layout.ambient_slot(run)] = 1.0
        # Of the difference, in coordinates: starts less surroundings.
        pick = np.eye(self.problem.size)[slots] - around
        spread = pick @ info.covariance @ pick.T * DEGREES_PER_COORDINATE**2
        chi = float(gap @ np.linalg.pinv(spread, rcond=1e-10) @ gap)
        # Squared distance of a start from the surroundings, in standard errors, at which a run counts as one that
        # starts warm.
        return chi > 30.0 and bool(np.any(np.abs(gap) > 0.5))

    def refined(self, solution: Solution) -> Solution:
        """Halves the mesh until its error is small beside the noise."""
        for _ in range(3):
            finer = Transcription(self.kind, self.runs, self.settings.finer(), self.T0)
            states = finer.follow(solution.coordinates)
            here = self.problem.predict(solution.coordinates, solution.states)
            error = self.weights * (finer.predict(solution.coordinates, states) - here)
            # All discretisation errors together, over the noise: at this they move no number by more than 0.3 standard
            # errors.
            if float(np.sqrt(error @ error)) < 0.3:
                return solution
            self.settings, self.problem = self.settings.finer(), finer
            solution = self.solve(solution.coordinates)
        return solution

    def model_at(self, coordinates: Array) -> ThermalModel:
        """Builds the model from the coordinates of its parameters (p,)."""
        lower, upper = self.layout.bounds()
        # The solver keeps bounds to rounding.
        inside = [float(np.clip(c, lower[i], upper[i])) for i, c in enumerate(coordinates[: len(self.kind.parameters)])]
        values = {p.name: float(from_coordinate(p, inside[i])) for i, p in enumerate(self.kind.parameters)}
        around = next((first_ambient(run, self.T0) for run in self.runs if run.ambient is not None), self.T0)
        return self.kind(**values, ambient=around, reference=self.T0)


def first_ambient(run: ThermalRun, default: float) -> float:
    """Gives the surroundings' first temperature [degC], where they were measured."""
    if run.ambient is None:
        return default
    values = np.asarray(run.ambient)
    return float(values[np.isfinite(values)][0])
