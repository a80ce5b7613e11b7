"""Fits of a log as it would be with another meaning: other columns, units or gravity."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from estimation.gate.quick_fits.cutoff_choice import CHOICE_ROWS
from estimation.gate.quick_fits.gravity_rows import gravity_rows
from estimation.gate.quick_fits.joint_columns import OWN
from estimation.gate.quick_fits.joint_fit import Rows
from estimation.gate.quick_fits.whole_fit import RIDGES, fit_all
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


def mean_log(unexplained: Array) -> float:
    """Gives the mean log of held-out errors (n,); no joint counts worse than a constant."""
    return float(np.nanmean(np.log(np.clip(unexplained, 1e-9, 1.0))))


class CandidateFits:
    """Held-out errors of the fit of all joints together, under other meanings of the log."""

    def __init__(self, fitted: Fitted) -> None:
        self.robot: Robot = fitted.robot
        self._rows, self._spread = fitted.rows, fitted.logged_spread
        self._kept: dict[tuple[object, ...], Rows] = {}

    def cost(self, meaning: Meaning, *, few: bool = False) -> float:
        """Gives the mean log of the held-out error over the torque's standard deviation.

        Args:
            meaning: of the log.
            few: on few rows with one ridge, for a first choice.
        """
        most, ridges = (FEW_ROWS, (RIDGE,)) if few else (CHOICE_ROWS, RIDGES)
        return mean_log(self._errors(meaning, most, ridges))

    def unexplained(self, meaning: Meaning) -> Array:
        """Gives the held-out error of each joint (n,), without rows at rest; NaN without a fit."""
        return self._errors(meaning, CHOICE_ROWS, RIDGES, moving=True)

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
            both = np.column_stack([heavy[joint], rows.raw(int(joint)) - still])
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

    def _errors(self, meaning: Meaning, most: int, ridges: tuple[float, ...], *, moving: bool = False) -> Array:
        rows = self._meant(meaning, most)
        # Torques of coupled axes count by the spread of the logged ones: the same numbers are compared.
        spread = self._spread if meaning.tau_from is None else self._spread[meaning.tau_from]
        spread = spread if meaning.tau_factor is None else spread * np.abs(meaning.tau_factor)
        moments = rows.moments(np.flatnonzero(spread > 0), raw=True, moving=moving)
        return fit_all(moments, spread, ridges).unexplained

    def _meant(self, meaning: Meaning, most: int) -> Rows:
        rows = self._moved(meaning, most)
        plain = meaning.tau_from is None and meaning.tau_factor is None
        if plain and not meaning.compensated and not meaning.coupled_torques:
            return rows
        excerpts = []
        for part in rows.excerpts:
            assert part.raw is not None
            raw = part.raw if meaning.tau_from is None else part.raw[:, meaning.tau_from]
            raw = raw if meaning.tau_factor is None else raw * meaning.tau_factor
            if meaning.coupled_torques and meaning.coupling is not None:
                raw = raw @ meaning.coupling
            excerpts.append(replace(part, raw=raw + self._weight(part.q) if meaning.compensated else raw))
        # The regressor does not depend on the torques, nor do its products.
        changed = replace(rows, excerpts=tuple(excerpts))
        changed.__dict__["_grams"] = rows._grams
        return changed

    def _weight(self, q: Array) -> Array:
        """Torque (M, n) of the described gravity at positions (M, n)."""
        described = np.asarray(self.robot.inertia, dtype=float).ravel()
        return (gravity_rows(self.robot, q) @ described @ np.asarray(self.robot.chain.gravity)).T

    def _moved(self, meaning: Meaning, most: int) -> Rows:
        """Gives the rows with other positions or another gravity; the last ones are kept."""
        parts = (meaning.q_from, meaning.q_factor, meaning.gravity, meaning.coupling)
        key = (most, *(None if part is None else part.tobytes() for part in parts))
        if key not in self._kept:
            stride = max(1, len(self._rows.q) // most)
            excerpts = []
            for part in self._rows.excerpts:
                thin = part.thinned(stride)
                changed = {}
                for name in ("q", "dq", "ddq"):
                    values = getattr(thin, name)
                    values = values if meaning.q_from is None else values[:, meaning.q_from]
                    values = values if meaning.q_factor is None else values * meaning.q_factor
                    changed[name] = values if meaning.coupling is None else values @ np.linalg.inv(meaning.coupling).T
                excerpts.append(replace(thin, **changed))
            self._kept = {key: Rows.of(self.robot, tuple(excerpts), gravity=meaning.gravity)}
        return self._kept[key]
