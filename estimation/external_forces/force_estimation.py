"""The verb: external forces and contacts of a log, by an identified model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from estimation.external_forces.contacts import find_contacts
from estimation.external_forces.options import ForceOptions
from estimation.external_forces.residuals.dynamics import dynamics_of, require_inertia
from estimation.external_forces.residuals.filters import filtered
from estimation.external_forces.residuals.signals import Signals, signals_of
from estimation.external_forces.result import ForceEstimate
from estimation.external_forces.thresholds.calibrations import Calibration
from estimation.external_forces.thresholds.healthy_logs import calibrate_signals, check_rate
from estimation.external_forces.thresholds.observations import Observed, observe_robustly
from estimation.external_forces.wrenches import tool_load
from estimation.logs.provenance import are_same_log, describe_logs
from estimation.models.model import Model
from estimation.predictions.checked_motions import smoothed_at_least
from estimation.predictions.prediction import Prediction, predict
from robots.common.arrays import Array
from robots.common.errors import InputError, NotIdentifiableError
from robots.common.progress import SILENT, Progress
from robots.signals import Log
from robots.terms.friction import STANDING_SPEED
from robots.terms.situations.flange_body import require_flange

Predictor = Callable[[Model, Log], Prediction]


def estimate_forces(
    model: Model,
    log: Log,
    *,
    healthy: Sequence[Log] = (),
    calibration: Calibration | None = None,
    options: ForceOptions | None = None,
    predictor: Predictor | None = None,
    progress: Progress | None = None,
) -> ForceEstimate:
    """Estimates the external forces of a log, and finds contacts.

    Args:
        model: an identified model.
        log: with positions and torque.
        healthy: logs without contacts, from which the threshold follows. Without any the log itself serves: what looks
            like a contact is left out of it.
        calibration: of an earlier call, instead of `healthy`.
        options: of the observer and its threshold; a calibration has its own bandwidth and velocities.
        predictor: predicts the torques of a log by the model that it is given, whose smoothing suits the observer;
            `predict` by default. One with heat is ``lambda model, log: predict(model, log, thermal=...)``.
        progress: receives the progress.

    Returns:
        Forces with their uncertainty at each sample, and the contacts.

    Raises:
        InputError: a model without inertial parameters, a robot without a flange, a log of another number of joints,
            without torque or asked-for velocities, or too short.
        NotIdentifiableError: the model does not fit the log.
    """
    require_inertia(model)
    require_flange(model.robot)
    how = options or ForceOptions()
    bandwidth, velocity = how.bandwidth, how.velocity
    if calibration is not None:
        bandwidth, velocity = calibration.bandwidth, calibration.velocity
    # Least cut-off of the positions' smoothing over the observer's bandwidth, so that it smears nothing that passes.
    # Noise of the positions above the bandwidth does not pass the observer, so that a higher cut-off costs nothing.
    model = smoothed_at_least(model, 5.0 * bandwidth)
    run, bar = predictor or predict, progress or SILENT
    bar.start("external forces", float(len(healthy) + 1))
    warnings: list[str] = []

    def prepared(own: Log, done: int) -> tuple[Signals, Callable[[Signals], str | None]]:
        bar.update(float(done), own.name)
        prediction = run(model, own)
        if prediction.measured is None:
            raise InputError("the log has no torque", file=own.metadata.get("file"), remedy="record tau1.. or i1..")
        dynamics = dynamics_of(model, gravity=own.gravity, payload=own.payload, tool=how.tool)
        name = str(own.metadata.get("file") or own.name)
        signals = signals_of(model, dynamics, own, prediction, bandwidth, velocity)
        return signals, lambda levelled: check_fit(levelled, prediction.band, name)

    signals, check = prepared(log, 0)
    known = model.provenance.get("logs", ())
    in_fit = any(are_same_log(own, other) for own in describe_logs(healthy) for other in known)
    if in_fit:
        warnings.append(
            "the model was fitted to a log of --healthy, which says nothing of its errors in other motions: a log that "
            "the fit has not seen gives a lower threshold"
        )
    if calibration is None:
        normal = []
        for k, own in enumerate(healthy, start=1):
            part, check_part = prepared(own, k)
            check_part(part)
            normal.append(part)
        calibration = calibrate_signals(
            model,
            normal or [signals],
            bandwidth=bandwidth,
            velocity=velocity,
            false_alarms=how.false_alarms,
            own=not healthy,
            in_fit=in_fit,
        )
        if normal:
            calibration = replace(calibration, check=check_rate(model, normal, calibration, in_fit=in_fit))
    if calibration.own:
        warnings.append("the threshold comes from this log itself: a contact in most of it would be missed (--healthy)")
    signals, observed = observe_robustly(signals, calibration)
    # A push must not look like a joint that the model does not fit: its level of friction is known only now.
    misfit = check(signals)
    bar.finish()
    return forces_of(model, signals, observed, calibration, [misfit, *warnings] if misfit else warnings)


def forces_of(
    model: Model, signals: Signals, observed: Observed, calibration: Calibration, warnings: Sequence[str] = ()
) -> ForceEstimate:
    """Gives the forces and contacts of prepared signals.

    Args:
        model: the identified model.
        signals: of the log.
        observed: the same, filtered and scaled.
        calibration: of a healthy robot.
        warnings: for the result.
    """
    covariance = calibration.errors.covariance(observed.deviation)
    force, force_spread = tool_load(observed.residual, covariance, signals.jacobian[:, :3])
    wrench, wrench_spread = tool_load(observed.residual, covariance, signals.jacobian)
    flagged, contacts = find_contacts(model.robot.chain, signals, observed, calibration)
    return ForceEstimate(
        robot=model.robot.name,
        joint_names=model.robot.joint_names,
        t=signals.t,
        torque=observed.residual,
        direct=filtered(signals.direct, signals.t, calibration.constant, signals.begins, from_zero=True),
        deviation=observed.deviation,
        statistic=observed.statistic / calibration.threshold.value,
        force=force,
        force_deviation=np.sqrt(np.einsum("tkk->tk", force_spread)),
        wrench=wrench,
        wrench_deviation=np.sqrt(np.einsum("tkk->tk", wrench_spread)),
        extrapolates=np.asarray(signals.extrapolates.any(axis=1)),
        flagged=flagged,
        contacts=contacts,
        calibration=calibration,
        warnings=tuple(warnings),
    )


def check_fit(signals: Signals, band: Array | None, name: str) -> str | None:
    """Compares a log's torque with the model's prediction of it, with the level of friction as it is followed.

    Only samples count in which a joint moves: friction holds a joint that stands with any torque.

    Args:
        signals: of the log.
        band: half-widths (N, n) of the model's 95 % band [N m or N]; None without one.
        name: of the log, for the message.

    Returns:
        A warning if most errors of some joint are outside the model's band, else None.

    Raises:
        NotIdentifiableError: the error of such a joint varies more than its torque, so that the model is of no use.
    """
    if band is None:
        return None
    outside, ratio = np.zeros((2, signals.torque.shape[1]))
    for j in range(len(outside)):
        moving = np.abs(signals.dq[:, j]) > STANDING_SPEED
        # A joint that moves in a smaller share of the samples does not test the model.
        if moving.mean() < 0.1:
            continue
        error = signals.direct[moving, j]
        outside[j] = np.mean(np.abs(error) > band[moving, j])
        ratio[j] = np.sqrt(np.mean(error**2)) / max(float(signals.torque[moving, j].std()), np.finfo(float).tiny)
    # The band is to hold 95 % of a healthy log's errors. Where it holds less than half, something acts most of the
    # time.
    least_outside = 0.5
    joint = int(np.argmax(np.where(outside > least_outside, ratio, 0.0)))
    if not outside[joint] > least_outside:
        return None
    if ratio[joint] > 1.0:
        raise NotIdentifiableError(
            f"the model does not fit this log: the torque error is {100 * ratio[joint]:.0f} % of the torque's standard "
            f"deviation",
            file=name or None,
            joint=joint + 1,
            remedy="the log may be of another robot, the robot may carry a load (--payload), or its torque may have "
            "another meaning (--torque-is); check it with oed predict, or identify the robot again",
        )
    return (
        f"joint {joint + 1}: {100 * outside[joint]:.0f} % of the torque errors are outside the model's 95 % band; the "
        "threshold is higher accordingly: identify the robot again, or state its payload or temperature"
    )
