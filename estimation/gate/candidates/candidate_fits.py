"""Fits of a log as it would be with another meaning: other columns, units or gravity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from estimation.gate.quick_fits.cutoff_choice import CHOICE_ROWS
from estimation.gate.quick_fits.excerpts import Excerpt
from estimation.gate.quick_fits.gravity_rows import gravity_rows
from estimation.gate.quick_fits.joint_columns import OWN
from estimation.gate.quick_fits.joint_fit import Rows
from estimation.gate.quick_fits.whole_fit import RIDGES, WholeFit, fit_all
from estimation.gate.stages.fitted import Fitted
from robots.robot import Robot

Array = NDArray[np.float64]

# Rows and ridge by which most candidates are excluded before CHOICE_ROWS decide.
FEW_ROWS, RIDGE = 300, 1e-5
# First angles [rad] and most steps of the search for the direction of gravity, and its size [m/s2].
SIMPLEX, EVALUATIONS = ((0.0, 0.0), (0.15, 0.0), (0.0, 0.15)), 60
STANDARD = 9.81


@dataclass(frozen=True, kw_only=True, eq=False)
class Meaning:
    """How a log may have been meant.

    Attributes:
        q_from: column of the positions of each joint (n,), counted from 0; None as logged.
        tau_from: column of the torques of each joint (n,).
        q_factor: of the positions (n,), after the columns are put in order.
        tau_factor: of the torques (n,).
        gravity: (3,) [m/s2].
        compensated: whether the controller has subtracted the gravity of the robot's description.
        coupling: readings of the axes by the joints' positions (n, n).
        coupled_torques: whether the torques are those of coupled axes, too.
    """

    q_from: NDArray[np.intp] | None = None
    tau_from: NDArray[np.intp] | None = None
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


def mean_log(unexplained: Array) -> float:
    """Gives the mean log of held-out errors (n,); no joint counts worse than a constant."""
    return float(np.nanmean(np.log(np.clip(unexplained, 1e-9, 1.0))))


def as_meant(robot: Robot, rows: Rows, meaning: Meaning) -> Rows:
    """Gives the rows of a log as they are meant."""
    moved = _moved(robot, rows.excerpts, meaning)
    return _with_torques(robot, moved, rows.excerpts, meaning)


def _moved(robot: Robot, excerpts: Sequence[Excerpt], meaning: Meaning) -> Rows:
    """Gives rows with the positions and the gravity of a meaning, and torques as logged."""
    changed = []
    for part in excerpts:
        # Meanings are compared on the same rows: those in which the logged column of a joint moves.
        rest = part.rest if meaning.q_from is None else part.rest[:, meaning.q_from]
        q, dq, ddq = (meaning.motion(values) for values in (part.q, part.dq, part.ddq))
        changed.append(replace(part, rest=rest, q=q, dq=dq, ddq=ddq))
    return Rows.of(robot, changed, gravity=meaning.gravity)


def _with_torques(robot: Robot, rows: Rows, logged: Sequence[Excerpt], meaning: Meaning) -> Rows:
    """Gives rows with the torques of a meaning."""
    changed = []
    for part, before in zip(rows.excerpts, logged, strict=True):
        assert before.raw is not None
        assert before.smoothed is not None
        raw, smoothed = meaning.torque(before.raw), meaning.torque(before.smoothed)
        if meaning.compensated:
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
    described = np.asarray(robot.inertia, dtype=float).ravel()
    return (gravity_rows(robot, q) @ described @ np.asarray(robot.chain.gravity)).T


class CandidateFits:
    """Held-out errors of the fit of all joints together, under other meanings of the log."""

    def __init__(self, fitted: Fitted) -> None:
        self.robot: Robot = fitted.robot
        self._rows, self._spread = fitted.rows, fitted.logged_spread
        self._kept: dict[tuple[object, ...], Rows] = {}

    @property
    def travel(self) -> Array:
        """Range of each joint's position (n,)."""
        return np.asarray(np.ptp(self._rows.q, axis=0))

    def cost(self, meaning: Meaning, *, few: bool = False) -> float:
        """Gives the mean log of the held-out error over the torque's standard deviation.

        Args:
            meaning: of the log.
            few: on few rows with one ridge, for a first choice.
        """
        most, ridges = (FEW_ROWS, (RIDGE,)) if few else (CHOICE_ROWS, RIDGES)
        return mean_log(self._fit(meaning, most, ridges).unexplained)

    def fit(self, meaning: Meaning) -> WholeFit:
        """Gives the held-out error of each joint, whole and in each fold."""
        return self._fit(meaning, CHOICE_ROWS, RIDGES)

    def described_gravity(self) -> Array | None:
        """Estimates gravity (3,) [m/s2] from the described links, with free friction, offset and rotor inertia.

        None without described links.
        """
        if not self.robot.has_masses:
            return None
        described = np.asarray(self.robot.inertia, dtype=float).ravel()
        rows = self._meant(Meaning(), FEW_ROWS)
        heavy = gravity_rows(self.robot, rows.q) @ described
        normal, right = np.zeros((3, 3)), np.zeros(3)
        for joint in np.flatnonzero(self._spread > 0):
            columns = rows.joints[joint]
            own = columns.Y[:, -OWN:]
            whole = columns.Y[:, :-OWN] @ (columns.scale[:-OWN] * described[columns.used])
            still = whole - heavy[joint] @ np.asarray(self.robot.chain.gravity)
            both = np.column_stack([heavy[joint], rows.raw(int(joint)) - still])[~rows.rest[:, joint]]
            own = own[~rows.rest[:, joint]]
            both = (both - own @ np.linalg.lstsq(own, both, rcond=None)[0]) / self._spread[joint]
            normal += both[:, :3].T @ both[:, :3]
            right += both[:, :3].T @ both[:, 3]
        return np.asarray(np.linalg.lstsq(normal, right, rcond=1e-4)[0])

    def refined_gravity(self, start: Array) -> Array:
        """Gives the direction of gravity near a first guess (3,) with the smallest error, of standard size [m/s2]."""
        aside = np.linalg.svd(start[None, :])[2][1:]

        def direction(angles: Array) -> Array:
            turned = start / np.linalg.norm(start) + np.tan(np.clip(angles, -1.0, 1.0)) @ aside
            return np.asarray(STANDARD * turned / np.linalg.norm(turned))

        def cost(angles: Array) -> float:
            return self.cost(Meaning(gravity=direction(angles)), few=True)

        options: Any = {"initial_simplex": SIMPLEX, "xatol": 2e-3, "fatol": 1e-3, "maxfev": EVALUATIONS}
        found = minimize(
            cost,
            np.zeros(2),
            method="Nelder-Mead",
            options=options,
        )
        return direction(found.x)

    def _fit(self, meaning: Meaning, most: int, ridges: tuple[float, ...]) -> WholeFit:
        rows = self._meant(meaning, most)
        # Torques of coupled axes count by the spread of the logged ones: the same numbers are compared.
        spread = self._spread if meaning.tau_from is None else self._spread[meaning.tau_from]
        spread = spread if meaning.tau_factor is None else spread * np.abs(meaning.tau_factor)
        return fit_all(rows.moments(np.flatnonzero(spread > 0), raw=True), spread, ridges)

    def _meant(self, meaning: Meaning, most: int) -> Rows:
        """Gives some rows as they are meant; the last ones with other positions or another gravity are kept."""
        stride = max(1, len(self._rows.q) // most)
        thin = [part.thinned(stride) for part in self._rows.excerpts]
        parts = (meaning.q_from, meaning.q_factor, meaning.gravity, meaning.coupling)
        key = (most, *(None if part is None else part.tobytes() for part in parts))
        if key not in self._kept:
            self._kept = {key: _moved(self.robot, thin, meaning)}
        return _with_torques(self.robot, self._kept[key], thin, meaning)
