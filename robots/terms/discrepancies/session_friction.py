"""Friction of all joints that differs between sessions, because gears are warmer or colder, or grease is new."""

from __future__ import annotations

from itertools import pairwise
from typing import ClassVar

import numpy as np

from robots.common.arrays import Array
from robots.common.plain import percent
from robots.robot import Robot
from robots.signals import UNKNOWN_PAUSE
from robots.terms.discrepancies.gain_drift import OverTime
from robots.terms.effects import Coefficient, Situation

MOST_SESSIONS = 6
"""Largest number of separate sessions; if there are more, consecutive ones are grouped."""


class SessionFriction(OverTime):
    """tau_j = s_jk f_j in the session k, f_j the base model's friction, which describes the first session.

    Each joint has its own factor in each session. A change of one joint at one time is `friction_step`.
    """

    name: ClassVar[str] = "pattern:daily:0:odd"
    title: ClassVar[str] = "friction that differs between logs"

    def joints(self, robot: Robot) -> tuple[int | None, ...]:
        """Returns the whole robot, for any number of joints."""
        return (None,)

    def parameters(self, robot: Robot, joint: int | None) -> tuple[Coefficient, ...]:
        """Describes the relative change of friction in each session after the first, per joint."""
        return tuple(
            Coefficient(f"share_{k}_of_joint_{j}", "1", -1.0, 10.0)
            for k in range(2, MOST_SESSIONS + 1)
            for j in range(1, robot.n + 1)
        )

    def grid(self, situation: Situation, joint: int | None) -> tuple[tuple[float, ...], ...]:
        """Lists the one form without shape parameters; empty if there is only one session."""
        return ((),) if len(_sessions(situation)) > 1 else ()

    def columns(self, situation: Situation, joint: int | None, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the base model's friction in each session after the first (N, n, (SESSIONS - 1) n)."""
        n = situation.robot.n
        X = np.zeros((len(situation), n, MOST_SESSIONS - 1, n))
        for k, rows in enumerate(_sessions(situation)[1:]):
            for j in range(n):
                X[rows, j, k, j] = situation.friction[rows, j]
        return X.reshape(len(situation), n, -1)

    def describe(
        self,
        joint: int | None,
        coefficients: Array,
        shape: tuple[float, ...] = (),
        *,
        force: str = "N m",
        length: str = "rad",
    ) -> str:
        """Describes the finding in one sentence."""
        shares = np.asarray(coefficients).reshape(MOST_SESSIONS - 1, -1)
        k, j = np.unravel_index(int(np.argmax(np.abs(shares))), shares.shape)
        most, way = shares[k, j], "more" if shares[k, j] > 0 else "less"
        return (
            "The friction of the joints differs between the logs, most on joint "
            f"{j + 1} with {percent(abs(most))} {way} than in the first log. Likely cause: another temperature, or "
            f"maintenance between the logs."
        )


def _sessions(situation: Situation) -> list[slice]:
    """Returns the rows of each session.

    Logs belong to one session if the pause between them is shorter than `UNKNOWN_PAUSE`. Logs without known pauses may
    be from different days.
    """
    t, runs, least = situation.t, situation.runs, UNKNOWN_PAUSE - situation.period
    begins = [0, *(b.start for a, b in pairwise(runs) if t[b.start] - t[a.stop - 1] > least)]
    bunches = np.array_split(np.arange(len(begins)), min(len(begins), MOST_SESSIONS))
    starts = [begins[int(bunch[0])] for bunch in bunches]
    return [slice(a, b) for a, b in pairwise((*starts, len(situation)))]
