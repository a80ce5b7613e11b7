"""The verbs: identifies a payload, and the drives' gains, from runs with and without it."""

from __future__ import annotations

from collections.abc import Sequence

from numpy.typing import ArrayLike

from estimation.estimators.drive_gains import CurrentRun, DriveGains, fit_drive_gains
from estimation.estimators.payload import Payload, fit_payload
from estimation.logs.known_setup import require_plain
from estimation.models.model import Model
from estimation.regressions.preparation import prepare
from robots.base_parameters import find_base_parameters
from robots.common.errors import InputError
from robots.common.parallel import one_blas_thread
from robots.regressor import default_model
from robots.robot import Robot
from robots.signals import Log

CUTOFF = 5.0
# Coulomb friction fades below this speed [rad/s or m/s].
SHARP = 1e-3


@one_blas_thread()
def identify_payload(model: Model, logs: Log | Sequence[Log], *, consistent: bool = True) -> Payload:
    """Identifies the ten inertial parameters of a payload from runs that carry it.

    Args:
        model: identified without the payload; its covariance counts in the payload's.
        logs: one log or several, smoothed as the model's own were.
        consistent: whether the payload must be a body that can exist.

    Returns:
        The payload, about the last link's frame.

    Raises:
        InputError: logs of another robot, without torque, or that state a payload or gravity of their own.
        NotIdentifiableError: runs that move no payload.
    """
    runs = [logs] if isinstance(logs, Log) else list(logs)
    require_plain(runs, "the fit of a payload")
    cutoff = float(model.provenance.get("cutoff_hz", CUTOFF))
    return fit_payload(
        model.torque_model,
        model.values,
        [prepare(model.robot, log).rows(cutoff) for log in runs],
        columns=model.columns,
        covariance=model.covariance,
        consistent=consistent,
    )


@one_blas_thread()
def identify_drive_gains(
    robot: Robot,
    runs: Sequence[tuple[Log, ArrayLike | None]],
    *,
    friction: str = "polynomial",
    cutoff: float = CUTOFF,
) -> DriveGains:
    """Identifies the torque per ampere of each joint, from currents under a payload that is known.

    Args:
        robot: the robot.
        runs: logs with currents, each with the payload's ten parameters about the last link's frame, or None for a run
            without: at least one with a payload, and better one without.
        friction: ``polynomial`` or ``coulomb-viscous``.
        cutoff: of the smoothing [Hz].

    Returns:
        The gains, in the units of `Robot.torque_constant`.

    Raises:
        InputError: a log without currents, or that states a payload or gravity of its own, or no payload at all.
        NotIdentifiableError: runs that leave a gain open.
    """
    require_plain([log for log, _ in runs], "the fit of drive gains")
    base = find_base_parameters(default_model(robot, friction=friction, velocity_scale=SHARP))
    found = []
    for log, payload in runs:
        if log.current is None:
            raise InputError("no currents", file=log.metadata.get("file"), allowed="i1.. [A]")
        # Only the motion and its mask are asked for: the current stands in for the torque.
        rows = prepare(robot, Log(t=log.t, q=log.q, tau=log.current, name=log.name)).rows(cutoff)
        found.append(CurrentRun(motion=rows.motion, current=rows.tau, mask=rows.mask, payload=payload))
    return fit_drive_gains(base, found)
