"""From logged positions to noise-free motion, without phase lag."""

from estimation.preprocessing.resampling import Resampled, resample, stale_rows
from estimation.preprocessing.smoothing import smooth

__all__ = ["Resampled", "resample", "smooth", "stale_rows"]
