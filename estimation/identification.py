"""The verb: identifies a robot's dynamic parameters from its logs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimation.choices import VELOCITY_SCALES, Candidates, Choice, choose
from estimation.estimate import Estimate, JointFit, colour_of
from estimation.estimators import Estimator
from estimation.estimators import estimator as choose_estimator
from estimation.model import Model
from estimation.moments import Moments
from estimation.preparation import Prepared, Rows, prepare
from estimation.uncertainty import Part, covariance, white_noise_covariance
from robots.base_parameters import BaseParameters, find_base_parameters
from robots.common.errors import InputError, NotIdentifiableError
from robots.common.files import sha256
from robots.common.parallel import one_blas_thread
from robots.common.progress import SILENT, Progress
from robots.regressor import default_model
from robots.robot import Robot
from robots.signals import Log
from robots.version import VERSION

Array = NDArray[np.float64]

CHUNK = 4096
# Standard errors are those of the fit without regularisation; this much keeps the inverse finite.
FAINT = 1e-13
# A parameter is determined when its standard error is below this share of it ...
RELATIVE = 0.5
# ... or when the torque that its standard error makes is below this share of every joint's torque: it is then known
# to be too small to matter.
NEGLIGIBLE = 0.02
# A joint whose left-out torque is predicted hardly better than by a constant is not identified.
HOPELESS = 0.9
# A torque that varies by less than this share of its size, or of 1 N m, is constant but for rounding.
ROUNDING = 1e-9


@one_blas_thread()
def identify(
    robot: Robot,
    logs: Log | Sequence[Log],
    *,
    method: str | Estimator = "wls",
    friction: str = "polynomial",
    rotor: bool = True,
    offset: bool = True,
    candidates: Candidates | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> Estimate:
    """Identifies base parameters of rigid body, friction, rotors and torque offsets, with standard errors.

    Positions are smoothed and differentiated without phase lag; smoothing, regularisation and the sharpness of the
    friction's sign are chosen by predicting blocks of the logs from the rest. Torque is fitted as it was logged. The
    standard errors survive coloured noise.

    Args:
        robot: the robot.
        logs: one log or several, of t, q and tau or current.
        method: ``wls``, ``ols``, or an estimator of one's own.
        friction: ``polynomial`` or ``coulomb-viscous``.
        rotor: with rotor inertias.
        offset: with a torque offset per joint.
        candidates: settings that the data choose from.
        seed: of the noise drawn to correct the standard errors.
        progress: is told how far it is.

    Returns:
        The estimate.

    Raises:
        InputError: logs of another robot, without torque, or too short; unknown options.
        NotIdentifiableError: logs in which no joint's torque can be predicted.
    """
    chosen = choose_estimator(method)
    data = [logs] if isinstance(logs, Log) else list(logs)
    if not data:
        raise InputError("no logs", allowed="one or more")
    bar = progress or SILENT
    bar.start("identifying", 4.0)
    prepared = [prepare(robot, log) for log in data]
    sharp = default_model(robot, friction=friction, velocity_scale=VELOCITY_SCALES[0], rotor=rotor, offset=offset)
    base = find_base_parameters(sharp)
    bar.update(1.0, "choosing smoothing and regularisation")
    choice = choose(base, prepared, chosen, candidates or Candidates())
    predictable = _predictable(prepared, choice)
    model = default_model(robot, friction=friction, velocity_scale=choice.velocity_scales, rotor=rotor, offset=offset)
    base = replace(base, model=model)
    rows = [log.rows(choice.cutoff) for log in prepared]
    bar.update(2.0, "fitting")
    moments = _moments(base, rows)
    values, weights = chosen.solve(moments, choice.ridge)
    bar.update(3.0, "standard errors")
    predicted = [base.torque(part.motion.q, part.motion.dq, part.motion.ddq, values) for part in rows]
    parts = [_part(base, part, part.tau - torque) for part, torque in zip(rows, predicted, strict=True)]
    inverse = moments.inverse(weights, FAINT)
    full = covariance(parts, weights, inverse, seed)
    white = white_noise_covariance(parts, weights, inverse)
    joints = _joint_fits(base, rows, predicted, choice, predictable)
    bar.finish()
    determined = _determined(base, moments, values, full, joints)
    naive = np.sqrt(np.maximum(np.diag(white), 0.0))
    colour = colour_of(np.sqrt(np.maximum(np.diag(full), 0.0)), naive, determined)
    return Estimate(
        model=Model(
            torque_model=model,
            columns=base.independent,
            values=values,
            covariance=full,
            determined=determined,
            formulas=base.formulas(),
            provenance={**_provenance(data, chosen, choice, joints, seed), "colour": colour},
        ),
        choice=choice,
        joints=joints,
        white_noise_errors=naive,
        t=np.concatenate([part.motion.t for part in rows]),
        dq=np.concatenate([part.motion.dq for part in rows]),
        measured=np.concatenate([part.tau for part in rows]),
        predicted=np.concatenate(predicted),
        dropped_rows=sum(log.positions.dropped for log in prepared),
    )


def _moments(base: BaseParameters, rows: Sequence[Rows]) -> Moments:
    total: Moments | None = None
    for part in rows:
        for start in range(0, len(part.motion), CHUNK):
            chunk = slice(start, start + CHUNK)
            Y = base.regressor(part.motion.q[chunk], part.motion.dq[chunk], part.motion.ddq[chunk])
            moments = Moments.of(Y, part.tau[chunk], part.mask[chunk])
            total = moments if total is None else total + moments
    assert total is not None
    return total


def _part(base: BaseParameters, rows: Rows, residual: Array) -> Part:
    motion = rows.motion

    def regressor(start: int, stop: int) -> Array:
        return base.regressor(motion.q[start:stop], motion.dq[start:stop], motion.ddq[start:stop])

    return Part(len(motion), regressor, rows.mask, residual * rows.mask)


def _predictable(prepared: Sequence[Prepared], choice: Choice) -> NDArray[np.bool_]:
    """Which joints (n,) move, and have a torque that varies and follows from the motion.

    Raises:
        NotIdentifiableError: none.
    """
    moves = np.any([np.ptp(log.log.q, axis=0) > 0 for log in prepared], axis=0)
    tau = np.concatenate([log.tau for log in prepared])
    varies = np.ptp(tau, axis=0) > ROUNDING * np.maximum(1.0, np.abs(tau).max(axis=0))
    follows = choice.held_out < HOPELESS * choice.spread
    if (moves & varies & follows).any():
        return np.asarray(moves & varies & follows)
    if not moves.any():
        raise NotIdentifiableError("no joint moves", remedy="record a log in which the arm moves")
    if not varies.any():
        raise NotIdentifiableError(
            "no joint's torque varies", remedy="record the torque of the moving arm, and check what tau1.. hold"
        )
    raise NotIdentifiableError(
        "no joint's torque can be predicted from its motion",
        allowed="left-out torque errors below its standard deviation",
        remedy="check units and signs of q and tau, and that the arm moves",
    )


def _joint_fits(
    base: BaseParameters,
    rows: Sequence[Rows],
    predicted: Sequence[Array],
    choice: Choice,
    predictable: NDArray[np.bool_],
) -> tuple[JointFit, ...]:
    """Measures each joint's errors, beside what a constant and the robot's description would give."""
    measured = np.concatenate([part.tau for part in rows])
    # On the rows that count, as the left-out errors are: of a standing joint's friction no model knows the sign.
    mask = np.concatenate([part.mask for part in rows])
    fitted = np.sum(mask * (measured - np.concatenate(predicted)) ** 2, axis=0) / np.maximum(mask.sum(axis=0), 1)
    rms = np.sqrt(np.mean(measured**2, axis=0))
    nominal = np.full(len(rms), np.nan)
    description = base.model.nominal
    if np.isfinite(description).all():
        torque = np.concatenate(
            [base.model.torque(part.motion.q, part.motion.dq, part.motion.ddq, description) for part in rows]
        )
        nominal = np.sqrt(np.mean((measured - torque) ** 2, axis=0))
    return tuple(
        JointFit(
            joint=j + 1,
            name=base.model.robot.joint_names[j],
            torque_rms=float(rms[j]),
            torque_spread=float(choice.spread[j]),
            residual_rms=float(np.sqrt(fitted[j])),
            held_out_rms=float(choice.held_out[j]),
            nominal_rms=float(nominal[j]),
            identified=bool(predictable[j]),
        )
        for j in range(len(rms))
    )


def _determined(
    base: BaseParameters, moments: Moments, values: Array, full: Array, joints: Sequence[JointFit]
) -> NDArray[np.bool_]:
    errors = np.sqrt(np.maximum(np.diag(full), 0.0))
    excited = np.einsum("jpp->jp", moments.gram) / np.maximum(moments.count, 1)[:, None]  # mean square of each column
    torque = np.array([joint.torque_rms for joint in joints])
    share = (errors * np.sqrt(excited) / np.maximum(torque, np.finfo(float).tiny)[:, None]).max(axis=0)
    known = (errors <= RELATIVE * np.abs(values)) | (share <= NEGLIGIBLE)
    own = np.array([column.term != "rigid_body" for column in base.columns])
    lost = np.array([not joints[column.joint - 1].identified for column in base.columns])
    return known & (excited.sum(axis=0) > 0) & ~(own & lost)


def _provenance(
    logs: Sequence[Log], method: Estimator, choice: Choice, joints: Sequence[JointFit], seed: int
) -> dict[str, object]:
    described = []
    for log in logs:
        file = log.metadata.get("file")
        described.append(
            {
                "name": log.name,
                "sha256": sha256(file) if file else None,
                "samples": len(log),
                "duration": log.duration,
            }
        )
    return {
        "logs": described,
        "method": method.name,
        "tool_version": VERSION,
        "cutoff_hz": choice.cutoff,
        "ridge": choice.ridge,
        "velocity_scales": list(choice.velocity_scales),
        "seed": seed,
        "residual_rms": [joint.residual_rms for joint in joints],
        "held_out_rms": [joint.held_out_rms for joint in joints],
        "torque_rms": [joint.torque_rms for joint in joints],
        "joints_identified": [joint.identified for joint in joints],
    }
