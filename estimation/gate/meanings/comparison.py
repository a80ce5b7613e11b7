"""One fit for all readings of a log: how well the torques of all joints then follow from the motion."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import minimize

from estimation.gate.quick_fits.cutoff_choice import CHOICE_ROWS
from estimation.gate.quick_fits.fitted import Fitted
from estimation.gate.quick_fits.joint_columns import OWN, SHARP
from estimation.gate.quick_fits.joint_fit import Rows
from estimation.gate.quick_fits.reading import Reading, moved, with_torques
from estimation.gate.quick_fits.rigid_body import gravity_rows
from estimation.gate.quick_fits.whole_fit import RIDGES, WholeFit, fit_all
from robots.common.arrays import Array
from robots.robot import Robot

# Rows and ridge by which most candidates are excluded before CHOICE_ROWS decide.
FEW_ROWS, RIDGE = 300, 1e-5
# First angles [rad] and most steps of the search for the direction of gravity, and its size [m/s2].
SIMPLEX, EVALUATIONS = ((0.0, 0.0), (0.15, 0.0), (0.0, 0.15)), 60
STANDARD = 9.81


def mean_log(unexplained: Array) -> float:
    """Gives the mean log of held-out errors (n,); no joint counts worse than a constant."""
    return float(np.nanmean(np.log(np.clip(unexplained, 1e-9, 1.0))))


class Comparison:
    """Held-out errors of the fit of all joints together, under readings of a log."""

    def __init__(self, fitted: Fitted) -> None:
        self.robot: Robot = fitted.robot
        self._rows, self._spread = fitted.rows, fitted.logged_spread
        self._kept: dict[tuple[object, ...], Rows] = {}

    @property
    def q(self) -> Array:
        """Positions as they were logged (M, n)."""
        return self._rows.q

    def cost(self, reading: Reading, *, few: bool = False) -> float:
        """Gives the mean log of the held-out error over the torque's standard deviation.

        Args:
            reading: of the log.
            few: on few rows with one ridge, for a first choice.
        """
        most, ridges = (FEW_ROWS, (RIDGE,)) if few else (CHOICE_ROWS, RIDGES)
        return mean_log(self._fit(reading, most, ridges).unexplained)

    def fit(self, reading: Reading) -> WholeFit:
        """Gives the held-out error of each joint, whole and in each fold."""
        return self._fit(reading, CHOICE_ROWS, RIDGES)

    def with_coupled_drives(self, axis: int, joint: int) -> WholeFit:
        """Fits the log as it was logged, with drives of two joints, counted from 0, that share rotors and seals.

        See `robots.terms.effects.joint_coupling`: it acts on the torques, and no position contains another joint.
        """
        rows = self._meant(Reading(), CHOICE_ROWS)
        found = []
        for way in (1.0, -1.0):
            sum_ = np.tanh((rows.dq[:, joint] + way * rows.dq[:, axis]) / (SHARP * (rows.speed[[axis, joint]].max())))
            none = np.zeros(len(rows.q))
            parts = {
                axis: (rows.ddq[:, joint], none, rows.dq[:, joint], way * sum_),
                joint: (rows.ddq[:, axis], rows.dq[:, axis], none, sum_),
            }
            joints = list(rows.joints)
            for place, columns in parts.items():
                joints[place] = joints[place].with_shared(np.column_stack(columns), rows.bodies)
            more = replace(rows, joints=tuple(joints), bodies=rows.bodies + len(parts[axis]))
            found.append(fit_all(more.moments(np.flatnonzero(self._spread > 0), raw=True), self._spread))
        return min(found, key=lambda fit: mean_log(fit.unexplained))

    def described_gravity(self) -> Array | None:
        """Estimates gravity (3,) [m/s2] from the described links, with free friction, offset and rotor inertia.

        None without described links.
        """
        if not self.robot.has_masses:
            return None
        described = np.asarray(self.robot.inertia, dtype=float).ravel()
        rows = self._meant(Reading(), FEW_ROWS)
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

    def refined_gravity(self, start: Array, reading: Reading) -> Array:
        """Gives the direction of gravity near a first guess (3,) with the smallest error, of standard size [m/s2].

        Args:
            start: first guess [m/s2].
            reading: of the columns.
        """
        aside = np.linalg.svd(start[None, :])[2][1:]

        def direction(angles: Array) -> Array:
            turned = start / np.linalg.norm(start) + np.tan(np.clip(angles, -1.0, 1.0)) @ aside
            return np.asarray(STANDARD * turned / np.linalg.norm(turned))

        def cost(angles: Array) -> float:
            return self.cost(replace(reading, gravity=direction(angles)), few=True)

        options: Any = {"initial_simplex": SIMPLEX, "xatol": 2e-3, "fatol": 1e-3, "maxfev": EVALUATIONS}
        found = minimize(
            cost,
            np.zeros(2),
            method="Nelder-Mead",
            options=options,
        )
        return direction(found.x)

    def _fit(self, reading: Reading, most: int, ridges: tuple[float, ...]) -> WholeFit:
        rows = self._meant(reading, most)
        # Torques of coupled axes count by the spread of the logged ones: the same numbers are compared.
        spread = self._spread if reading.tau_from is None else self._spread[reading.tau_from]
        spread = spread if reading.tau_factor is None else spread * np.abs(reading.tau_factor)
        return fit_all(rows.moments(np.flatnonzero(spread > 0), raw=True), spread, ridges)

    def _meant(self, reading: Reading, most: int) -> Rows:
        """Gives some rows as they are meant; the last ones with other positions or another gravity are kept."""
        stride = max(1, len(self._rows.q) // most)
        thin = [part.thinned(stride) for part in self._rows.excerpts]
        parts = (reading.q_from, reading.q_factor, reading.gravity, reading.coupling)
        key = (most, *(None if part is None else part.tobytes() for part in parts))
        if key not in self._kept:
            self._kept = {key: moved(self.robot, thin, reading)}
        return with_torques(self.robot, self._kept[key], thin, reading)
