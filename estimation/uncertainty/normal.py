"""The normal distribution's numbers."""

NORMAL_95 = 1.959964
"""Half-width of a 95 % interval, in standard deviations."""
