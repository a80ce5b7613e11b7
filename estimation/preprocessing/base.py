"""Interface of smoothers: positions in, motion out, nothing above a cut-off frequency."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from estimation.preprocessing.resampling import Resampled
from robots.common.arrays import Array
from robots.common.records import Record
from robots.signals import Motion


class Smoother(Record, ABC):
    """A way from sampled positions to position, velocity and acceleration without phase lag.

    Attributes:
        name: as results say it.
        cutoff: frequency [Hz] above which it passes nothing worth speaking of.
    """

    ENTRIES: ClassVar[tuple[str, ...]] = ("kind=name", "cutoff_hz=cutoff")

    name: str
    cutoff: float

    @abstractmethod
    def smooth(self, positions: Resampled) -> Motion:
        """Gives the motion at the log's own times."""

    @abstractmethod
    def edge(self, duration: float) -> float:
        """Time at each end of a log of that duration [s] at which the motion is not reliable [s]."""

    @property
    def text(self) -> str:
        """Says what it does in a few words."""
        return f"{self.name} at {self.cutoff:g} Hz"

    def inside(self, t: Array) -> NDArray[np.bool_]:
        """Rows (N,) of a log, or of a part between gaps, at which the smoothing has data on both sides.

        Args:
            t: its times (N,) [s].

        Returns:
            The rows; all of them where none is.
        """
        edge = self.edge(float(t[-1] - t[0]))
        found = np.asarray((t >= t[0] + edge) & (t <= t[-1] - edge))
        return found if found.any() else np.ones(len(t), dtype=bool)
