"""Virtual robots: a torque model with true parameters, perhaps with effects beyond it, seen through sensors."""

from robots.plants.effects import PlantEffect, plant_effect
from robots.plants.loading import load_plant
from robots.plants.plant import Plant, nominal_plant, simulate
from robots.plants.sensors import Sensors

__all__ = ["Plant", "PlantEffect", "Sensors", "load_plant", "nominal_plant", "plant_effect", "simulate"]
