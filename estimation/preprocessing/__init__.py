"""From logged positions to noise-free motion, without phase lag."""

from estimation.preprocessing.base import Smoother
from estimation.preprocessing.harmonics import Harmonics
from estimation.preprocessing.periods import Cycle, find_cycle
from estimation.preprocessing.resampling import Resampled, between_rows, resample, stale_rows
from estimation.preprocessing.rest import rows_at_rest
from estimation.preprocessing.smoothing import LowPass, smooth
from estimation.preprocessing.spline import SmoothingSpline

__all__ = [
    "Cycle",
    "Harmonics",
    "LowPass",
    "Resampled",
    "Smoother",
    "SmoothingSpline",
    "between_rows",
    "find_cycle",
    "resample",
    "rows_at_rest",
    "smooth",
    "stale_rows",
]
