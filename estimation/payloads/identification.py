"""The verb: identifies a payload from logs with and without it, or from one log and a model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimation.identifications.estimate import Estimate
from estimation.identifications.identification import identify
from estimation.linear_algebra.scaled import floored_inverse
from estimation.logs.known_setup import require_known
from estimation.logs.provenance import describe_logs
from estimation.models.model import Model
from estimation.payloads.body import Body
from estimation.payloads.determination import is_nothing, require_determined
from estimation.payloads.equations import Arm, Equations, PairedEquations, Source
from estimation.payloads.fit import PayloadFit, fit_payload
from estimation.payloads.intervals import quantities
from estimation.payloads.mounts import Mount
from estimation.payloads.paths import PathMatch, match_paths
from estimation.payloads.physical import PhysicalBody, physical_body
from estimation.payloads.result import JointEvidence, PayloadEstimate
from estimation.recordings import Recording, make_ready
from estimation.regressions.preparation import Prepared, Rows, prepare_all, still_joints
from robots.common.arrays import Array
from robots.common.errors import InputError, NotIdentifiableError
from robots.common.parallel import one_blas_thread
from robots.common.progress import SILENT, Progress
from robots.robot import Robot
from robots.signals import Log

# Torque errors this many times those of the log without payload are in doubt.
DOUBTFUL_ERROR_RATIO = 2.0
NOTHING = PhysicalBody(parameters=np.zeros(10), nearest=np.zeros(10), distance=0.0)


@one_blas_thread()
def identify_payload(
    logs: Log | Sequence[Log],
    *,
    robot: Robot | None = None,
    without: Log | Sequence[Log] = (),
    model: Model | Estimate | None = None,
    link: int | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> PayloadEstimate:
    """Identifies mass, centre of mass and inertia of a payload, with 95 % intervals.

    From logs with and without the payload, only the robot's geometry is needed. Two logs of one path are paired row by
    row: what the model of the arm misses is in both and cancels in their difference (Khalil et al. 2007,
    10.1109/ROBOT.2007.364029). Logs of different paths are fitted together. From one log and a model, the model's
    covariance counts as prior knowledge, and friction may have changed.

    Args:
        logs: with the payload; a payload that a log states is known, and not counted in.
        robot: the robot; by default the model's.
        without: logs without the payload.
        model: the robot without payload, instead of `without`; with `without`, an `Estimate` from those logs, which
            saves its fit.
        link: the link that carries the payload, counted from 1 by the joint that moves it; None for the flange.
        seed: of the noise drawn to correct the standard errors.
        progress: hears how far it is.

    Returns:
        The payload in the frame of the flange, or of the link.

    Raises:
        InputError: neither `without` nor a model, logs of another robot or that the gate refuses, or a mass that is
            significantly negative.
        NotIdentifiableError: logs that leave the mass or the centre open, or whose torque no payload explains.
    """
    bar = progress or SILENT
    loaded = [logs] if isinstance(logs, Log) else list(logs)
    free = [without] if isinstance(without, Log) else list(without)
    estimate = model if isinstance(model, Estimate) else None
    known = estimate.model if estimate is not None else model
    assert not isinstance(known, Estimate)
    if not loaded or (not free and known is None) or (free and known is not None and estimate is None):
        raise InputError("no reference for the payload", allowed="either logs without the payload, or a model")
    machine = robot if robot is not None else None if known is None else known.robot
    if machine is None:
        raise InputError("no robot", remedy="name the robot of the logs")
    reference = None
    if free:
        estimate = estimate or identify(machine, free, seed=seed, progress=progress)
        known, reference = estimate.model, estimate.recording or make_ready(machine, free)
        machine = reference.robot
    assert known is not None
    mount = Mount(known.robot, link)
    bar.start("fitting the payload", None)
    for log in loaded:
        if log.gravity is not None:
            require_known(known.torque_model, known.columns, known.gravities, log.gravity)
    cutoff = float(known.provenance.get("cutoff_hz", 5.0))
    arm = _arm_of_logs(estimate, mount) if estimate is not None and free else _arm_of_model(known, mount)
    prepared, carried = _prepared(make_ready(machine, loaded), reference, known)
    sources = [
        Source.of(arm, rows, k < carried, _extra(known, rows), log.period)
        for k, (log, rows) in enumerate((log, log.rows(cutoff)) for log in prepared)
    ]
    equations, match = _equations(arm, sources, carried)
    period = float(np.median([log.positions.period for log in prepared]))
    found = fit_payload(arm, equations, period=period, seed=seed)
    bar.finish()
    return _result(mount, machine, known, sources, found, match, loaded, free)


def _prepared(loaded: Recording, free: Recording | None, model: Model) -> tuple[list[Prepared], int]:
    """Prepares all logs together, those with the payload first, and counts these."""
    carried, bare = ([part for own in some.parts for part in own] if some else [] for some in (loaded, free))
    prepared = prepare_all(loaded.robot, [*carried, *bare])
    if free or "recorded" not in model.provenance:
        return prepared, len(carried)
    lowest, highest = np.asarray(model.provenance["recorded"]["position"], dtype=float)
    still = still_joints([log.positions.q for log in prepared], highest - lowest)
    # Friction holds a joint that stands with any torque.
    held = [replace(log, still=own, held=own) if own.any() else log for log, own in zip(prepared, still, strict=True)]
    return held, len(carried)


def _arm_of_logs(estimate: Estimate, mount: Mount) -> Arm:
    """The arm's parameters by the logs without payload, and the prior of their fit; the logs themselves are data."""
    model, choice = estimate.model, estimate.choice
    shares = [(joint.torque_rms / joint.residual_rms) ** 2 for joint in estimate.joints if joint.residual_rms]
    return Arm(
        model=model.torque_model,
        columns=model.columns,
        values=model.values,
        precision=choice.prior.precision,
        target=choice.prior.target - model.values,
        weight=choice.ridge * estimate.samples * float(np.sum(shares)),
        mount=mount,
    )


def _arm_of_model(model: Model, mount: Mount) -> Arm:
    """The arm's parameters by a model, its covariance widened by a drift of friction."""
    friction = np.array([column.friction for column in model.parameters])
    # Friction of a model may have changed since by temperature: by this share of each coefficient (standard deviation).
    covariance = model.covariance + np.diag(np.where(friction, 0.3 * model.values, 0.0) ** 2)
    return Arm(
        model=model.torque_model,
        columns=model.columns,
        values=model.values,
        precision=floored_inverse(covariance),
        target=np.zeros(len(model.values)),
        weight=max(float(model.provenance.get("colour", 1.0)), 1.0) ** 2,
        mount=mount,
    )


def _extra(model: Model, rows: Rows) -> Array | None:
    """Torque of the model's extensions (N, n)."""
    if not model.extensions:
        return None
    motion = rows.motion
    whole = model.torque(motion.q, motion.dq, motion.ddq, t=motion.t, gravity=rows.gravity)
    return whole - model.torque(motion.q, motion.dq, motion.ddq, gravity=rows.gravity)


def _equations(arm: Arm, sources: Sequence[Source], loaded: int) -> tuple[list[Equations], PathMatch | None]:
    if len(sources) != 2 or loaded != 1:
        return [Equations(arm, source) for source in sources], None
    own, other = (source.rows.motion for source in sources)
    match = match_paths(own.t, own.q, other.t, other.q)
    if match.same:
        return [PairedEquations(arm, sources[0], sources[1], match)], match
    return [Equations(arm, source) for source in sources], match


def _result(
    mount: Mount,
    robot: Robot,
    model: Model,
    sources: Sequence[Source],
    found: PayloadFit,
    match: PathMatch | None,
    loaded: Sequence[Log],
    free: Sequence[Log],
) -> PayloadEstimate:
    mine = [source.rows for source in sources if source.carries]
    q, gravity = np.concatenate([rows.motion.q for rows in mine]), mine[0].gravity
    rms = np.sqrt(np.concatenate([rows.tau**2 for rows in mine]).mean(axis=0))
    # Of paired logs the first n channels are the differences.
    residual, without = found.residual[: robot.n], found.without[: robot.n]
    ratio = _error_ratio(model, rms, residual)
    # Torque errors six times those of the log without payload are no payload's.
    if ratio > 6.0:
        raise NotIdentifiableError(
            f"no payload explains the torque: the errors are {ratio:.2g} times those without payload",
            remedy="check that the logs are of one robot, and that nothing touches the payload",
        )
    error = float(np.sqrt(found.covariance[0, 0]))
    nothing = is_nothing(float(found.values[0]), error, mount, q, gravity)
    body = NOTHING if nothing else _body(found)
    if not nothing:
        require_determined(quantities(found.values, found.covariance, body.parameters), mount, q, gravity)
    method = "model" if not free else "difference" if match is not None and match.same else "joint fit"
    return PayloadEstimate(
        robot=robot.name,
        method=method,
        body=Body(body.parameters),
        nearest=body.nearest,
        values=found.values,
        covariance=found.covariance,
        joints=tuple(
            JointEvidence(joint=j + 1, name=name, torque_rms=float(rms[j]), without=float(a), residual=float(b))
            for j, (name, a, b) in enumerate(zip(robot.joint_names, without, residual, strict=True))
        ),
        rows=found.rows,
        link=mount.link,
        warnings=(*_warnings(body, ratio, match), *(_elsewhere(mount, model, rms, residual) if nothing else ())),
        provenance={
            "logs": describe_logs(loaded),
            "without": describe_logs(free),
            "model": None if free else model.provenance.get("logs"),
            "tool_version": model.provenance.get("tool_version"),
            "path_distance": None if match is None else match.distance.tolist(),
            "shift": None if match is None else match.shift,
        },
    )


def _body(found: PayloadFit) -> PhysicalBody:
    """The body of a fit; without a positive mass there is none, and the smallest mass takes its place in messages."""
    if found.values[0] > 0:
        return physical_body(found.values, found.covariance)
    # Stands for a mass [kg] that came out as zero.
    values = np.concatenate([[max(-found.values[0], 1e-6)], found.values[1:]])
    return PhysicalBody(parameters=values, nearest=values, distance=0.0)


def _elsewhere(mount: Mount, model: Model, rms: Array, residual: Array) -> list[str]:
    """Says that logs differ without a payload on the mount, as by a body on another link."""
    ratios = _error_ratios(model, rms, residual)
    joint = int(np.argmax(ratios))
    if ratios[joint] <= DOUBTFUL_ERROR_RATIO:
        return []
    return [
        f"The logs differ by something else: the torque error of joint {joint + 1} is {ratios[joint]:.2g} times that "
        f"without payload. A body on another link than the {mount.name} is found with --link."
    ]


def _error_ratio(model: Model, rms: Array, residual: Array) -> float:
    """How many times the torque errors without payload the errors with it are, for the median joint."""
    return float(np.median(_error_ratios(model, rms, residual)))


def _error_ratios(model: Model, rms: Array, residual: Array) -> Array:
    """How many times the torque errors without payload the errors with it are (n,).

    Noise may grow with the torque: absolute and relative errors are compared, and the smaller ratio counts.

    Args:
        model: of the robot without payload.
        rms: torque RMS of the log with the payload (n,).
        residual: its torque errors (n,).
    """
    tiny = np.finfo(float).tiny
    free = np.maximum(np.asarray(model.provenance["residual_rms"], dtype=float), tiny)
    torque = np.maximum(np.asarray(model.provenance["torque_rms"], dtype=float), tiny)
    return np.minimum(residual / free, residual / np.maximum(rms, tiny) / (free / torque))


def _warnings(body: PhysicalBody, ratio: float, match: PathMatch | None) -> list[str]:
    found = []
    if match is not None and not match.same:
        joint = int(np.argmax(match.distance))
        found.append(
            f"The logs follow different paths (up to {match.largest[joint]:.2g} rad or m apart, joint {joint + 1}) "
            "and were fitted jointly. What the model of the arm misses does not cancel then. Repeat one path for a "
            "better result."
        )
    if body.contradicted:
        found.append(
            f"Least squares give a payload that no body has ({np.sqrt(body.distance):.1f} standard deviations from the "
            "nearest). The result is the nearest body that can exist. Check for contacts, cables, loose parts, or "
            "friction that grows with the load."
        )
    if ratio > DOUBTFUL_ERROR_RATIO:
        found.append(
            f"The torque errors are {ratio:.2g} times those without payload. Check that the payload is rigid and "
            "touches nothing, and that friction did not change."
        )
    return found
