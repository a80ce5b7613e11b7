"""Drives identified from commands and positions, without a torque signal."""

from __future__ import annotations

from estimation.actuators.fitting import FitOptions
from estimation.actuators.identification import ActuatorOptions, identify_actuators
from estimation.actuators.result import Actuators, DriveValue, MotionError, load_actuators
from estimation.actuators.search import LoopFinding

__all__ = [
    "ActuatorOptions",
    "Actuators",
    "DriveValue",
    "FitOptions",
    "LoopFinding",
    "MotionError",
    "identify_actuators",
    "load_actuators",
]
