"""Limits that hold at all times, also between the samples at which they are imposed."""

from oed.constraints.between_samples import (
    Extremes,
    TrigonometricPolynomial,
    certified_extremes,
    exact_extremes,
    overshoot_factor,
    sampled_bounds,
    series_extremes,
    series_polynomials,
    tightened_bounds,
)
from oed.constraints.kinematic import QUANTITIES, KinematicRows, kinematic_rows
from oed.constraints.pointwise import PointwiseLimit
from oed.constraints.state import StateLimit, StateLimits
from oed.constraints.torque import TorqueLimit
from oed.constraints.torque_rms import TorqueRms
from oed.constraints.velocity_ramp import VelocityRampLimit

__all__ = [
    "QUANTITIES",
    "Extremes",
    "KinematicRows",
    "PointwiseLimit",
    "StateLimit",
    "StateLimits",
    "TorqueLimit",
    "TorqueRms",
    "TrigonometricPolynomial",
    "VelocityRampLimit",
    "certified_extremes",
    "exact_extremes",
    "kinematic_rows",
    "overshoot_factor",
    "sampled_bounds",
    "series_extremes",
    "series_polynomials",
    "tightened_bounds",
]
