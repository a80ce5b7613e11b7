"""Work that no log shows: what a pause may have done to the temperatures of each joint."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from robots.common.arrays import Array
from robots.common.records import Record

# Prior standard deviation of the duty. Its mean is zero: a pause is a rest.
DUTY_SPREAD = 0.5
# Standard deviation of the change of friction by unlogged work that one joint has beside the others, as a share of that
# change: 0.3 to 0.4 on six virtual robots of two kinds, after pauses of 10 to 60 min with other motions.
JOINT_SPREAD = 0.35

Heated = Callable[[int, Array, float, float, float | None], Array]
"""Temperature state of a joint after a time [s] at a power [W]."""


class UnloggedWork(Record):
    """Follows each joint as if the robot had worked in the whole of the last pause, beside the joint that rested in it.

    The heat of the pause lies between the two. Its share of the heat of work without a rest, the duty, is one unknown
    of all joints. It is the same in all windows of a log.

    Args:
        n: number of joints.
    """

    ENTRIES = ("worked", "rested", "energy", "time", "duties", "last")

    worked: list[Array | None]
    rested: list[Array | None]
    energy: Array
    time: float
    duties: list[float]
    last: float

    def __init__(self, n: int) -> None:
        self.worked = [None] * n
        # As if the robot had rested in all pauses so far.
        self.rested = [None] * n
        # Friction power at the reference temperature, summed over the logs [J], and their time [s].
        self.energy, self.time = np.zeros(n), 0.0
        self.duties = []
        self.last = DUTY_SPREAD

    @property
    def duty(self) -> float:
        """Estimate of the duty of the last pause, between 0 and 1: the mean over the windows since then.

        In the first window it is that of the pause before.
        """
        return float(np.clip(np.mean(self.duties), 0.0, 1.0)) if self.duties else self.last

    def per_duty(self, change: float) -> float:
        """Change of the log of a friction per unit of the duty, about the estimated one.

        Args:
            change: relative change of the friction by work in the whole pause. The duty is the share of it.
        """
        # Below this duty the log of the friction changes evenly with it.
        duty = max(self.duty, 0.05)
        return float(np.log1p(duty * change) / duty)

    def record(self, power: Array, duration: float) -> None:
        """Takes into account what logged motion does: friction power at the reference temperature (n,) [W]."""
        self.energy = self.energy + power * duration
        self.time += duration

    def settle(self, states: Sequence[Array | None]) -> list[Array | None]:
        """Ends a log: gives the states (n,) with the heat of the estimated duty."""
        duty = self.duty if self.duties else 0.0
        settled = [
            state if state is None or other is None else state + duty * (other - state)
            for state, other in zip(states, self.worked, strict=True)
        ]
        self.last, self.duties = self.duty, []
        return settled

    def pause(
        self,
        states: Sequence[Array | None],
        duration: float,
        ambient: float | None,
        factor: Callable[[int, Array], float],
        heated: Heated,
    ) -> None:
        """Follows a pause [s] in which the robot works as in the logs, from states (n,).

        Args:
            states: at its start.
            duration: of the pause [s].
            ambient: temperature of the surroundings [degC]; None for the models' own.
            factor: friction of a joint over that at the reference temperature, by its state.
            heated: see `Heated`.
        """
        self.worked = list(states)
        if self.time == 0:
            return
        power = self.energy / self.time
        # A pause of this length [s] leads to a steady state, whatever it holds.
        rest = min(duration, 6 * 3600.0)
        # Within this time [s] the fall of friction by its own heat is small.
        step_length = 60.0
        steps = [step_length] * int(rest // step_length)
        if rest % step_length > 1e-3:
            steps.append(rest % step_length)
        for j, state in enumerate(states):
            if state is None:
                continue
            now = state
            for step in steps:
                now = heated(j, now, power[j] * factor(j, now), step, ambient)
            self.worked[j] = now
