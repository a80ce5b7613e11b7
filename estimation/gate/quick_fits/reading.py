"""One way to read the columns of a log, and the mapping that states it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimation.gate.quick_fits.excerpts import Excerpt
from estimation.gate.quick_fits.joint_fit import Rows
from estimation.gate.quick_fits.rigid_body import joint_rows, rigid_body, used_columns
from robots.common.arrays import Array
from robots.robot import Robot

Places = NDArray[np.intp]


@dataclass(frozen=True, kw_only=True, eq=False)
class Reading:
    """How the columns of a log become joint positions and torques; by default as they were logged.

    Attributes:
        q_from: column of the positions of each joint (n,), counted from 0.
        tau_from: column of the torques of each joint (n,).
        q_factor: of the positions (n,), after the columns are put in order.
        tau_factor: of the torques (n,).
        gravity: (3,) [m/s2].
        compensated: whether the controller has subtracted the gravity of the robot's description.
        coupling: readings of the axes by the joints' positions (n, n).
        coupled_torques: whether the torques are those of coupled axes, too.
    """

    q_from: Places | None = None
    tau_from: Places | None = None
    q_factor: Array | None = None
    tau_factor: Array | None = None
    gravity: Array | None = None
    compensated: bool = False
    coupling: Array | None = None
    coupled_torques: bool = False

    def motion(self, values: Array) -> Array:
        """Gives positions, velocities or accelerations (M, n) of the joints from the logged ones."""
        values = values if self.q_from is None else values[:, self.q_from]
        values = values if self.q_factor is None else values * self.q_factor
        return values if self.coupling is None else values @ np.linalg.inv(self.coupling).T

    def torque(self, values: Array) -> Array:
        """Gives torques (M, n) of the joints from the logged ones, without those that a controller subtracted."""
        values = values if self.tau_from is None else values[:, self.tau_from]
        values = values if self.tau_factor is None else values * self.tau_factor
        return values @ self.coupling if self.coupled_torques and self.coupling is not None else values

    def then(self, change: Reading) -> Reading:
        """Gives the reading that applies this one, and then a change to what it gives.

        Args:
            change: of columns, factors or axes only where this reading has no coupled axes.
        """
        q_from, q_factor = _chained(self.q_from, self.q_factor, change.q_from, change.q_factor)
        tau_from, tau_factor = _chained(self.tau_from, self.tau_factor, change.tau_from, change.tau_factor)
        return Reading(
            q_from=q_from,
            tau_from=tau_from,
            q_factor=q_factor,
            tau_factor=tau_factor,
            gravity=self.gravity if change.gravity is None else change.gravity,
            compensated=self.compensated or change.compensated,
            coupling=self.coupling if change.coupling is None else change.coupling,
            coupled_torques=self.coupled_torques or change.coupled_torques,
        )

    def moved(self, n: int) -> Places:
        """Lists the joints, counted from 0, whose columns are read otherwise than logged; all under another gravity."""
        if self.gravity is not None or self.compensated:
            return np.arange(n)
        straight, one, none = np.arange(n), np.ones(n), np.zeros(n, dtype=bool)
        touched = none if self.coupling is None else (self.coupling != np.eye(n)).any(axis=1)
        for source, factor in ((self.q_from, self.q_factor), (self.tau_from, self.tau_factor)):
            touched = touched | (straight != (straight if source is None else source))
            touched = touched | (one != (one if factor is None else factor))
        return np.flatnonzero(touched)

    def mapping(self, prefix: str) -> list[str]:
        """Writes what a mapping file states for this reading, a key a line.

        Args:
            prefix: of the log's torques or currents, ``tau`` or ``i``.
        """
        lines = []
        signal = "torque" if prefix == "tau" else "current"
        for key, column, source, factor in (
            ("position", "q", self.q_from, self.q_factor),
            (signal, prefix, self.tau_from, self.tau_factor),
        ):
            stated = []
            if source is not None and (source != np.arange(len(source))).any():
                stated.append(f"columns: [{', '.join(f'{column}{k + 1}' for k in source)}]")
            if factor is not None and (factor < 0).any():
                stated.append(f"sign: [{', '.join('-1' if value < 0 else '1' for value in factor)}]")
            if factor is not None and (np.abs(factor) != 1).any():
                stated.append(f"scale: [{', '.join(f'{value:.5g}' for value in np.abs(factor))}]")
            if stated:
                lines.append(f"{key}: {{{', '.join(stated)}}}")
        if self.coupling is not None:
            axes = []
            for axis, row in enumerate(self.coupling):
                others = [f"{k + 1}: {factor:.3g}" for k, factor in enumerate(row) if k != axis and factor]
                axes += [f"{axis + 1}: {{{', '.join(others)}}}"] if others else []
            lines.append(f"coupling: {{{', '.join(axes)}}}")
            lines += ["coupled_torques: true"] if self.coupled_torques else []
        if self.compensated or (self.gravity is not None and not self.gravity.any()):
            lines.append("torque_is: without-gravity")
        return lines


def exchanged(n: int, pair: tuple[int, int], *, q: bool, tau: bool) -> Reading:
    """Gives the reading that exchanges two joints, counted from 0, in the columns of positions, of torques or both."""
    order = np.arange(n)
    order[list(pair)] = pair[::-1]
    return Reading(q_from=order if q else None, tau_from=order if tau else None)


def scaled(n: int, joint: int, *, q: float = 1.0, tau: float = 1.0) -> Reading:
    """Gives the reading that multiplies position and torque of one joint, counted from 0."""
    factors = [None if value == 1.0 else np.where(np.arange(n) == joint, value, 1.0) for value in (q, tau)]
    return Reading(q_factor=factors[0], tau_factor=factors[1])


def coupled(n: int, place: tuple[int, int], factor: float, *, torques: bool) -> Reading:
    """Gives the reading in which an axis counts a share of another joint; both are counted from 0."""
    coupling = np.eye(n)
    coupling[place] = factor
    return Reading(coupling=coupling, coupled_torques=torques)


def _chained(
    first_from: Places | None, first: Array | None, then_from: Places | None, then: Array | None
) -> tuple[Places | None, Array | None]:
    """Applies an order and factors after another order and its factors."""
    source = first_from if then_from is None else then_from if first_from is None else first_from[then_from]
    factor = first if first is None or then_from is None else first[then_from]
    return source, then if factor is None else factor if then is None else factor * then


def as_read(robot: Robot, rows: Rows, reading: Reading) -> Rows:
    """Gives the rows of a log as they are read."""
    other = moved(robot, rows.excerpts, reading)
    return with_torques(robot, other, rows.excerpts, reading)


def moved(robot: Robot, excerpts: Sequence[Excerpt], reading: Reading) -> Rows:
    """Gives rows with the positions and the gravity of a reading, and torques as logged."""
    changed = []
    for part in excerpts:
        # Readings are compared on the same rows: those in which the logged column of a joint moves.
        rest = part.rest if reading.q_from is None else part.rest[:, reading.q_from]
        q, dq, ddq = (reading.motion(values) for values in (part.q, part.dq, part.ddq))
        changed.append(replace(part, rest=rest, q=q, dq=dq, ddq=ddq))
    return Rows.of(robot, changed, gravity=reading.gravity)


def with_torques(robot: Robot, rows: Rows, logged: Sequence[Excerpt], reading: Reading) -> Rows:
    """Gives rows with the torques of a reading."""
    changed = []
    for part, before in zip(rows.excerpts, logged, strict=True):
        assert before.raw is not None
        assert before.smoothed is not None
        raw, smoothed = reading.torque(before.raw), reading.torque(before.smoothed)
        if reading.compensated:
            weight = _weight(robot, part.q)
            raw = raw + weight
            smoothed = smoothed + np.column_stack([np.interp(part.grid, part.t, own) for own in weight.T])
        changed.append(replace(part, raw=raw, smoothed=smoothed))
    # The regressor does not depend on the torques, nor do its products.
    found = replace(rows, excerpts=tuple(changed))
    found.__dict__["_grams"] = rows._grams
    return found


def _weight(robot: Robot, q: Array) -> Array:
    """Torque (M, n) of the described gravity at positions (M, n)."""
    described, still = rigid_body(robot).nominal, np.zeros_like(q)
    parts = zip(joint_rows(robot, q, still, still), used_columns(robot), strict=True)
    return np.column_stack([columns @ described[used] for columns, used in parts])
