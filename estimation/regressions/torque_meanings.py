"""Torque columns with another meaning, converted to joint torques by the robot's description."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from estimation.logs.known_setup import robot_for_log
from estimation.logs.torque_source import KEY, parse_meaning
from estimation.preprocessing import LowPass, resample, smooth
from robots.common.arrays import Array
from robots.common.errors import AssumedValueWarning, InputError
from robots.regressor import TorqueModel
from robots.robot import Robot
from robots.signals import Log
from robots.terms import RigidBody


def as_joint_torque(robot: Robot, log: Log, meaning: str | None = None, *, estimate: bool = True) -> Log:
    """Converts a log whose torque columns mean something else.

    - ``current``: torque is the current [A] times the robot's torque constant. Where the description states none, the
      constant is estimated from its links: the torques are then as accurate as the description. For several logs, see
      `with_torque_constants`.
    - ``motor``: torque is that of the motor [N m] times the gear ratio.
    - ``without-gravity``: the described torque of gravity is added.

    Args:
        robot: with n joints.
        log: with torques, or with currents for ``current``.
        meaning: see `parse_meaning`; None for what the log's metadata state, if anything.
        estimate: whether a torque constant that the robot lacks is estimated.

    Returns:
        The log with joint torques; the same one if there is nothing to convert.

    Raises:
        InputError: another meaning, no torque column, or a description that lacks what is needed.
    """
    stated = meaning or log.metadata.get(KEY)
    if not stated:
        return log
    name, joints = parse_meaning(str(stated), robot.n)
    values = log.tau if log.tau is not None else log.current if name == "current" else None
    if values is None:
        raise InputError(f"torque_is {stated}, but the log has no torque columns", file=_file(log), column="tau1")
    if log.n != robot.n:
        raise InputError(f"{log.n} joints", file=_file(log), allowed=f"{robot.n}, as {robot.name} has")
    tau = np.array(values, dtype=float)
    if name == "current":
        known = with_torque_constants(robot, [log], meaning) if estimate else robot
        tau[:, joints] *= _torque_constants(known, log, joints)
    elif name == "motor":
        tau[:, joints] *= _gear_ratios(robot, log, joints)
    else:
        tau[:, joints] += _gravity(robot, log)[:, joints]
    kept = {key: value for key, value in log.metadata.items() if key != KEY}
    current = None if name == "current" else log.current
    return replace(log, tau=tau, current=current, metadata={**kept, "torque_was": str(stated)})


def with_torque_constants(robot: Robot, logs: Sequence[Log], meaning: str | None = None) -> Robot:
    """Estimates torque constants that the description does not state, once for all logs.

    Logs of one robot have the same constants. An estimate of each log would take a payload of one log for another
    constant.

    Args:
        robot: with n joints.
        logs: of the robot, without unknown payloads; those whose columns do not hold currents do not count.
        meaning: see `as_joint_torque`.

    Returns:
        The robot with these constants; NaN remains where the logs do not show them.

    Raises:
        InputError: a description without links, which the estimate needs.

    Warns:
        AssumedValueWarning: with the constants.
    """
    known = np.array(robot.torque_constant, dtype=float)
    wanted, used = np.zeros(robot.n, dtype=bool), []
    for log in logs:
        stated, values = meaning or log.metadata.get(KEY), log.tau if log.tau is not None else log.current
        if not stated or values is None or log.n != robot.n:
            continue
        name, joints = parse_meaning(str(stated), robot.n)
        if name == "current" and np.isnan(known[joints]).any():
            wanted[joints] = True
            used.append((log, np.asarray(values, dtype=float)))
    wanted &= np.isnan(known)
    if not wanted.any():
        return robot
    known[wanted] = _estimated_constants(robot, used)[wanted]
    if np.isfinite(known[wanted]).any():
        listed = ", ".join(
            f"{known[j]:.4g} at {robot.joint_names[j]}" for j in np.flatnonzero(wanted & ~np.isnan(known))
        )
        text = f"{robot.name}: torque constants estimated from the described links [N m/A at the joint]: {listed}"
        warnings.warn(AssumedValueWarning(text), stacklevel=2)
    return replace(robot, torque_constant=known)


def _file(log: Log) -> str | None:
    return log.metadata.get("file", log.name or None)


def _gear_ratios(robot: Robot, log: Log, joints: Sequence[int]) -> Array:
    ratios = np.asarray(robot.gear_ratio, dtype=float)[list(joints)]
    if (np.abs(ratios) == 1.0).all():
        raise InputError(
            "torque_is motor, but the robot's description states no gear ratio",
            file=_file(log),
            joint=joints[0] + 1,
            remedy="state gear_ratio under drives in the robot YAML, or `side: motor` with gear_ratio in a mapping",
        )
    return ratios


def _gravity(robot: Robot, log: Log) -> Array:
    still = np.zeros_like(log.q)
    return _described(robot, log, "without-gravity")(log.q, still, still)


def _described(robot: Robot, log: Log, meaning: str) -> Callable[[Array, Array, Array], Array]:
    if not robot.has_masses:
        raise InputError(
            f"torque_is {meaning} needs the links of the robot's description",
            file=_file(log),
            remedy="use a description with masses, or state torque_constant",
        )
    standing = robot_for_log(robot, log)
    model = TorqueModel(standing, (RigidBody(),))

    def torque(q: Array, dq: Array, ddq: Array) -> Array:
        return model.torque(q, dq, ddq, model.nominal)

    return torque


def _torque_constants(robot: Robot, log: Log, joints: Sequence[int]) -> Array:
    constants = np.asarray(robot.torque_constant, dtype=float)[list(joints)]
    if not np.isfinite(constants).all():
        raise InputError(
            "torque_is current, but the description states no torque constant, and its links do not show it",
            file=_file(log),
            joint=joints[int(np.argmin(np.isfinite(constants)))] + 1,
            remedy="state torque_constant [N m/A] in a mapping (--mapping) or in the robot YAML",
        )
    return constants


def _estimated_constants(robot: Robot, logs: Sequence[tuple[Log, Array]]) -> Array:
    """Regresses the described torque on currents, with free friction and offset (n,); NaN where it is not shown."""
    cross, square, spread, left, rows = np.zeros((5, robot.n))
    parts = [_own_part(robot, log, current) for log, current in logs]
    for x, y, rigid in parts:
        cross += np.einsum("tj,tj->j", x, y)
        square += np.einsum("tj,tj->j", x, x)
        spread += len(x) * rigid
        rows += len(x)
    factor = np.divide(cross, square, out=np.zeros(robot.n), where=square > 0)
    for x, y, _ in parts:
        left += np.sum((y - factor * x) ** 2, axis=0)
    # A fiftieth of the described torque must remain without friction.
    shown = (square > 0.02**2 * spread) & (cross != 0)
    # Fifty correlated rows count as one independent row.
    error = np.sqrt(np.divide(left / np.maximum(rows, 1) * 50.0, square, out=np.full(robot.n, np.inf), where=shown))
    with np.errstate(divide="ignore"):
        return np.where(shown & (error < 0.2 * np.abs(factor)), 1.0 / factor, np.nan)


def _own_part(robot: Robot, log: Log, current: Array) -> tuple[Array, Array, Array]:
    """Described torque and current without what friction and offset explain (N, n), and the torque's variance (n,)."""
    grid = resample(log.t, log.q)
    motion = smooth(grid, LowPass(min(6.0, 0.2 / float(np.median(np.diff(log.t))))))
    # Torque constants are estimated from so many rows.
    kept = slice(None, None, max(1, len(motion) // 20_000))
    q, dq, ddq = motion.q[kept], motion.dq[kept], motion.ddq[kept]
    i = np.column_stack([np.interp(motion.t[kept], log.t, values) for values in current.T])
    rigid = _described(robot, log, "current")(q, dq, ddq) + np.asarray(robot.rotor_inertia) * ddq
    x, y = np.zeros((2, *q.shape))
    for joint in range(robot.n):
        speed = float(np.sqrt(np.mean(dq[:, joint] ** 2)))
        if not speed > 0:
            continue
        sign = np.tanh(dq[:, joint] / (0.05 * speed))
        own = np.column_stack([sign, dq[:, joint], np.ones(len(q))])
        if not robot.rotor_inertia[joint]:
            own = np.column_stack([own, ddq[:, joint]])
        both = np.column_stack([rigid[:, joint], i[:, joint]])
        x[:, joint], y[:, joint] = (both - own @ np.linalg.lstsq(own, both, rcond=None)[0]).T
    return x, y, rigid.var(axis=0)


def as_joint_torques(
    robot: Robot, logs: Sequence[Log], meaning: str | None = None, *, without: Sequence[Log] | None = None
) -> tuple[Robot, list[Log]]:
    """Converts torque columns of another meaning to joint torques, by the robot's description.

    Args:
        robot: of the logs.
        logs: with their payloads and gravity vectors; a log without torque stays as it is.
        meaning: see `parse_meaning`; None for what the logs' metadata state.
        without: those of the logs that have no unknown payload, by which torque constants are estimated; None for all.

    Returns:
        The robot, with estimated torque constants where it needs them, and the logs.

    Raises:
        InputError: an unknown meaning, or a description that lacks what is needed.
    """
    if meaning is not None:
        parse_meaning(meaning, robot.n)
    robot = with_torque_constants(robot, logs if without is None else without, meaning)
    return robot, [
        log if log.tau is None and log.current is None else as_joint_torque(robot, log, meaning, estimate=False)
        for log in logs
    ]
