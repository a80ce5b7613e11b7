"""Interface of smoothers: positions in, motion out, nothing above a cut-off frequency."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from estimation.preprocessing.resampling import Resampled
from robots.common.records import Record
from robots.signals import Motion

Array = NDArray[np.float64]


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
