"""Interface of smoothers: positions in, motion out, nothing above a cut-off frequency."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimation.preprocessing.resampling import Resampled
from robots.signals import Motion

Array = NDArray[np.float64]


class Smoother(ABC):
    """A way from sampled positions to position, velocity and acceleration without phase lag.

    Attributes:
        name: as results say it.
        cutoff: frequency [Hz] above which it passes nothing worth speaking of.
    """

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

    def to_dict(self) -> dict[str, Any]:
        """Describes it as plain data, for `provenance`."""
        return {"kind": self.name, "cutoff_hz": self.cutoff}
