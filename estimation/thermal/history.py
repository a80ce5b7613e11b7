"""How warm a robot is when a motion begins: by what it did before."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimation.logs.known_setup import HEAT, require_plain
from estimation.preprocessing import resample, smooth
from estimation.thermal.torque import ThermalTorqueModel
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.signals import Log


def start_temperatures(
    model: ThermalTorqueModel, before: Sequence[Log], until: float, *, ambient: float | None = None
) -> list[Array | None]:
    """Follows the joints through earlier logs, and rests between them, up to a time.

    The first log begins at ambient temperature.

    Args:
        model: torque model with thermal models.
        before: logs of what the robot did, on one clock; their torques are not used.
        until: when the motion of interest begins [s].
        ambient: ambient temperature where logs do not state it [degC]; that of each model by default.

    Returns:
        Temperatures of each joint's zones (n,) [degC]; None for a joint whose friction does not change.

    Raises:
        InputError: logs of another robot, that state a payload or gravity, overlap each other or go on past `until`.
    """
    state: list[Array | None] = [None] * model.model.robot.n
    cutoff, now = model.model.cutoff, None
    require_plain(before, HEAT)
    for log in sorted(before, key=lambda log: float(log.t[0])):
        motion = smooth(resample(log.t, log.q), cutoff)
        around = surroundings(log, motion.t, ambient)
        if now is not None:
            state = _rest(model, state, float(motion.t[0]) - now, around, log)
        _, paths = model.simulate(motion, ambient=around, start=state)
        state = [None if path is None else path.temperatures[-1] for path in paths]
        now = float(motion.t[-1])
    return state if now is None else _rest(model, state, until - now, ambient, None)


def surroundings(log: Log, t: Array, ambient: float | None) -> Array | float | None:
    """Temperature of the surroundings at times (N,): as logged, else as given [degC]."""
    seen = None if log.ambient is None else np.isfinite(log.ambient)
    if log.ambient is None or seen is None or not seen.any():
        return ambient
    return np.interp(t, log.t[seen], log.ambient[seen])


def _rest(
    model: ThermalTorqueModel, state: list[Array | None], time: float, around: Array | float | None, log: Log | None
) -> list[Array | None]:
    if time < -1e-9:
        raise InputError(
            "logs that overlap in time",
            file=None if log is None else log.metadata.get("file"),
            allowed="logs on one clock, each ending before the next begins",
        )
    first = None if around is None else float(np.ravel(around)[0])
    return [
        None
        if thermal is None or zones is None
        else thermal.temperatures([0.0], [max(time, 0.0)], start=zones, ambient=first)[-1]
        for thermal, zones in zip(model.thermal, state, strict=True)
    ]
