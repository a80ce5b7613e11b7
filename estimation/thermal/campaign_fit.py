"""The verb: rigid body, friction and heat of all joints, fitted together to a whole campaign."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from estimation.identifications.identification import identify
from estimation.linear_algebra.scaled import LEAST_RIDGE, solve_ridge
from estimation.logs.known_setup import HEAT, require_plain
from estimation.models.model import Model
from estimation.thermal.information import inverse_of
from estimation.thermal.results.campaign_estimate import CampaignEstimate
from estimation.thermal.results.estimate import ThermalEstimate, searched_parameters, with_errors
from estimation.thermal.runs.condensed import Condensed, JointSums, condense
from estimation.thermal.runs.extraction import join_pieces, piece_on_bins, ratio_of
from estimation.thermal.runs.thermal_run import ThermalRun
from estimation.thermal.thermal_fit import fit_thermal
from estimation.thermal.torque import ThermalTorqueModel, error_band
from robots.common.arrays import Array
from robots.common.errors import InputError, NotIdentifiableError
from robots.common.forks import forked
from robots.common.parallel import one_blas_thread
from robots.common.progress import SILENT, Progress
from robots.robot import Robot
from robots.signals import Log

# The fits of rigid body and heat take turns until no friction changes by more than this share.
SETTLED_FRICTION_CHANGE, MOST_ALTERNATIONS = 1e-4, 12


@one_blas_thread()
def fit_campaign(
    robot: Robot,
    logs: Log | Sequence[Log],
    *,
    order: str | int = "second",
    alpha: float | None = None,
    fixed: Mapping[str, float] | None = None,
    model: Model | None = None,
    sensor: str = "motor",
    width: float = 10.0,
    start: str = "ambient",
    seed: int = 0,
    progress: Progress | None = None,
) -> CampaignEstimate:
    """Fits rigid body, friction at T0 and each joint's heat to all logs of a campaign.

    The logs are condensed to normal equations of short times, in which a temperature is constant. Linear parameters and
    thermal models (thesis chapter 4) are fitted in turn until both converge. Standard errors come from the joint
    information.

    Args:
        robot: the robot.
        logs: on one clock; the pauses between them are rests.
        order: of the thermal models, see `fit_thermal`.
        alpha: slope of the friction, where it is known [1/K].
        fixed: other known thermal parameters.
        model: where to begin; identified from the logs by default.
        sensor: where joint temperatures, if any, were measured: ``motor`` or ``housing``.
        width: of the short times [s].
        start: ``ambient`` or ``free``, which needs cooling phases or several powers. A contradiction gives a note.
        seed: of the thermal searches.
        progress: receives the progress.

    Returns:
        The estimate.

    Raises:
        InputError: no logs, logs of another robot, or that state a payload or gravity.
        NotIdentifiableError: no joint moves.
    """
    data = [logs] if isinstance(logs, Log) else list(logs)
    if not data:
        raise InputError("no logs", allowed="one or more")
    require_plain(data, HEAT)
    bar = progress or SILENT
    bar.start("fitting rigid body, friction and heat", float(MOST_ALTERNATIONS + 2))
    try:
        begin = identify(robot, data, seed=seed).model if model is None else model
        bar.update(1.0, "condensing")
        condensed = condense(begin, data, width)
        bar.update(2.0, "fitting")
        return _AlternatingFit(begin, condensed, sensor).run(
            bar, {"order": order, "alpha": alpha, "fixed": dict(fixed or {}), "start": start, "seed": seed}
        )
    finally:
        bar.finish()


class _AlternatingFit:
    """The two fits that take turns."""

    def __init__(self, model: Model, condensed: Condensed, sensor: str) -> None:
        self.model, self.condensed, self.sensor = model, condensed, sensor
        self.moves = [bool(sums.count.sum() > 0 and sums.friction.any()) for sums in condensed.joints]
        if not any(self.moves):
            raise NotIdentifiableError("no joint moves", remedy="record logs in which the arm moves")
        bins = int(condensed.offsets[-1])
        self.factors = [np.ones(bins) for _ in condensed.joints]
        self.weights = np.ones(len(condensed.joints))
        self.values = np.array(model.values)

    def run(self, bar: Progress, options: dict[str, Any]) -> CampaignEstimate:
        """Takes turns until the friction stands still."""
        self._solve_linear()
        without = self._residuals()
        fits: list[ThermalEstimate | None] = [None] * len(self.moves)
        rounds, whole, changes = 0, float(MOST_ALTERNATIONS), list[float]()
        for rounds in range(1, MOST_ALTERNATIONS + 1):
            starts = 3 if rounds == 1 else 1
            advance = partial(_advance, bar, rounds, max(whole, rounds))
            found = self._fit_all({**options, "starts": starts, "bounds": False}, advance)
            change = 0.0
            for j, (fit, factor) in found.items():
                change = max(change, float(np.abs(factor / self.factors[j] - 1.0).max()))
                fits[j], self.factors[j] = fit, factor
            self._solve_linear()
            changes.append(change)
            whole = expected_rounds(changes, SETTLED_FRICTION_CHANGE, MOST_ALTERNATIONS)
            if change < SETTLED_FRICTION_CHANGE:
                break
        notes = (
            []
            if change < SETTLED_FRICTION_CHANGE
            else [f"The alternating fit stopped before it converged (last relative change {change:.1e})."]
        )
        for j, (fit, _) in self._fit_all({**options, "starts": 1}).items():
            fits[j] = fit
        notes += sorted({note for fit in fits if fit is not None for note in fit.notes})
        notes += self._warm(options)
        final = [None if fit is None else self._unit(fit) for fit in fits]
        covariance, errors = self._joint_covariance(final)
        finished = [None if fit is None else with_errors(fit, errors[j]) for j, fit in enumerate(final)]
        model = replace(self.model, values=self.values, covariance=covariance)
        thermal = tuple(None if fit is None else fit.model for fit in finished)
        residuals = self._residuals()
        provenance = {
            **model.provenance,
            "residual_rms": residuals.tolist(),
            "residual_rms_without_heat": without.tolist(),
            "band95": error_band(ThermalTorqueModel(model=model, thermal=thermal), self.condensed, self.factors),
        }
        return CampaignEstimate(
            torque_model=ThermalTorqueModel(model=replace(model, provenance=provenance), thermal=thermal),
            thermal=tuple(finished),
            residual_rms=residuals,
            residual_without=without,
            rounds=rounds,
            notes=tuple(notes),
        )

    def _warm(self, options: dict[str, Any]) -> list[str]:
        """Says which joints do not start at ambient temperature although they were taken to."""
        if options["start"] != "ambient":
            return []
        tried = self._fit_all({**options, "start": "auto", "starts": 1, "bounds": False})
        notes = [note for fit, _ in tried.values() for note in fit.notes]
        return [note for note in notes if "does not start at ambient temperature" in note]

    def _fit_all(
        self, options: dict[str, Any], advance: Callable[[float], None] = lambda share: None
    ) -> dict[int, tuple[ThermalEstimate, Array]]:
        """Fits the heat of each joint that moves, several joints at once: estimates and friction factors (B,)."""
        joints = [j for j, moves in enumerate(self.moves) if moves]

        def fitted(j: int) -> tuple[ThermalEstimate, Array]:
            runs = self._runs(j, self.condensed.joints[j])
            fit = fit_thermal(runs, **options)
            return fit, self._factor(fit, runs) / fit.model.beta

        return dict(zip(joints, forked(fitted, joints, advance, threads=False), strict=True))

    def _solve_linear(self) -> None:
        for _ in range(2):
            size = len(self.values)
            gram, cross = np.zeros((size, size)), np.zeros(size)
            for sums, factor, weight in zip(self.condensed.joints, self.factors, self.weights, strict=True):
                part, right = sums.scaled(factor)
                gram[np.ix_(sums.used, sums.used)] += weight * part
                cross[sums.used] += weight * right
            self.values = solve_ridge(gram, cross, LEAST_RIDGE)
            self.weights = 1.0 / np.maximum(self._residuals(), 1e-9) ** 2

    def _residuals(self) -> Array:
        return np.array(
            [
                np.sqrt(sums.residual(factor, self.values[sums.used]) / max(float(sums.count.sum()), 1.0))
                for sums, factor in zip(self.condensed.joints, self.factors, strict=True)
            ]
        )

    def _runs(self, j: int, sums: JointSums) -> list[ThermalRun]:
        values = self.values[sums.used]
        cross, square = sums.friction_scale(values)
        ratio = ratio_of(cross, square)
        power = np.maximum(sums.power @ values[sums.friction], 0.0)
        offsets, found = self.condensed.offsets, []
        for number, run in enumerate(self.condensed.runs, start=1):
            pieces = []
            for k in run:
                part = slice(int(offsets[k]), int(offsets[k + 1]))
                log = self.condensed.logs[k]
                pieces.append(piece_on_bins(self.condensed.edges[k], ratio[part], square[part], power[part], log, j))
            found.append(join_pieces(pieces, self.sensor, f"run {number}, joint {j + 1}"))
        return found

    def _factor(self, fit: ThermalEstimate, runs: Sequence[ThermalRun]) -> Array:
        """Friction factor in the middle of every bin (B,), also of those in which it was not measured."""
        parts = []
        for number, (run, members) in enumerate(zip(runs, self.condensed.runs, strict=True)):
            about = next(item for item in fit.runs if item.name == runs[number].name)
            values = None if run.ambient is None else np.asarray(run.ambient)[:-1]
            T = fit.model.temperatures(
                run.held_power,
                np.diff(run.t),
                start=list(about.start),
                ambient=about.ambient if values is None or not np.isfinite(values).all() else values,
            )
            for k in members:
                edges = self.condensed.edges[k]
                parts.append(np.interp((edges[1:] + edges[:-1]) / 2.0, run.t, fit.model.friction_factor(T[:, 0])))
        return np.concatenate(parts)

    def _unit(self, fit: ThermalEstimate) -> ThermalEstimate:
        """Counts friction from the model's own at T0: beta is one by that."""
        beta = fit.model.beta
        model = replace(fit.model, alpha=fit.model.alpha / beta, beta=1.0)
        # Exchanges and capacities stay: heat is W times the factor, and W has taken the beta.
        parameters = tuple(
            replace(q, value=1.0, standard_error=float("inf"))
            if q.name == "beta"
            else replace(q, value=q.value / beta)
            if q.name == "alpha"
            else q
            for q in fit.parameters
        )
        return replace(fit, model=model, parameters=parameters)

    def _joint_covariance(self, fits: Sequence[ThermalEstimate | None]) -> tuple[Array, list[dict[str, float]]]:
        """Covariance of the linear parameters, and standard errors of the thermal ones, none held fixed."""
        size = len(self.values)
        names = [[] if fit is None else searched_parameters(fit) for fit in fits]
        offsets = size + np.concatenate([[0], np.cumsum([len(own) for own in names])]).astype(int)
        information = np.zeros((int(offsets[-1]),) * 2)
        for j, (sums, factor, fit) in enumerate(zip(self.condensed.joints, self.factors, fits, strict=True)):
            own = int(sums.used.size)
            slopes = np.zeros((len(factor), 0)) if fit is None else self._slopes(j, sums, fit, names[j])
            f, values = sums.friction, self.values[sums.used]
            weight = self.weights[j] / self._colour(sums, factor, values, j)
            # Rows of a bin are [Y_r, factor Y_f, Y_f pi_f slope]: their Gram matrix follows from that of Y.
            gram, _ = sums.scaled(factor)
            which = np.concatenate([sums.used, np.arange(offsets[j], offsets[j + 1])])
            block = np.zeros((own + slopes.shape[1],) * 2)
            block[:own, :own] = gram
            acts = np.einsum("bij,j->bi", sums.gram[:, :, f], values[f])  # (B, k)
            acts[:, f] *= factor[:, None]
            block[:own, own:] = acts.T @ slopes
            block[own:, :own] = block[:own, own:].T
            _, square = sums.friction_scale(values)
            block[own:, own:] = slopes.T @ (square[:, None] * slopes)
            information[np.ix_(which, which)] += weight * block
        inverse = inverse_of(information)
        errors = np.sqrt(np.maximum(np.diag(inverse), 0.0))
        found = [{name: float(errors[offsets[j] + k]) for k, name in enumerate(own)} for j, own in enumerate(names)]
        return inverse[:size, :size], found

    def _colour(self, sums: JointSums, factor: Array, values: Array, j: int) -> float:
        """Variance of the friction of short times over what independent samples would leave."""
        cross, square = sums.friction_scale(values)
        known = square > 1e-3 * float(square.max(initial=0.0))
        if known.sum() < 10:
            return 1.0
        left = (cross[known] / square[known] - factor[known]) ** 2 * square[known] * self.weights[j]
        return max(1.0, float(np.mean(left)))

    def _slopes(self, j: int, sums: JointSums, fit: ThermalEstimate, names: Sequence[str]) -> Array:
        """Derivatives of the friction factor by thermal parameters (B, p), by central differences."""
        runs, columns = self._runs(j, sums), []
        for name in names:
            value = getattr(fit.model, name)
            step = 1e-4 * max(abs(value), 1e-3)
            ends = [replace(fit, model=replace(fit.model, **{name: value + sign * step})) for sign in (1.0, -1.0)]
            high, low = (self._factor(end, runs) for end in ends)
            columns.append((high - low) / (2.0 * step))
        return np.stack(columns, axis=1) if columns else np.zeros((len(self.factors[j]), 0))


def _advance(bar: Progress, rounds: int, whole: float, share: float) -> None:
    bar.update(2.0 + MOST_ALTERNATIONS * (rounds - 1 + share) / whole, f"round {rounds}")


def expected_rounds(changes: Sequence[float], settled: float, most: int) -> float:
    """Estimates how many rounds an iteration takes that converges linearly.

    The logarithm of the change falls by the same amount each round, so two rounds show how many are left.

    Args:
        changes: relative change of each round so far; at least one.
        settled: the change at which it ends.
        most: rounds after which it ends in any case.

    Returns:
        The rounds in all, at least those done; `most` where the changes do not fall.
    """
    done = len(changes)
    if changes[-1] < settled:
        return float(done)
    if done < 2 or not 0.0 < changes[-1] < changes[-2]:
        return float(most)
    left = np.log(changes[-1] / settled) / np.log(changes[-2] / changes[-1])
    return float(min(most, done + max(1.0, np.ceil(left))))
