"""Virtual robots: a torque model with true parameters, seen through sensors."""

from robots.plants.loading import load_plant
from robots.plants.plant import Plant, nominal_plant, simulate
from robots.plants.sensors import Sensors

__all__ = ["Plant", "Sensors", "load_plant", "nominal_plant", "simulate"]
