"""The verb: identifies a robot from a log that does not fit into memory."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from estimation.estimators import Estimator, Solution
from estimation.estimators import estimator as choose_estimator
from estimation.identifications.assembly import assemble, describe_logs_and_method, joint_fits
from estimation.identifications.choices import Candidates, Choice, choose
from estimation.identifications.comparison import COMPARED_ROWS, COMPARED_STRETCHES
from estimation.identifications.estimate import Estimate
from estimation.identifications.fit import (
    Fit,
    Fitted,
    covariances,
    second_pass,
    sum_moments,
)
from estimation.identifications.model_forms import ModelForm
from estimation.identifications.streams.errors import Errors
from estimation.identifications.streams.pieces import Pieces
from estimation.identifications.streams.survey import SURVEYED_ROWS, merged_report, survey
from estimation.identifications.verdicts import require_predictable
from estimation.logs.parquet_streams import LogStream
from estimation.preprocessing import LowPass
from estimation.regressions.braking_friction import with_braking_friction
from estimation.regressions.joint_regressor import JointRegressor
from estimation.regressions.moments import Moments
from estimation.regressions.torque_meanings import with_torque_constants
from estimation.uncertainty.averages import AVERAGING_TIME
from robots.base_parameters import BaseParameters
from robots.common.errors import InputError, NotIdentifiableError
from robots.common.parallel import one_blas_thread
from robots.common.progress import SILENT, Progress
from robots.robot import Robot
from robots.terms import BendingFriction, FrictionTerm

METHODS = ("wls", "ols")


@one_blas_thread()
def identify_stream(
    robot: Robot,
    stream: LogStream,
    *,
    method: str | Estimator = "wls",
    friction: str | FrictionTerm = "auto",
    position: bool | None = None,
    rotor: bool = True,
    offset: bool = True,
    candidates: Candidates | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> Estimate:
    """Identifies as `identify` does, with one piece of the log in memory at a time.

    The file is read four times. Every row is checked and fitted; the sums are those of `identify` to rounding. The
    smoothing is a low-pass. Its cut-off and the friction are chosen on ten evenly spread stretches of 2,400 rows.
    Noise and the sandwich's inner matrix come from 24 stretches of 4,166 rows, as in `identify`, and the estimate
    keeps these rows only.

    Args:
        robot: the robot.
        stream: the log, see `estimation.logs.parquet_streams.open_stream`.
        method: ``wls`` or ``ols``.
        friction: see `identify`.
        position: see `identify`.
        rotor: see `identify`.
        offset: see `identify`.
        candidates: settings that the data choose from; the low-pass is the only smoother.
        seed: of the noise drawn to correct the standard errors.
        progress: receives the rows that were read.

    Raises:
        InputError: another method, a log of another robot, or one that the gate refuses.
        NotIdentifiableError: no joint moves, or no joint's torque can be predicted.
    """
    chosen = choose_estimator(method)
    if chosen.name not in METHODS:
        raise InputError(
            f"the method {chosen.name} needs all rows in memory",
            allowed=f"{' or '.join(METHODS)} for a log that is read in pieces",
            remedy="use --method wls, or identify a shorter log",
        )
    if stream.n != robot.n:
        raise InputError(f"{stream.n} joints", file=stream.path, allowed=f"{robot.n}, as {robot.name} has")
    robot = with_torque_constants(robot, [stream.rows(0, min(SURVEYED_ROWS, len(stream)))], stream.torque_is)
    # The file is read four times: for the survey, the speeds, the moments and the errors.
    bar = _Rows(progress or SILENT, 4 * len(stream))
    found = survey(robot, stream, bar.advance)
    report = merged_report(found, stream)
    report.raise_if_refused()
    if not found.segments:
        raise InputError("no usable rows", file=stream.path, remedy="record the data again")
    moves = np.any([part.upper > part.lower for part in found.segments], axis=0)
    if not moves.any():
        raise NotIdentifiableError("no joint moves", remedy="record a log in which the arm moves")
    pieces = Pieces(robot, stream, found)
    by_position = friction == "auto" if position is None else position
    if friction == "auto":
        friction = BendingFriction.within(found.usual)
    form = ModelForm(robot, friction, rotor, offset, [] if stream.gravity is None else [stream.gravity])
    base = form.first(by_position)
    bar.advance(0, "choosing smoothing and model")
    stretches = pieces.stretches(COMPARED_STRETCHES, COMPARED_ROWS // COMPARED_STRETCHES)
    low_pass = replace(candidates or Candidates(), smoothers=())
    spread = found.spread if found.rows > COMPARED_ROWS else None
    choice = choose(base, stretches, chosen, low_pass, position=position, spread=spread)
    # The stretches are one log: how they differ is no contradiction between logs.
    choice = replace(choice, contradiction=None)
    predictable = require_predictable(moves, found.lowest, found.highest, choice)
    base = form.chosen(base, choice, by_position)
    period = float(np.median([part.period for part in found.segments]))
    fitted, errors = _fit(base, pieces, chosen, choice, seed, bar, period)
    bar.finish()
    provenance = {
        **describe_logs_and_method([], chosen, seed),
        "logs": stream.describe(),
        "recorded": errors.recorded,
        "read_in_pieces": {"rows": errors.rows, "kept": len(fitted.torque)},
    }
    return assemble(
        fitted,
        joint_fits(fitted, errors.figures, predictable),
        provenance,
        dropped_rows=0,
        gates=(report,),
        fitted_rows=errors.rows,
    )


class _Rows:
    """Progress in rows that were read, of all readings together."""

    def __init__(self, progress: Progress, total: int) -> None:
        self._progress, self._done = progress, 0
        progress.start("identifying", float(total))

    def advance(self, rows: int, note: str) -> None:
        self._done += rows
        self._progress.update(float(self._done), note)

    def finish(self) -> None:
        self._progress.finish()


def _fit(
    base: BaseParameters,
    pieces: Pieces,
    estimator: Estimator,
    choice: Choice,
    seed: int,
    bar: _Rows,
    period: float,
) -> tuple[Fit, Errors]:
    """Fits in three readings: speeds, moments, errors."""
    smoother = choice.smoother
    assert isinstance(smoother, LowPass)
    segments, n = pieces.survey.segments, pieces.robot.n
    squares, counts = np.zeros((len(segments), n)), np.zeros(len(segments))
    for k, square, count in pieces.speeds(smoother):
        squares[k] += square
        counts[k] += count
        bar.advance(count, "speeds")
    speeds = np.sqrt(squares / np.maximum(counts, 1)[:, None])
    regressor = JointRegressor(base)
    total: Moments | None = None
    for part in pieces.rows(smoother, speeds):
        own = sum_moments(regressor, [part])
        total = own if total is None else total + own
        bar.advance(len(part.motion), "fitting")
    if total is None:
        raise InputError("no rows are left to fit", file=pieces.stream.path, remedy="record a longer log")
    moments = total.pulled(choice.prior)
    values, weights = estimator.solve(moments, choice.ridge)
    values = with_braking_friction(base, moments, values, weights, choice.ridge)
    solution = Solution(values=values, weights=weights)
    errors = Errors(int(counts.sum()), np.maximum(np.abs(pieces.survey.lowest), np.abs(pieces.survey.highest)))
    nominal, scores = np.zeros(n), []
    for part in pieces.rows(smoother, speeds):
        torque = np.empty_like(part.tau)
        found = second_pass(regressor, part, solution, torque, True)
        nominal += found.nominal
        scores.append(found.scores)
        errors.add(part, torque)
        bar.advance(len(torque), "errors")
    kept = [Fitted(part, torque, None) for part, torque in errors.kept]
    full, white, share = covariances(
        regressor,
        kept,
        np.concatenate(scores),
        moments,
        solution,
        choice.ridge,
        round(AVERAGING_TIME / period),
        seed,
        errors.rows,
    )
    return (
        Fit(
            base=base,
            choice=choice,
            solution=solution,
            moments=moments,
            rows=[some.rows for some in kept],
            torque=np.concatenate([some.torque for some in kept]),
            predicted=[some.torque for some in kept],
            nominal=nominal,
            covariance=full,
            white=white,
            prior_share=share,
        ),
        errors,
    )
