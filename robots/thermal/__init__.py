"""How joints warm up by their own friction, and what the warmth does to the friction."""

from robots.thermal.known import KnownThermal, known_thermal
from robots.thermal.second_order import SecondOrder

__all__ = ["KnownThermal", "SecondOrder", "known_thermal"]
