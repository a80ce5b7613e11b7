"""Names of the arrays that most modules work on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Floating-point numbers, of any shape."""

Flags = NDArray[np.bool_]
"""True or false for each of something."""
