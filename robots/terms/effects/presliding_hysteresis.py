"""Friction that changes sign gradually after a reversal (presliding)."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from robots.common.arrays import Array
from robots.terms.base import force_unit, length_unit
from robots.terms.effect_bases.base import Coefficient, JointEffect, Place, Shape, Situation
from robots.terms.effect_bases.capabilities import AtReversals
from robots.terms.effect_bases.states import bristle

if TYPE_CHECKING:
    from robots.robot import Robot


class PreslidingHysteresis(JointEffect):
    """tau = F (z / z_s - sign(dq)), z' = dq - |dq| z / z_s (Dahl 1968; LuGre at low speed).

    The base model's Coulomb friction jumps at each reversal. In presliding it changes sign over a travel of about z_s.
    """

    name: ClassVar[str] = "presliding_hysteresis"
    title: ClassVar[str] = "presliding hysteresis"
    needs_full_rate: ClassVar[bool] = True
    at_reversals: ClassVar[AtReversals] = AtReversals.GRADUAL
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("presliding_travel", "rad", 1e-5, 0.2, "log"),)
    rivals: ClassVar[tuple[str, ...]] = ("stribeck", "backlash", "time_delay", "current_lag", "spring")
    experiments: ClassVar[tuple[str, ...]] = ("micro_reversals", "sweep")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the part of Coulomb friction that changes sign gradually, which is not negative."""
        assert joint is not None
        return (Coefficient("presliding_torque", force_unit(robot, joint - 1), 0.0),)

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists travels, spaced by factors of about 2.5, from the samples' resolution to a tenth of the range."""
        assert joint is not None
        q = situation.q[:, joint - 1]
        reach = float(np.ptp(q))
        if reach < 1e-9:
            return ()
        # At a reversal the joint moves by half the acceleration times the squared sample period between two samples.
        step = 0.5 * float(np.quantile(np.abs(situation.ddq[:, joint - 1]), 0.5)) * situation.sampled**2
        lowest, highest = max(2.0 * step, 1e-5), min(0.1 * reach, 0.2)
        if highest <= lowest:
            return ((highest,),)
        count = max(2, 1 + round(np.log(highest / lowest) / np.log(2.5)))
        return tuple((float(value),) for value in np.geomspace(lowest, highest, count))

    def local(self, situation: Situation, joint: int, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates z / z_s - sign(dq) (N, 1)."""
        q, dq = situation.q[:, joint - 1], situation.dq[:, joint - 1]
        z = bristle(situation.t, q, dq, situation.runs, shape[0])
        return (z - situation.sign[:, joint - 1])[:, None]

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
            f"After each reversal, {coefficients[0]:.3g} {force} of the friction of joint {joint} change sign "
            f"gradually, "
            f"over a travel of {shape[0]:.3g} {length}."
        )

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Returns the travel since the last reversal."""
        assert joint is not None
        q = situation.q[:, joint - 1]
        return (
            f"travel of joint {joint} since it reversed [{length_unit(situation.robot, joint - 1)}]",
            travel_since_reversal(q, situation.runs),
        )


def travel_since_reversal(q: Array, runs: tuple[slice, ...]) -> Array:
    """Computes the signed travel (N,) since the last reversal, from a joint's positions (N,).

    Args:
        q: positions of one joint (N,) [rad or m].
        runs: the logs' rows.
    """
    travel = np.zeros(len(q))
    for run in runs:
        part = q[run]
        way = np.sign(np.diff(part, prepend=part[0]))
        turned = np.flatnonzero(way[1:] * way[:-1] < 0)
        marks = np.concatenate([[0], turned])
        travel[run] = part - part[marks[np.searchsorted(marks, np.arange(len(part)), side="right") - 1]]
    return travel
