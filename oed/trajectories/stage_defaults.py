"""Defaults of friction sweeps and warm-ups, which the programme of a campaign shares."""

FRICTION_LEVELS = (0.05, 0.20, 0.40, 0.60, 0.80, 1.00)
"""Speeds of the friction sweep as fractions of the velocity limit (thesis section 2.4)."""

LONGEST_PLATEAU = 1.0
"""Time at constant speed that is aimed at by default [s]."""

RANGE_FRACTION = 0.8
"""Part of each joint's range that the warm-up drives (thesis section 2.4.1)."""
