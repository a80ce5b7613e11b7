"""An arm that stands against gravity with hardly any torque: its brakes are closed, or its drives are off."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimation.gate.context import Context
from estimation.gate.finding import Finding
from estimation.gate.quick_fits.fitted import Fitted
from estimation.gate.quick_fits.joint_columns import OWN
from estimation.gate.quick_fits.rigid_body import gravity_rows
from robots.common.arrays import Array
from robots.common.plain import joints_in_words, two_digits
from robots.common.stretches import joined_spans

# Share of the fitted weight that the torque at rest has at most, and of the largest torque that this weight has at
# least.
UNLOADED, HEAVY = 0.1, 0.2
# Stretches that are listed, and rows at rest that are looked at.
LISTED, ROWS = 3, 1000


def unloaded_rest(context: Context) -> list[Finding]:
    """Names the stretches in which the torque at rest is about zero, against gravity. They count in no fit."""
    fitted = context.fitted
    at = np.flatnonzero(fitted.rows.rest.any(axis=1))
    if not len(at):
        return []
    at = at[:: max(1, len(at) // ROWS)]
    static = _static_torques(fitted, at)
    tau = np.column_stack([fitted.rows.raw(j) for j in range(fitted.robot.n)])
    rest = fitted.rows.rest[at] & (np.abs(static) > HEAVY * np.abs(tau).max(axis=0)) & (static != 0)
    unloaded = rest & (np.abs(tau[at]) < UNLOADED * np.abs(static))
    joints = [j for j in range(fitted.robot.n) if unloaded[:, j].sum() > 0.5 * rest[:, j].sum() > 0]
    if not joints:
        return []
    t = np.concatenate([part.t for part in fitted.rows.excerpts]) - context.recorded.log.t[0]
    flags = np.zeros(len(t), dtype=bool)
    flags[at] = unloaded[:, joints].any(axis=1)
    gap = 2 * float(np.median(np.diff(t[at]))) if len(at) > 1 else 0.0
    times = [f"{t[a]:.3g} to {t[b - 1]:.3g} s" for a, b in joined_spans(flags, t, gap) if b - a > 1]
    where = ", ".join(times[:LISTED]) + (f" and {len(times) - LISTED} times more" if len(times) > LISTED else "")
    most = [float(np.abs(static[unloaded[:, j], j]).max()) for j in joints]
    return [
        Finding(
            name="unloaded_rest",
            severity="info",
            text=f"the torque of {joints_in_words(j + 1 for j in joints)} is about 0 while the arm stands against "
            f"gravity ({', '.join(map(two_digits, most))} N m; from {where}): the brakes are closed or the drives "
            "off",
            action="these rows are left out, as all rows at rest",
            value=max(most),
            unit="N m",
        )
    ]


def _static_torques(fitted: Fitted, at: NDArray[np.intp]) -> Array:
    """Gives the torque of gravity and offset (K, n) in rows (K,), as far as friction cannot hold it.

    It is zero for a joint without a fit.
    """
    q, robot = fitted.rows.q[at], fitted.robot
    heavy = np.einsum("jmkp,k->jmp", gravity_rows(robot, q), np.asarray(robot.chain.gravity))
    torques = np.zeros(q.shape)
    for joint, fit in enumerate(fitted.fits):
        if fit is not None:
            values = fit.values / fit.scale
            coulomb, offset = abs(values[-OWN + 1]), values[-1]
            torque = heavy[joint][:, fit.used] @ values[:-OWN] + offset
            torques[:, joint] = np.sign(torque) * np.maximum(np.abs(torque) - coulomb, 0.0)
    return torques
