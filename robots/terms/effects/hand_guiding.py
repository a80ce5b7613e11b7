"""Hand guiding: an external force that causes the robot's motion."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from robots.common.arrays import Array
from robots.terms.base import force_unit, length_unit
from robots.terms.effect_bases.base import Coefficient, Effect, Place, Shape, Situation
from robots.terms.effect_bases.capabilities import Persistence

if TYPE_CHECKING:
    from robots.robot import Robot


# Durations of scanned windows, as fractions of a log.
SHARES = (1 / 2, 1 / 4, 1 / 8, 1 / 16)


class HandGuiding(Effect):
    """tau_j = w(t) (a_j sign(dq_j) + b_j dq_j - s_j tau_M,j - g_j tau_G,j), w one from start to end.

    tau_G is the gravity torque and tau_M the rest of the rigid-body torque. A hand that moves the robot takes over the
    torque for friction and inertia. The drives compensate gravity up to a relative error g, which the hand carries as
    well. The friction columns do not use the base model's friction, because such a log biases it.
    """

    name: ClassVar[str] = "hand_guiding"
    title: ClassVar[str] = "robot guided by hand (external force)"
    whole_robot: ClassVar[bool] = True
    persistence: ClassVar[Persistence] = Persistence.TRANSIENT
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("start", "s", -np.inf, np.inf, "linear", inexact=0.02),
        Shape("end", "s", -np.inf, np.inf, "linear", inexact=0.02),
    )
    rivals: ClassVar[tuple[str, ...]] = ("external_contact", "payload_change", "friction_step")
    experiments: ClassVar[tuple[str, ...]] = ("repeat",)

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes per joint the Coulomb and viscous friction, and the fractions of inertia and weight, taken over."""
        result: list[Coefficient] = []
        for j in range(robot.n):
            force, length = force_unit(robot, j), length_unit(robot, j)
            # Least fraction of the inertial torque that a guiding hand takes over.
            result += [
                Coefficient(f"coulomb_by_hand_{j + 1}", force),
                Coefficient(f"viscous_by_hand_{j + 1}", f"{force} s/{length}"),
                Coefficient(f"inertia_by_hand_{j + 1}", "1", lower=0.5),
                Coefficient(f"weight_by_hand_{j + 1}", "1"),
            ]
        return tuple(result)

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists windows in each log, and whole logs if there are several.

        Guiding over all data is not listed, because the base model's fit absorbs it.
        """
        several = len(situation.starts) > 1
        logs = [(float(situation.t[run.start]), float(situation.t[run.stop - 1])) for run in situation.runs]
        inside = [window for log in logs for window in _windows(*log)]
        return (*(logs if several else ()), *inside)

    def propose(
        self, situation: Situation, joint: Place, residual: Array, count: int = 8
    ) -> tuple[tuple[float, ...], ...]:
        """Ranks windows by the residual's mean square, relative to the median over all windows, summed over joints."""
        # Number of windows proposed for the scan; it is small because each has four columns per joint.
        grid, count = self.grid(situation, joint), min(count, 3)
        if len(grid) <= count:
            return grid
        sums = np.concatenate([np.zeros((1, residual.shape[1])), np.cumsum(residual**2, axis=0)])
        starts, ends = np.array(grid).T
        first, last = np.searchsorted(situation.t, starts), np.searchsorted(situation.t, ends, side="right")
        rows = np.maximum(last - first, 1)[:, None]
        powers = (sums[last] - sums[first]) / rows
        usual = np.maximum(np.median(powers, axis=0), 1e-300)
        scores = np.sum((powers / usual - 1.0) * np.sqrt(rows), axis=1)
        return tuple(grid[i] for i in np.argsort(-scores)[:count])

    def bounds(self, situation: Situation, joint: Place) -> tuple[tuple[float, float], ...]:
        """Bounds start and end to the data."""
        span = (float(situation.t[0]), float(situation.t[-1]))
        return span, span

    def columns(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates four columns per joint, each on that joint alone (N, n, 4 n)."""
        n = situation.robot.n
        during = (situation.t >= shape[0]) & (situation.t <= shape[1])
        weight = np.einsum("njk,nk->nj", situation.sensitivity("gravity")[during], situation.gravity[during])
        moving = situation.rigid[during] - weight
        # An axis along gravity carries no weight up to rounding.
        # Fraction of the torque below which the weight of a joint is rounding.
        weight[:, np.abs(weight).max(axis=0, initial=0.0) < 1e-9 * np.abs(moving).max(initial=1e-300)] = 0.0
        X = np.zeros((len(situation), n, n, 4))
        for j in range(n):
            X[during, j, j, 0] = situation.sign[during, j]
            X[during, j, j, 1] = situation.dq[during, j]
            X[during, j, j, 2] = -moving[:, j]
            X[during, j, j, 3] = -weight[:, j]
        return X.reshape(len(situation), n, 4 * n)

    def describe(
        self,
        joint: Place,
        coefficients: Array,
        shape: tuple[float, ...] = (),
        *,
        force: str = "N m",
        length: str = "rad",
    ) -> str:
        """Describes the values in one sentence."""
        return (
            f"An external force, such as a hand, moved the robot from t = {shape[0]:.2f} s to {shape[1]:.2f} s. The "
            f"drives "
            "carried its weight, but not its friction and inertia."
        )


def _windows(start: float, end: float) -> list[tuple[float, float]]:
    """Lists windows (start, end) [s] in a log, of several lengths, with starts a quarter of a length apart."""
    result = []
    for share in SHARES:
        length = share * (end - start)
        # A shorter event [s] is a contact.
        if length >= 2.0:
            result += [(t, t + length) for t in np.arange(start, end - length + 1e-9, length / 4).tolist()]
    return result
