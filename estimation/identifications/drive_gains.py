"""The verb: identifies the drives' gains from currents with and without a known payload."""

from __future__ import annotations

from collections.abc import Sequence

from numpy.typing import ArrayLike

from estimation.estimators.drive_gains import CurrentRun, DriveGains, fit_drive_gains
from estimation.logs.known_setup import require_plain
from estimation.regressions.preparation import prepare
from robots.base_parameters import find_base_parameters
from robots.common.errors import InputError
from robots.common.parallel import one_blas_thread
from robots.regressor import default_model
from robots.robot import Robot
from robots.signals import Log


@one_blas_thread()
def identify_drive_gains(
    robot: Robot,
    runs: Sequence[tuple[Log, ArrayLike | None]],
    *,
    friction: str = "polynomial",
    cutoff: float = 5.0,
) -> DriveGains:
    """Identifies the torque per ampere of each joint, from currents under a known payload (Gautier and Briot 2014).

    Args:
        robot: the robot.
        runs: logs with currents, each with the payload's parameters (10,) about the last link's frame, or None for a
            run without: at least one with a payload, and better one without.
        friction: ``polynomial`` or ``coulomb-viscous``.
        cutoff: of the smoothing [Hz].

    Returns:
        The gains, in the units of `Robot.torque_constant`.

    Raises:
        InputError: a log without currents, or that states a payload or gravity of its own, or no payload at all.
        NotIdentifiableError: runs that leave a gain open.
    """
    require_plain([log for log, _ in runs], "the fit of drive gains")
    # Coulomb friction fades below this speed [rad/s or m/s].
    base = find_base_parameters(default_model(robot, friction=friction, velocity_scale=1e-3))
    found = []
    for log, payload in runs:
        if log.current is None:
            raise InputError("no currents", file=log.metadata.get("file"), allowed="i1.. [A]")
        # Only the motion and its mask are asked for: the current stands in for the torque.
        rows = prepare(robot, Log(t=log.t, q=log.q, tau=log.current, name=log.name)).rows(cutoff)
        found.append(CurrentRun(motion=rows.motion, current=rows.tau, mask=rows.mask, payload=payload))
    return fit_drive_gains(base, found)
