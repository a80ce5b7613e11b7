"""A hand that guides the robot through a log: an external force on all of its motion."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from robots.terms.base import force_unit, length_unit
from robots.terms.effect_bases.base import Coefficient, Effect, Place, Shape, Situation

if TYPE_CHECKING:
    from robots.robot import Robot

Array = NDArray[np.float64]

# Fraction of the torque below which a value is rounding.
NO_WEIGHT = 1e-9
# Who moves the arm takes over this share of what its motion needs at least: less is no hand.
MOST = 0.5
# Windows in a log in which a hand is looked for, as shares of it, and the shortest [s]: what is briefer is a contact.
SHARES, SHORTEST = (1 / 2, 1 / 4, 1 / 8, 1 / 16), 2.0
# Windows that are proposed: each has four columns a joint.
PROPOSED = 3


class HandGuiding(Effect):
    """tau_j = w(t) (a_j sign(dq_j) + b_j dq_j - s_j tau_M,j - g_j tau_G,j), w one during a log.

    tau_G is the torque of gravity and tau_M the rest of the rigid body's. A hand that moves the robot takes over what
    friction and inertia need. What gravity needs stays with the drives, but for the error g of the weight that they
    compensate: that the hand feels too. The friction's columns are free of the base model's values, which such a log
    has spoilt.
    """

    name: ClassVar[str] = "hand_guiding"
    title: ClassVar[str] = "robot guided by hand (external force)"
    whole_robot: ClassVar[bool] = True
    depends_on: ClassVar[Literal["state", "time"]] = "time"
    transient: ClassVar[bool] = True
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("start", "s", -np.inf, np.inf, "linear", inexact=0.02),
        Shape("end", "s", -np.inf, np.inf, "linear", inexact=0.02),
    )
    rivals: ClassVar[tuple[str, ...]] = ("external_contact", "payload_change", "friction_step")
    experiments: ClassVar[tuple[str, ...]] = ("repeat",)

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes, joint after joint, Coulomb and viscous friction taken over, and shares of inertia and weight."""
        result: list[Coefficient] = []
        for j in range(robot.n):
            force, length = force_unit(robot, j), length_unit(robot, j)
            result += [
                Coefficient(f"coulomb_by_hand_{j + 1}", force),
                Coefficient(f"viscous_by_hand_{j + 1}", f"{force} s/{length}"),
                Coefficient(f"inertia_by_hand_{j + 1}", "1", lower=MOST),
                Coefficient(f"weight_by_hand_{j + 1}", "1"),
            ]
        return tuple(result)

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists the logs, where there are several, and windows in each; one hand on all of them is the base model's."""
        several = len(situation.starts) > 1
        logs = [(float(situation.t[run.start]), float(situation.t[run.stop - 1])) for run in situation.runs]
        inside = [window for log in logs for window in _windows(*log)]
        return (*(logs if several else ()), *inside)

    def propose(
        self, situation: Situation, joint: Place, residual: Array, count: int = 8
    ) -> tuple[tuple[float, ...], ...]:
        """Ranks windows by how much more is left in them than in most of their length, on all joints."""
        grid, count = self.grid(situation, joint), min(count, PROPOSED)
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
        """Keeps start and end within the data."""
        span = (float(situation.t[0]), float(situation.t[-1]))
        return span, span

    def columns(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates four columns per joint, each on that joint alone."""
        n = situation.robot.n
        during = (situation.t >= shape[0]) & (situation.t <= shape[1])
        weight = np.einsum("njk,nk->nj", situation.sensitivity("gravity")[during], situation.gravity[during])
        moving = situation.rigid[during] - weight
        # An axis along gravity carries no weight, but for rounding.
        weight[:, np.abs(weight).max(axis=0, initial=0.0) < NO_WEIGHT * np.abs(moving).max(initial=1e-300)] = 0.0
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
    """Lists windows in a log, each length from half of it down, every quarter of that from the one before."""
    result = []
    for share in SHARES:
        length = share * (end - start)
        if length >= SHORTEST:
            result += [(t, t + length) for t in np.arange(start, end - length + 1e-9, length / 4).tolist()]
    return result
