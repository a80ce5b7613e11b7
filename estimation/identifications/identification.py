"""The verb: identifies a robot's dynamic parameters from its logs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimation.estimators import Estimator
from estimation.estimators import estimator as choose_estimator
from estimation.identifications.assembly import Figures, assemble, describe_logs_and_method, joint_fits
from estimation.identifications.choices import Candidates, Choice, choose
from estimation.identifications.estimate import Estimate
from estimation.identifications.fit import Fit, fit
from estimation.identifications.model_forms import ModelForm
from estimation.identifications.verdicts import require_predictable
from estimation.logs.known_setup import gravities_of, require_plain
from estimation.preprocessing import Harmonics
from estimation.recordings import make_ready
from estimation.regressions.preparation import Prepared
from estimation.uncertainty import fast_noise, period_noise
from estimation.uncertainty.quantiles import band_of
from robots.common.arrays import Array
from robots.common.errors import NotIdentifiableError
from robots.common.parallel import one_blas_thread
from robots.common.progress import SILENT, Progress
from robots.robot import Robot
from robots.signals import Log
from robots.terms import BendingFriction, FrictionTerm
from robots.terms.friction import USUAL_SPEED_SHARE


@one_blas_thread()
def identify(
    robot: Robot,
    logs: Log | Sequence[Log],
    *,
    method: str | Estimator = "wls",
    friction: str | FrictionTerm = "auto",
    position: bool | None = None,
    rotor: bool = True,
    offset: bool = True,
    candidates: Candidates | None = None,
    check: bool = True,
    seed: int = 0,
    progress: Progress | None = None,
) -> Estimate:
    """Identifies base parameters of rigid body, friction, rotors and torque offsets, with standard errors.

    Positions are smoothed and differentiated without phase lag; smoothing and the sharpness of the friction's sign are
    chosen by predicting blocks of the logs from the rest. Torque is fitted as it was logged. What the logs leave open
    stays at the robot's description, or at a plausible arm (`default_prior`). The standard errors allow for correlated
    noise, and for that prior.

    Args:
        robot: the robot.
        logs: one log or several, of t, q and tau or current. One may state a payload or a gravity: the parameters
            are those of the arm alone, and those that all these gravities together determine.
        method: ``wls``, ``ols``, or an estimator of one's own.
        friction: ``auto`` (`BendingFriction`, which a log of slow motions does not let explode at high speed),
            ``polynomial`` (thesis eq. 35), ``coulomb-viscous``, or a term of one's own.
        position: whether each joint has a torque by its own position, of unknown cause (`PositionTorque`). None: with
            ``auto`` friction, where it predicts other motions clearly better.
        rotor: with rotor inertias.
        offset: with a torque offset per joint.
        candidates: settings that the data choose from.
        check: whether each log passes the gate first, which refuses what would be fitted wrongly, cuts at gaps, and
            leaves out logs that rest beside others that move.
        seed: of the noise drawn to correct the standard errors.
        progress: receives the progress.

    Returns:
        The estimate.

    Raises:
        InputError: logs of another robot, without torque, too short, or refused by the gate; unknown options; a payload
            or gravity that the method does not know.
        NotIdentifiableError: logs in which no joint moves, or no joint's torque can be predicted.
    """
    chosen = choose_estimator(method)
    given = [logs] if isinstance(logs, Log) else list(logs)
    if chosen.simulates:
        require_plain(given, f"the method {chosen.name}")
    bar = progress or SILENT
    bar.start("identifying", 3.0)
    _require_motion(given)
    bar.update(0.0, "checking the logs")
    recording = make_ready(robot, given, check=check)
    robot, data, prepared = recording.robot, recording.used, recording.prepared
    by_position = friction == "auto" if position is None else position
    if friction == "auto":
        friction = BendingFriction.within(usual_speeds(prepared))
    form = ModelForm(robot, friction, rotor, offset, gravities_of(data))
    base = form.first(by_position)
    bar.update(1.0, "choosing smoothing and model")
    choice = choose(base, prepared, chosen, candidates or Candidates(), position=position)
    predictable = _predictable(prepared, choice)
    bar.update(2.0, "fitting")
    base = form.chosen(base, choice, by_position)
    found = fit(base, prepared, chosen, choice, seed)
    figures = _figures(found)
    motions = [part.motion for part in found.rows]
    recorded = recorded_ranges(
        *(np.concatenate([getattr(motion, name) for motion in motions]) for name in ("q", "dq", "ddq"))
    )
    bar.finish()
    return assemble(
        found,
        joint_fits(found, figures, predictable),
        {**describe_logs_and_method(data, chosen, seed), "recorded": recorded},
        dropped_rows=sum(log.positions.dropped for log in prepared),
        gates=recording.gates,
        recording=recording,
    )


def usual_speeds(logs: Sequence[Prepared]) -> Array:
    """Speed of each joint (n,) that it exceeds in a thousandth of the time only."""
    found = []
    for log in logs:
        grid = log.positions
        # Speeds are measured over so much time [s].
        span = min(max(1, round(0.02 / grid.period)), len(grid.q) - 1)
        found.append(
            np.quantile(np.abs(grid.q[span:] - grid.q[:-span]), USUAL_SPEED_SHARE, axis=0) / (span * grid.period)
        )
    return np.asarray(np.max(found, axis=0))


def recorded_ranges(q: Array, dq: Array, ddq: Array) -> dict[str, list[list[float]]]:
    """Gives each joint's lowest and highest position, and largest speed and acceleration, of rows (N, n)."""
    return {
        "position": [q.min(axis=0).tolist(), q.max(axis=0).tolist()],
        "velocity": [np.abs(dq).max(axis=0).tolist()],
        "acceleration": [np.abs(ddq).max(axis=0).tolist()],
    }


def _require_motion(logs: Sequence[Log]) -> None:
    if logs and not any(np.ptp(log.q, axis=0).any() for log in logs):
        raise NotIdentifiableError("no joint moves", remedy="record a log in which the arm moves")


def _predictable(prepared: Sequence[Prepared], choice: Choice) -> NDArray[np.bool_]:
    """Which joints (n,) move, and have a torque that varies and follows from the motion.

    Raises:
        NotIdentifiableError: none.
    """
    moves = np.any([np.ptp(log.log.q, axis=0) > 0 for log in prepared], axis=0)
    highest = np.max([log.tau.max(axis=0) for log in prepared], axis=0)
    lowest = np.min([log.tau.min(axis=0) for log in prepared], axis=0)
    return require_predictable(moves, lowest, highest, choice)


def _figures(found: Fit) -> Figures:
    """Measures each joint's errors on the rows on which the left-out errors are: all but those at rest."""
    judged = np.concatenate([part.judged for part in found.rows])
    total = np.maximum(judged.sum(axis=0), 1)
    torque = np.concatenate([part.tau for part in found.rows])
    error = torque - np.concatenate(list(found.predicted))
    squares, residuals = (np.einsum("tj,tj,tj->j", x, x, judged) for x in (torque, error))
    return Figures(
        rows=total,
        torque=squares,
        sums=np.einsum("tj,tj->j", torque, judged),
        residual=residuals,
        floor=_noise_floor(found),
        band=band_of(np.abs(np.where(judged, error, np.nan))),
    )


def _noise_floor(found: Fit) -> Array:
    residuals = [part.tau - torque for part, torque in zip(found.rows, found.predicted, strict=True)]
    smoother = found.choice.smoother
    if isinstance(smoother, Harmonics):
        levels = [
            period_noise(part.motion.t, residual, smoother.period)
            for part, residual in zip(found.rows, residuals, strict=True)
        ]
        known = [level**2 for level in levels if level is not None]
        if known:
            return np.asarray(np.sqrt(np.mean(known, axis=0)))
    return fast_noise(residuals)
