"""Runs of one joint as one nonlinear program: direct collocation on Radau points, exact derivatives, IPOPT."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from estimation.thermal.runs.measurements import rows_of
from estimation.thermal.runs.thermal_run import ThermalRun
from estimation.thermal.transcriptions.coordinates import DEGREES_PER_COORDINATE, Layout, from_coordinate
from estimation.thermal.transcriptions.mesh import COLLOCATION_DEGREE, Mesh, MeshSettings, build_mesh, radau
from robots.common.arrays import Array
from robots.common.errors import SolverError
from robots.thermal import Inputs, ThermalModel


@dataclass(frozen=True, kw_only=True, eq=False)
class Solution:
    """Result of the solver.

    Attributes:
        coordinates: parameters, then each run's start temperatures and surroundings, as they are searched (P,).
        states: at all Radau points, scaled.
        cost: half the weighted sum of squares.
        success: whether IPOPT calls it a solution.
        status: what IPOPT says.
        iterations: that it took.
    """

    coordinates: Array
    states: Array
    cost: float
    success: bool
    status: str
    iterations: int


class Transcription:
    """Runs of one joint, discretised.

    Args:
        kind: the thermal model.
        runs: R runs.
        settings: of the mesh.
        T0: temperature at which the cold friction holds [degC].
    """

    def __init__(self, kind: type[ThermalModel], runs: Sequence[ThermalRun], settings: MeshSettings, T0: float) -> None:
        self.kind, self.runs, self.T0 = kind, tuple(runs), T0
        self.meshes = tuple(build_mesh(run, settings) for run in runs)
        self.rows = tuple(rows_of(kind, runs))
        self.layout = Layout(kind, self.runs, T0)
        self.size = self.layout.size
        self._states = kind.state_count(coarse=True)
        self._scale = self._state_scale()
        self._solvers: dict[bool, casadi.Function] = {}
        self._build()

    @property
    def state_size(self) -> int:
        """States at each point."""
        return self._states

    @property
    def measured(self) -> Array:
        """All measurements (M,)."""
        return np.concatenate([row.measured for row in self.rows])

    # The program.

    def _state_scale(self) -> Array:
        if self._states == len(self.kind.zones):
            return np.full(self._states, DEGREES_PER_COORDINATE)
        from robots.thermal.fractional import memory_weights

        typical = {p.name: p.typical for p in self.kind.parameters}
        return np.array(
            [
                DEGREES_PER_COORDINATE,
                *(DEGREES_PER_COORDINATE / w for w in memory_weights(typical["nu"], self._states - 1)),
            ]
        )

    def _symbolic_values(self, symbols: Any) -> dict[str, Any]:
        # Temperatures are counted from T0 in here.
        return {**{p.name: from_coordinate(p, symbols[i]) for i, p in enumerate(self.kind.parameters)}, "T0": 0.0}

    def _interval(self, mesh: Mesh) -> casadi.Function:
        """Residuals of one interval: the derivative of the polynomial less the heat balance, at each Radau point."""
        _, D = radau()
        theta = casadi.SX.sym("theta", len(self.kind.parameters))
        first, inner = casadi.SX.sym("first", self._states), casadi.SX.sym("inner", self._states, COLLOCATION_DEGREE)
        around, own = casadi.SX.sym("around", COLLOCATION_DEGREE), casadi.SX.sym("own")
        third, data = casadi.SX.sym("third", COLLOCATION_DEGREE), casadi.SX.sym("data", 3)
        values = self._symbolic_values(theta)
        nodes = casadi.horzcat(first, inner)
        residuals = []
        for j in range(COLLOCATION_DEGREE):
            x = [scale * inner[i, j] for i, scale in enumerate(self._scale.tolist())]
            u = Inputs(
                data[1],
                around[j] if mesh.ambient is not None else DEGREES_PER_COORDINATE * own,
                third[j] if mesh.T3 is not None else None,
                data[2],
            )
            rates = casadi.vertcat(*self.kind.rates(values, x, u)) / casadi.DM(self._scale)
            residuals.append(casadi.mtimes(nodes, casadi.DM(D[:, j])) - data[0] * rates)
        inputs = [first, inner, theta, around, own, third, data]
        return casadi.Function("interval", inputs, [casadi.vertcat(*residuals)])

    def _zones(self) -> casadi.Function:
        theta = casadi.SX.sym("theta", len(self.kind.parameters))
        x = casadi.SX.sym("x", self._states)
        states = [scale * x[i] for i, scale in enumerate(self._scale.tolist())]
        return casadi.Function(
            "zones", [x, theta], [casadi.vertcat(*self.kind.zone_temperatures(self._symbolic_values(theta), states))]
        )

    def _build(self) -> None:
        symbols = casadi.MX.sym("coordinates", self.size)
        counts = [self._states * COLLOCATION_DEGREE * mesh.count for mesh in self.meshes]
        states = casadi.MX.sym("states", sum(counts))
        theta = symbols[: len(self.kind.parameters)]
        offsets = np.concatenate([[0], np.cumsum(counts)]).astype(int)
        values, zones = self._symbolic_values(theta), self._zones()
        residuals, seen = [], []
        for r, mesh in enumerate(self.meshes):
            inner = casadi.reshape(
                states[int(offsets[r]) : int(offsets[r + 1])], self._states, COLLOCATION_DEGREE * mesh.count
            )
            starts = symbols[self.layout.start_slots(r)]
            parts = [starts[i] for i in range(len(self.kind.zones))]
            first = casadi.vertcat(*self.kind.start_state(parts, self._states))
            nodes = casadi.horzcat(first, inner)
            own = symbols[self.layout.ambient_slot(r)]
            residuals.append(casadi.vec(self._map_interval(mesh, nodes, inner, theta, own)))
            reached = zones.map(1 + COLLOCATION_DEGREE * mesh.count)(
                nodes, casadi.repmat(theta, 1, 1 + COLLOCATION_DEGREE * mesh.count)
            )
            sampling = casadi.DM(csc_matrix(mesh.sampling))
            seen.append(casadi.mtimes(sampling, reached.T))
        outputs = []
        for row in self.rows:
            index = row.index.tolist()
            if row.channel == "friction":
                outputs.append(values["alpha"] * seen[row.run][index, 0] + values["beta"])
            else:
                outputs.append(seen[row.run][index, self.kind.zones.index(row.channel)] + self.T0)
        g, y = casadi.vertcat(*residuals), casadi.vertcat(*outputs)
        weights = casadi.MX.sym("weights", y.shape[0])
        prior = casadi.MX.sym("prior", len(self.runs))
        around = symbols[self.layout.ambient_slots.tolist()]
        cost = (casadi.sumsqr(weights * (y - self.measured)) + casadi.sumsqr(prior * around)) / 2
        self._nlp = {"x": casadi.vertcat(symbols, states), "f": cost, "g": g, "p": casadi.vertcat(weights, prior)}
        self._symbols, self._states_symbol = symbols, states
        pair = [symbols, states]
        self._balance = casadi.Function("balance", pair, [g, casadi.jacobian(g, states), casadi.jacobian(g, symbols)])
        self._outputs = casadi.Function("outputs", pair, [y, casadi.jacobian(y, states), casadi.jacobian(y, symbols)])

    def _map_interval(self, mesh: Mesh, nodes: Any, inner: Any, theta: Any, own: Any) -> Any:
        K = mesh.count
        empty = np.zeros((COLLOCATION_DEGREE, K))
        data = np.stack([np.diff(mesh.edges), mesh.power, mesh.drives])
        around = empty if mesh.ambient is None else mesh.ambient.T - self.T0
        third = empty if mesh.T3 is None else mesh.T3.T - self.T0
        return self._interval(mesh).map(K)(
            nodes[:, : COLLOCATION_DEGREE * K : COLLOCATION_DEGREE],
            inner,
            casadi.repmat(theta, 1, K),
            around,
            casadi.repmat(own, 1, K),
            third,
            data,
        )

    # What is done with it.

    def follow(self, coordinates: Array) -> Array:
        """Gives the states that obey the heat balance: it is linear in them."""
        zero = np.zeros(self._states_symbol.shape[0])
        g, slope, _ = self._balance(coordinates, zero)
        try:
            return np.asarray(splu(slope.sparse()).solve(-np.asarray(g).ravel()))
        except (RuntimeError, ValueError) as error:
            raise SolverError(f"thermal model: the heat balance has no solution ({error})") from error

    def predict(self, coordinates: Array, states: Array) -> Array:
        """Gives what the model says of all measurements (M,)."""
        return np.asarray(self._outputs(coordinates, states)[0]).ravel()

    def sensitivities(self, coordinates: Array, states: Array) -> Array:
        """Gives the exact derivatives of the predictions by the coordinates (M, P), the heat balance kept."""
        _, by_states, by_symbols = self._balance(coordinates, states)
        _, seen_states, seen_symbols = self._outputs(coordinates, states)
        moved = splu(by_states.sparse()).solve(by_symbols.sparse().toarray())
        return np.asarray(seen_symbols.sparse().toarray() - seen_states.sparse() @ moved)

    def solve(
        self,
        coordinates: Array,
        free: NDArray[np.bool_],
        weights: Array,
        prior: Array,
        *,
        slow: tuple[float, float] | None = None,
        max_iterations: int = 200,
    ) -> Solution:
        """Minimises the weighted squares by IPOPT over states and coordinates; see `solve` for the arguments."""
        lower, upper = self.layout.bounds()
        begin = coordinates
        lower, upper = np.where(free, lower, begin), np.where(free, upper, begin)
        states = self.follow(begin)
        solver = self._solver(slow is not None, max_iterations)
        wide = np.full(states.shape, np.inf)
        tail = [] if slow is None else list(slow)
        result = solver(
            x0=np.concatenate([begin, states]),
            lbx=np.concatenate([lower, -wide]),
            ubx=np.concatenate([upper, wide]),
            lbg=0.0,
            ubg=0.0,
            p=np.concatenate([weights, prior, tail]),
        )
        statistics = solver.stats()
        x = np.asarray(result["x"]).ravel()
        if not np.isfinite(x).all():
            x = np.concatenate([begin, states])
        return self.solution_at(
            np.where(free, x[: self.size], begin),
            weights,
            prior,
            success=bool(statistics["success"]),
            status=str(statistics["return_status"]),
            iterations=int(statistics["iter_count"]),
        )

    def solution_at(
        self, coordinates: Array, weights: Array, prior: Array, *, success: bool, status: str, iterations: int
    ) -> Solution:
        """Evaluates coordinates: the heat balance is kept to the last digit, whatever the solver's tolerance."""
        states = self.follow(coordinates)
        residual = weights * (self.predict(coordinates, states) - self.measured)
        around = prior * coordinates[self.layout.ambient_slots]
        return Solution(
            coordinates=coordinates,
            states=states,
            cost=float(residual @ residual + around @ around) / 2,
            success=success,
            status=status,
            iterations=iterations,
        )

    def _solver(self, constrained: bool, max_iterations: int) -> casadi.Function:
        if constrained not in self._solvers:
            nlp = dict(self._nlp)
            if constrained:
                power, constant = casadi.MX.sym("power"), casadi.MX.sym("constant")
                nlp["g"] = casadi.vertcat(nlp["g"], self._slow_condition(power, constant))
                nlp["p"] = casadi.vertcat(nlp["p"], power, constant)
            options: dict[str, Any] = {
                "print_time": False,
                "show_eval_warnings": False,
                "ipopt": {
                    "print_level": 0,
                    "sb": "yes",
                    "tol": 1e-8,
                    "max_iter": max_iterations,
                    "mu_init": 1e-3,
                    "bound_relax_factor": 0.0,
                },
            }
            self._solvers[constrained] = casadi.nlpsol("thermal", "ipopt", nlp, options)
        return self._solvers[constrained]

    def _slow_condition(self, power: Any, constant: Any) -> Any:
        """Zero where a time constant at this power has this value: det(-I / constant - A) (thesis eq. 125)."""
        values, size, u = self._symbolic_values(self._symbols), self._states, Inputs(power, 0.0, None, 0.0)
        still = self.kind.rates(values, [0.0] * size, u)
        columns = []
        for c in range(size):
            moved = self.kind.rates(values, [float(k == c) for k in range(size)], u)
            columns.append(casadi.vertcat(*(m - s for m, s in zip(moved, still, strict=True))))
        # In units of the constant, so that it is of the size of one.
        return casadi.det(-casadi.MX.eye(size) - casadi.horzcat(*columns) * constant)

    def slow_gap(self, coordinates: Array, power: float, constant: float) -> float:
        """Logarithm of the slowest time constant at a power over a given one."""
        model = self.kind(**{k: v for k, v in self.layout.values_at(coordinates).items() if k != "T0"})
        return float(np.log(model.time_constants(power)[0] / constant))
