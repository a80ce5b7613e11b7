"""Motions in closed form: families of excitation, strokes, sweeps, warm-up, and sequences."""

from oed.trajectories.axis_poses import vertical_axis_pose
from oed.trajectories.base import Kinematics, Trajectory, count_periods, round_up
from oed.trajectories.families import (
    FAMILIES,
    BSpline,
    Excitation,
    Family,
    Fourier,
    FourierPolynomial,
    check_family,
    family,
)
from oed.trajectories.fourier import FourierSeries, fourier_basis, rest_basis
from oed.trajectories.polynomial import PiecewisePolynomial
from oed.trajectories.sequence import KINDS, Segment, Sequence
from oed.trajectories.sinusoid import Sinusoid, shortest_stroke_duration, velocity_reaching_stroke
from oed.trajectories.sweeps import Plateau, Sweep, friction_sweep
from oed.trajectories.warm_up import WarmUp, plan_warm_up

__all__ = [
    "FAMILIES",
    "KINDS",
    "BSpline",
    "Excitation",
    "Family",
    "Fourier",
    "FourierPolynomial",
    "FourierSeries",
    "Kinematics",
    "PiecewisePolynomial",
    "Plateau",
    "Segment",
    "Sequence",
    "Sinusoid",
    "Sweep",
    "Trajectory",
    "WarmUp",
    "check_family",
    "count_periods",
    "family",
    "fourier_basis",
    "friction_sweep",
    "plan_warm_up",
    "rest_basis",
    "round_up",
    "shortest_stroke_duration",
    "velocity_reaching_stroke",
    "vertical_axis_pose",
]
