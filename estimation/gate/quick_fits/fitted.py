"""Quick fits of rigid body and friction to the excerpts of a log."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from estimation.gate.quick_fits.cutoff_choice import CHOICE_ROWS, Smoothed
from estimation.gate.quick_fits.delays import Delay, estimate_delays
from estimation.gate.quick_fits.joint_fit import JointFit, Rows
from estimation.gate.quick_fits.joint_physics import JointPhysics, joint_physics, mean_inertias
from estimation.gate.quick_fits.reading import Reading, as_read
from estimation.gate.quick_fits.whole_fit import LIKE_A_CONSTANT, fit_all
from estimation.recordings.rows.row_flags import Cleaned
from robots.common.arrays import Array


class Fitted:
    """Fits of each joint alone and of all joints together.

    Attributes:
        robot: with n joints.
        rows: that are fitted.
        sharp: the same with a higher cut-off, for delays.
        logged_spread: standard deviations of the torques as logged while the joints move (n,), zero for a joint that is
            not fitted.
    """

    def __init__(self, cleaned: Cleaned, smoothed: Smoothed, rows: Rows, sharp: Rows) -> None:
        self.robot, self.rows, self.sharp = cleaned.robot, rows, sharp
        self._cleaned, self._smoothed = cleaned, smoothed
        self._joints = np.flatnonzero(cleaned.spread > 0)
        self.logged_spread = np.zeros(self.robot.n)
        self.logged_spread[self._joints] = [rows.spread(j, raw=True) for j in self._joints.tolist()]

    def read_as(self, reading: Reading) -> Fitted:
        """Gives quick fits of these excerpts under a reading."""
        rows = as_read(self.robot, self.rows, reading)
        sharp = rows if self.sharp is self.rows else as_read(self.robot, self.sharp, reading)
        return Fitted(self._cleaned, self._smoothed, rows, sharp)

    @cached_property
    def fits(self) -> tuple[JointFit | None, ...]:
        """The fit of each joint alone (n)."""
        return tuple(self.rows.fit(j) if self.logged_spread[j] > 0 else None for j in range(self.robot.n))

    @cached_property
    def physics(self) -> tuple[JointPhysics | None, ...]:
        """Inertia and friction of each joint, from these fits (n)."""
        inertias = mean_inertias(self.robot, self.rows)
        return tuple(
            None if fit is None else joint_physics(self.rows, fit, j, inertias[j]) for j, fit in enumerate(self.fits)
        )

    @cached_property
    def unexplained(self) -> Array:
        """Held-out error of all joints together over the torque's standard deviation (n,), NaN without a fit.

        With torques as logged: smoothing would remove the noise that hides the torque of a joint.
        """
        return fit_all(self.rows.moments(self._joints, raw=True), self.logged_spread).unexplained

    @cached_property
    def dynamic_gain(self) -> Array:
        """Decrease of the held-out error (log) by velocities and accelerations (n,), NaN without a fit.

        On some rows only, for torques as logged.
        """
        errors = []
        for static in (False, True):
            rows = Rows.of(self.robot, self.rows.excerpts, CHOICE_ROWS, static=static)
            errors.append(fit_all(rows.moments(self._joints, raw=True), self.logged_spread).unexplained)
        dynamic, still = np.maximum(errors, 1e-9)
        return np.asarray(np.log(still / dynamic))

    @cached_property
    def delays(self) -> tuple[Delay | None, ...]:
        """Delay of each joint's torque (n), None of a joint whose torque the motion does not explain."""
        sharp = self.sharp
        fits = {
            j: sharp.fit(j)
            for j, fit in enumerate(self.fits)
            if fit is not None and self.unexplained[j] < LIKE_A_CONSTANT
        }
        period, cutoff = self._smoothed.period, self._smoothed.choice.sharp_cutoff
        return tuple(estimate_delays(sharp, fits, period, cutoff, self.unexplained))

    @property
    def delay_values(self) -> Array:
        """Delays (n,) [s], NaN of a joint without a standard error."""
        return np.array([d.value if d is not None and np.isfinite(d.error) else np.nan for d in self.delays])

    @property
    def delay_errors(self) -> Array:
        """Their standard errors (n,) [s], NaN without."""
        return np.array([d.error if d is not None and np.isfinite(d.error) else np.nan for d in self.delays])

    @property
    def information(self) -> Array:
        """Significance of each joint's inertia or friction, the larger of both (n,); NaN without a fit."""
        return np.array([np.nan if found is None else found.information for found in self.physics])
