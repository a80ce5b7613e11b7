"""A joint that turns in the opposite direction to the robot's description."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from estimation.gate.check import Check
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding
from estimation.gate.quick_fits.cutoff_choice import CHOICE_ROWS
from estimation.gate.quick_fits.joint_fit import Rows
from estimation.gate.quick_fits.whole_fit import RIDGES, fit_all
from estimation.gate.stages.fitted import Fitted
from estimation.regressions.blocks import Blocks
from robots.robot import Robot

Array = NDArray[np.float64]

# Held-out error over the torque's standard deviation (geometric mean of the joints), below which directions are right.
WELL = 0.1
# Decrease of the held-out error (mean log) with the opposite sign of a joint, for a warning and for a refusal.
BETTER, CERTAIN = 0.2, 0.5
# Rows and ridge by which most joints are excluded before CHOICE_ROWS decide: by less than half of `BETTER`.
FEW_ROWS, RIDGE = 500, 1e-5
# Findings that make the fits too wrong to judge directions by them.
WRONG_TORQUES = ("torque_sign", "negative_friction", "moved_by_others", "unit_of_torque")


class JointDirections(Check):
    """Inverts one joint at a time, with and without its torque, and looks whether the torques are explained better."""

    name: ClassVar[str] = "joint_directions"
    stage: ClassVar[Stage] = Stage.FITTED
    order: ClassVar[int] = 40

    def run(self, context: Context) -> list[Finding]:
        """Reports the joint whose inversion decreases the error most."""
        if context.found(WRONG_TORQUES):
            return []
        before = context.smoothed.choice.cost
        if before < np.log(WELL):
            return []
        fits = _InvertedFits(context.fitted)
        straight = np.ones(context.robot.n)
        enough = fits.cost(fits.moments(straight, FEW_ROWS), (RIDGE,)) - BETTER / 2
        best, found = before - BETTER, None
        for joint in range(context.robot.n):
            sign = np.ones(context.robot.n)
            sign[joint] = -1.0
            few = fits.moments(sign, FEW_ROWS)
            if min(fits.cost(few.scaled(torque_sign), (RIDGE,)) for torque_sign in (straight, sign)) > enough:
                continue
            inverted = fits.moments(sign, CHOICE_ROWS)
            for torque_sign in (straight, sign):
                after = fits.cost(inverted.scaled(torque_sign))
                if after < best:
                    best, found = after, (joint, bool(torque_sign[joint] < 0))
        return [] if found is None else [_finding(context.robot, *found, before - best)]


class _InvertedFits:
    """Fits of all joints with inverted positions."""

    def __init__(self, fitted: Fitted) -> None:
        self._robot, self._rows, self._spread = fitted.robot, fitted.rows, fitted.logged_spread
        self._joints = np.flatnonzero(self._spread > 0)

    def moments(self, sign: Array, most: int) -> Blocks:
        """Gives the normal equations on some rows, positions times a sign (n,)."""
        thin = (part.thinned(max(1, len(self._rows.q) // most)) for part in self._rows.excerpts)
        inverted = (replace(part, q=part.q * sign, dq=part.dq * sign, ddq=part.ddq * sign) for part in thin)
        return Rows.of(self._robot, tuple(inverted)).moments(self._joints, raw=True)

    def cost(self, moments: Blocks, ridges: Sequence[float] = RIDGES) -> float:
        """Gives the mean log of the held-out error."""
        unexplained = fit_all(moments, self._spread, ridges).unexplained[self._joints]
        return float(np.mean(np.log(np.clip(unexplained, 1e-9, 1.0))))


def _finding(robot: Robot, joint: int, with_torque: bool, better: float) -> Finding:
    smaller = 100 * float(1 - np.exp(-better))
    return Finding(
        name="position_sign",
        severity="refuse" if better > CERTAIN else "warning",
        text=f"{robot.joint_names[joint]} seems to turn opposite to the robot's description: with opposite sign of its "
        f"position{' and torque' if with_torque else ''} errors are {smaller:.3g} % smaller",
        action="set `sign: -1` for it in a mapping (--mapping), or correct the description",
        value=smaller,
        unit="%",
        column=f"q{joint + 1}",
        joint=joint + 1,
    )
