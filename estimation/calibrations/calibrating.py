"""The verb: fits a robot's geometry to measured poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from estimation.calibrations.fit import GeometryFit, fit_geometry
from estimation.calibrations.folds import outside_range
from estimation.calibrations.options import CalibrationOptions
from estimation.calibrations.outliers import without_outliers
from estimation.calibrations.repeatability import repeatability
from estimation.calibrations.result import (
    CalibratedParameter,
    Calibration,
    ErrorLevels,
    PoseErrors,
)
from estimation.calibrations.selection import HeldOut, KindTrial, held_out_errors, select_kinds
from estimation.calibrations.suspicions import require_enough
from estimation.calibrations.undetermined import undetermined
from estimation.uncertainty.quantiles import student_95
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.parallel import one_blas_thread
from robots.common.progress import SILENT, Progress
from robots.geometry_errors.arm import ErroneousArm
from robots.geometry_errors.measurements.setup import Unknown
from robots.geometry_errors.model import GeometryModel
from robots.geometry_errors.poses import MeasuredPoses
from robots.geometry_errors.terms import TERMS, ErrorTerm, error_term
from robots.geometry_errors.twists import rotation_vector
from robots.robot import Robot
from robots.version import VERSION

COMMON = 0.1  # of the poses; more outliers are no single faults


@one_blas_thread()
def calibrate(
    robot: Robot | Sequence[Robot],
    poses: MeasuredPoses,
    *,
    held_out: MeasuredPoses | None = None,
    options: CalibrationOptions | None = None,
    progress: Progress | None = None,
) -> Calibration:
    """Fits joint zeros, links and other geometric errors of a robot to measured poses.

    The poses of instrument and tool are estimated, too. Kinds of errors are added while they predict held-out poses
    better; errors that no pose distinguishes are left out, and named. Poses that do not fit are left out, and named
    (Hollerbach, Khalil and Gautier, Springer Handbook of Robotics 2016, chapter 6).

    Args:
        robot: as it is described; two for a part that both arms hold.
        poses: N poses, at least six.
        held_out: poses of another session, to check the result on.
        options: how.
        progress: hears how far it is.

    Returns:
        The calibration.

    Raises:
        InputError: poses of another number of joints, a kind of errors that the poses cannot show, or poses that are
            not what their file says: other units, another order.
        NotIdentifiableError: too few poses.
    """
    how, bar = options or CalibrationOptions(), progress or SILENT
    robots = [robot] if isinstance(robot, Robot) else list(robot)
    if len(robots) != poses.measurement.arms:
        raise InputError(f"{len(robots)} robots", allowed=f"{poses.measurement.arms}, for {poses.measurement.title}")
    require_enough(robots, poses)
    bar.start("calibrating", None)
    try:
        bar.update(0, "choosing kinds of errors")
        terms, trials = _terms(robots, poses, how)
        bar.update(0, "fitting")
        nominal = fit_geometry(_model(robots, [], poses))
        first = fit_geometry(_model(robots, terms, poses))
        fit, outliers = without_outliers(first)
        bar.update(0, "predicting held-out poses")
        errors = held_out_errors(fit, seed=how.seed)
        open_ = undetermined(robots, terms, fit)
        causes: dict[str, Any] = {}
        if how.diagnose:
            from estimation.calibrations.causes.diagnosing import diagnose_geometry

            bar.update(0, "looking for causes")
            causes = diagnose_geometry(robots, poses, fit, used=fit.used).to_dict()
        check = None if held_out is None else _check(robots, terms, fit, nominal, held_out)
    finally:
        bar.finish()
    return _result(robots[0], poses, terms, trials, nominal, fit, errors, outliers, open_, causes, check, how)


def _model(robots: Sequence[Robot], terms: Sequence[ErrorTerm], poses: MeasuredPoses) -> GeometryModel:
    return GeometryModel(robots, terms, poses)


def _terms(
    robots: Sequence[Robot], poses: MeasuredPoses, how: CalibrationOptions
) -> tuple[tuple[ErrorTerm, ...], tuple[KindTrial, ...]]:
    if how.kinds is None:
        return select_kinds(robots, TERMS, poses, seed=how.seed)
    states = poses.states(*robots)
    for kind in how.kinds:
        missing = error_term(kind).missing(robots[0], states[0])
        if missing:
            raise InputError(f"{error_term(kind).title} cannot be fitted", remedy=f"it needs {missing}")
    return tuple(term for term in TERMS if term.kind in how.kinds), ()


def _check(
    robots: Sequence[Robot], terms: Sequence[ErrorTerm], fit: GeometryFit, nominal: GeometryFit, poses: MeasuredPoses
) -> ErrorLevels:
    """Errors of other poses by the fit, and by the description with the setup of the fitted poses."""
    temperature = fit.model.poses.temperature
    reference = None if temperature is None else float(temperature.mean())
    model = GeometryModel(robots, terms, poses, reference=reference)
    values = dict(zip((item.name for item in fit.model.errors), fit.values, strict=True))
    found = model.residual(np.array([values.get(item.name, 0.0) for item in model.errors]), fit.setup)
    before = _model(robots, [], poses).residual(np.zeros(0), nominal.setup)
    error = poses.measurement.error(found)
    outside = outside_range(poses.q, fit.model.poses.q[fit.used])
    held = HeldOut(residual=found, error=error, outside=outside)
    return ErrorLevels(
        before=_rms(poses.measurement.error(before)),
        after=_rms(fit.model.poses.measurement.error(fit.residual)[fit.used]),
        held_out=held.rms(),
        inside=held.rms(~outside),
        outside=held.rms(outside),
        outside_count=int(outside.sum()),
    )


def _result(
    robot: Robot,
    poses: MeasuredPoses,
    terms: Sequence[ErrorTerm],
    trials: tuple[KindTrial, ...],
    nominal: GeometryFit,
    fit: GeometryFit,
    errors: HeldOut,
    outliers: tuple[Any, ...],
    open_: tuple[Any, ...],
    causes: dict[str, Any],
    check: ErrorLevels | None,
    how: CalibrationOptions,
) -> Calibration:
    measure, used = poses.measurement.error, fit.used
    before = nominal.residual
    parameters = _parameters(fit)
    values = {item.name: item.value for item in parameters}
    arm = ErroneousArm(robot=robot, terms=tuple(terms))
    warnings = []
    if len(outliers) > COMMON * len(poses):
        warnings.append(
            f"{len(outliers)} of {len(poses)} poses were left out as outliers: so many are no single faults. Check "
            "that the file is of this robot, and look for a moved base or a loose marker."
        )
    if errors.rms(used) > _rms(measure(before)[used]):
        warnings.append("The calibrated robot predicts held-out poses no better than the description: do not use it.")
    assert poses.line is not None
    return Calibration(
        robot=robot,
        corrected=replace(robot, chain=arm.corrected_chain(values)),
        measurement=poses.measurement.kind,
        unit=poses.measurement.unit,
        kinds=tuple(term.kind for term in terms),
        parameters=parameters,
        setup={name: part.value.tolist() for name, part in fit.setup.items()},
        noise=dict(fit.weights.sigma),
        levels=ErrorLevels(
            before=_rms(measure(before)[used]),
            after=_rms(measure(fit.residual)[used]),
            held_out=errors.rms(used),
            inside=errors.rms(used & ~errors.outside),
            outside=errors.rms(used & errors.outside),
            outside_count=int((used & errors.outside).sum()),
        ),
        poses=PoseErrors(
            line=poses.line,
            q=poses.q,
            before=measure(before),
            after=measure(fit.residual),
            held_out=errors.error,
            used=used,
            session=poses.session,
            shift_before=poses.measurement.shift(before),
            shift=poses.measurement.shift(errors.residual),
        ),
        trials=trials,
        undetermined=open_,
        outliers=outliers,
        repeatability=repeatability(poses, fit.residual, used),
        check=check,
        causes=causes,
        warnings=tuple(warnings),
        provenance={
            **poses.source,
            "poses": len(poses),
            "seed": how.seed,
            "sizes": dict(fit.sizes),
            "temperature": None if poses.temperature is None else float(poses.temperature.mean()),
            "tool_version": VERSION,
        },
    )


def _parameters(fit: GeometryFit) -> tuple[CalibratedParameter, ...]:
    """Errors and setup with intervals, of what was fitted."""
    errors, kept = len(fit.values), list(fit.reduction.kept)
    covariance = np.zeros((len(fit.parameters),) * 2)
    covariance[np.ix_(kept, kept)] = fit.covariance
    values, start = list(fit.values), errors
    for part in fit.setup.values():
        if part.known:
            continue
        block = slice(start, start + part.size)
        values += _own_values(part)
        if part.kind in ("pose", "rotation"):
            # The step of a pose is in its own axes; people want it in those in which the pose is given.
            turn = np.kron(np.eye(part.size // 3), part.value[:3, :3])
            covariance[block, block] = turn @ covariance[block, block] @ turn.T
        start += part.size
    width, spread = student_95(fit.freedom), np.sqrt(np.diag(covariance))
    return tuple(
        CalibratedParameter(
            name=item.name,
            kind=item.kind,
            joint=item.joint,
            value=float(values[k]),
            standard_error=float(spread[k]),
            lower=float(values[k] - width * spread[k]),
            upper=float(values[k] + width * spread[k]),
            unit=item.unit,
        )
        for k, item in enumerate(fit.parameters)
        if k in kept
    )


def _own_values(part: Unknown) -> list[float]:
    """Coordinates of points, and rotation vectors of turns; directions count by their change."""
    if part.kind == "pose":
        return [*part.value[:3, 3].tolist(), *rotation_vector(part.value[:3, :3]).tolist()]
    if part.kind == "rotation":
        return [float(value) for value in rotation_vector(part.value)]
    return [0.0, 0.0] if part.kind == "direction" else [float(value) for value in part.value]


def _rms(errors: Array) -> float:
    known = errors[np.isfinite(errors)]
    return float(np.sqrt(np.mean(known**2))) if known.size else float("nan")
