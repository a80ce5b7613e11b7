"""Geometric errors of arms: kinds of errors, measurements of poses, and the model of both."""

from robots.geometry_errors.measurements import (
    BodyPoses,
    CameraBoard,
    Distances,
    HeldPart,
    Inclinometer,
    Markers,
    Measurement,
    Planes,
    Points,
)
from robots.geometry_errors.measurements.named import measurement_of
from robots.geometry_errors.model import GeometryModel, Prediction
from robots.geometry_errors.poses import MeasuredPoses
from robots.geometry_errors.reduction import Reduction, reduce_columns
from robots.geometry_errors.terms import TERMS, ErrorParameter, ErrorTerm, error_term
from robots.geometry_errors.virtual import random_positions, simulate_poses

__all__ = [
    "TERMS",
    "BodyPoses",
    "CameraBoard",
    "Distances",
    "ErrorParameter",
    "ErrorTerm",
    "GeometryModel",
    "HeldPart",
    "Inclinometer",
    "Markers",
    "MeasuredPoses",
    "Measurement",
    "Planes",
    "Points",
    "Prediction",
    "Reduction",
    "error_term",
    "measurement_of",
    "random_positions",
    "reduce_columns",
    "simulate_poses",
]
