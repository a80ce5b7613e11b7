"""Torques in another unit, which do not fit one robot."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from estimation.gate.check import Check
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding
from estimation.gate.quick_fits.whole_fit import fit_all

Array = NDArray[np.float64]

# Decrease of the held-out error (mean log) in another unit, from which it is reported; twice this is certain.
BETTER = 0.1
# Spread of a unit's factors over their largest, below which the joints agree equally well in both units.
SIMILAR = 0.2


class TorqueUnits(Check):
    """Finds torques that do not agree on the links that the joints share, but do in another unit."""

    name: ClassVar[str] = "torque_units"
    stage: ClassVar[Stage] = Stage.FITTED
    order: ClassVar[int] = 30

    def run(self, context: Context) -> list[Finding]:
        """Fits all joints together in other units."""
        if context.cleaned.columns.prefix != "tau":
            return []
        robot, fitted = context.robot, context.fitted
        limits, gears = np.asarray(robot.limits.torque), np.abs(np.asarray(robot.gear_ratio))
        candidates = {"in percent of the rated torque": limits / 100.0, "the motor's, not the joint's": gears}
        now = _log_error(fitted.whole.unexplained)
        findings = []
        for words, factor in candidates.items():
            if not np.isfinite(factor).all() or np.ptp(factor) <= SIMILAR * factor.max() or (factor <= 0).any():
                continue
            scaled = fit_all(fitted.moments.scaled(factor), fitted.spread * factor)
            better = now - _log_error(scaled.unexplained)
            if better > BETTER:
                findings.append(
                    Finding(
                        name="unit_of_torque",
                        severity="refuse" if better > 2 * BETTER else "warning",
                        text="the torques of the joints do not fit one robot: errors would be "
                        f"{100 * (1 - np.exp(-better)):.3g} % smaller if the torques were {words}",
                        action="set the unit of tau in a mapping (--mapping)",
                        value=better,
                    )
                )
        return findings


def _log_error(unexplained: Array) -> float:
    return float(np.nanmean(np.log(np.clip(unexplained, 1e-9, 1.0))))
