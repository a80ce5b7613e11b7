"""Quick fits of rigid body and friction to the excerpts of a log."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from estimation.gate.quick_fits.cutoff_choice import CHOICE_ROWS
from estimation.gate.quick_fits.delays import Delay, estimate_delays
from estimation.gate.quick_fits.joint_fit import JointFit, Rows
from estimation.gate.quick_fits.joint_physics import JointPhysics, joint_physics, mean_inertias
from estimation.gate.quick_fits.whole_fit import HOPELESS, WholeFit, fit_all
from estimation.gate.stages.cleaned import Cleaned
from estimation.gate.stages.smoothed import Smoothed
from estimation.regressions.blocks import Blocks

Array = NDArray[np.float64]


class Fitted:
    """Fits of each joint alone and of all joints together.

    Attributes:
        robot: with n joints.
        rows: that are fitted.
        logged_spread: standard deviations of the torques as logged (n,), zero for a joint that is not fitted.
    """

    def __init__(self, cleaned: Cleaned, smoothed: Smoothed, rows: Rows) -> None:
        self.robot, self.rows, self.logged_spread = cleaned.robot, rows, cleaned.spread
        self._smoothed = smoothed
        self._joints = np.flatnonzero(self.logged_spread > 0)

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
    def spread(self) -> Array:
        """Standard deviations of the smoothed torques (n,), zero for a joint that is not fitted."""
        return np.array([self.rows.torque(j).std() if self.logged_spread[j] > 0 else 0.0 for j in range(self.robot.n)])

    @cached_property
    def moments(self) -> Blocks:
        """Normal equations of the smoothed torques."""
        return self.rows.moments(self._joints)

    @cached_property
    def whole(self) -> WholeFit:
        """The fit of all joints together to the smoothed torques."""
        return fit_all(self.moments, self.spread)

    @cached_property
    def unexplained(self) -> Array:
        """Held-out error of all joints together over the torque's standard deviation (n,), NaN without a fit.

        With torques as logged: smoothing would remove the noise that hides the torque of a joint. Without rows at rest.
        """
        return fit_all(self.rows.moments(self._joints, raw=True, moving=True), self.logged_spread).unexplained

    @cached_property
    def dynamic_gain(self) -> Array:
        """Decrease of the held-out error (log) by velocities and accelerations (n,), NaN without a fit.

        On some rows only, for torques as logged, without rows at rest.
        """
        errors = []
        for static in (False, True):
            rows = Rows.of(self.robot, self.rows.excerpts, CHOICE_ROWS, static=static)
            errors.append(fit_all(rows.moments(self._joints, raw=True, moving=True), self.logged_spread).unexplained)
        dynamic, still = np.maximum(errors, 1e-9)
        return np.asarray(np.log(still / dynamic))

    @cached_property
    def sign_costs(self) -> Array:
        """Increase of the cost of `whole` with the opposite sign of each torque (n,); zero for a single joint."""
        if len(self._joints) < 2:
            return np.zeros(self.robot.n)
        signs = 1.0 - 2.0 * np.eye(self.robot.n)
        return np.array([fit_all(self.moments.scaled(sign), self.spread).cost for sign in signs]) - self.whole.cost

    @cached_property
    def delays(self) -> tuple[Delay | None, ...]:
        """Delay of each joint's torque (n), None of a joint whose torque the motion does not explain."""
        sharp = self._smoothed.choice.sharp
        assert sharp is not None
        fits = {
            j: fit if sharp is self.rows and not sharp.rest[:, j].any() else sharp.fit(j, moving=True)
            for j, fit in enumerate(self.fits)
            if fit is not None and self.unexplained[j] < HOPELESS
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
