"""Delay between a command and its effect, and the average of a delayed command over a step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from robots.common.arrays import Array
from robots.drives.base import DriveParameter, Member

LONGEST = 0.25
"""Longest delay [s] that is searched: a controller over a network."""


@dataclass(frozen=True)
class Delay(Member):
    """The command takes effect `delay` seconds after it is logged.

    The delayed command is an input of the simulation, see `HeldCommand`.
    """

    name: ClassVar[str] = "delay"
    title: ClassVar[str] = "delay of the command"

    def parameters(self) -> tuple[DriveParameter, ...]:
        """Describes the delay."""
        return (DriveParameter(name="delay", unit="s", upper=LONGEST, size=1e-3),)


class HeldCommand:
    """Commands that a controller holds from one sample to the next.

    A step of a simulation sees the mean of the held command over its length. That is continuous in the delay, and
    exact to first order wherever an edge falls.

    Args:
        t: times of the samples (N,) [s].
        command: commanded positions (N, n) [rad or m].
        steps: resolution of each joint's command (n,); 0 for a continuous one.
    """

    def __init__(self, t: Array, command: Array, steps: Array | None = None) -> None:
        fine = np.zeros(command.shape[1]) if steps is None else np.asarray(steps, dtype=float)
        rounded = np.where(fine > 0, np.round(command / np.where(fine > 0, fine, 1.0)) * fine, command)
        self.t, self.command = t, rounded
        self._sum = np.concatenate([np.zeros((1, command.shape[1])), np.cumsum(rounded[:-1] * np.diff(t)[:, None], 0)])

    def means(self, edges: Array, delays: Array) -> tuple[Array, Array]:
        """Averages the delayed commands over steps.

        Args:
            edges: begin and end of the K steps (K + 1,) [s].
            delays: of each joint (n,) [s].

        Returns:
            The means (K, n), and their derivatives by the delays (K, n).
        """
        means, slopes = np.empty((len(edges) - 1, len(delays))), np.empty((len(edges) - 1, len(delays)))
        length = np.diff(edges)
        known: dict[float, tuple[Array, Array]] = {}
        for joint, delay in enumerate(np.asarray(delays, dtype=float)):
            if delay not in known:
                at = edges - delay
                known[delay] = (np.clip(np.searchsorted(self.t, at, side="right") - 1, 0, len(self.t) - 1), at)
            index, at = known[delay]
            held = self.command[index, joint]
            # Before the first sample the command is the first one, all the time.
            total = self._sum[index, joint] + held * (at - self.t[index])
            means[:, joint] = np.diff(total) / length
            slopes[:, joint] = -np.diff(held) / length
        return means, slopes
