"""Result of a closed-loop forward simulation, without and with the findings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from robots.common.arrays import Array
from robots.common.records import Record
from robots.plants.closed_loop import Loop

# Ratio of controller corrections with and without findings above which the summary reports a deterioration.
WORSE = 1.05


@dataclass(frozen=True, kw_only=True, eq=False)
class Curves:
    """Curves of one simulated stretch, for plots.

    Attributes:
        t: time [s], (N,).
        measured: measured torque (N, n) [N m or N].
        torque: measured torque plus controller correction, without and with findings, (N, n) each [N m or N].
        deviation: simulated minus measured position, without and with findings, (N, n) each [rad or m].
    """

    t: Array
    measured: Array
    torque: tuple[Array, Array]
    deviation: tuple[Array, Array]


@dataclass(frozen=True, kw_only=True, eq=False)
class Simulation(Record):
    """How well the simulated robot follows a stretch of held-out data, without and with the findings.

    The measured torque drives the simulated robot, and a position loop controls it to the measured motion. The
    controller correction is therefore the torque error of the model; the remaining deviation is its position error.

    Attributes:
        start: start of the stretch [s].
        end: end of the stretch [s].
        loop: assumed position loop.
        torque: RMS of the controller correction over RMS of the measured torque (n,), without and with findings.
        motion: RMS deviation from the measured position (n,) [rad or m], without and with findings.
        note: limitations of this simulation; empty without any.
        curves: curves for plots; None after loading from a file.
    """

    ENTRIES = (
        "start",
        "end",
        "loop",
        "torque.before=torque[0]",
        "torque.after=torque[1]",
        "motion.before=motion[0]",
        "motion.after=motion[1]",
        "note",
    )

    start: float
    end: float
    loop: Loop
    torque: tuple[Array, Array]
    motion: tuple[Array, Array]
    note: str = ""
    curves: Curves | None = field(default=None, repr=False)

    @property
    def telling(self) -> int:
        """Index (from 0) of the joint whose controller correction changes most with the findings."""
        return int(np.argmax(np.abs(np.nan_to_num(self.torque[0] - self.torque[1]))))

    def summary(self, lengths: Sequence[str]) -> str:
        """States controller correction and position error of the joint that changes most, without and with findings.

        Args:
            lengths: unit of each joint's position (n,).

        Returns:
            One line of text.
        """
        joint = self.telling
        (old, new), (far, near) = (tuple(part[joint] for part in pair) for pair in (self.torque, self.motion))
        worse = " The findings make the simulation of this joint worse." if new > WORSE * old else ""
        return (
            f"Forward simulation, joint {joint + 1}: controller correction {100 * old:.3g} -> {100 * new:.3g} % of "
            f"torque, position error {1e3 * far:.3g} -> {1e3 * near:.3g} m{lengths[joint]} ({self.start:.1f} to "
            f"{self.end:.1f} s, measured torque as input, assumed {self.loop.bandwidth:g} Hz position loop)."
            f"{worse}{f' {self.note}' if self.note else ''}"
        )
