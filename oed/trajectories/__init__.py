"""Motions in closed form: excitation series and splines, strokes and sweeps, warm-up and postures, and sequences."""

from oed.trajectories.axis_poses import vertical_axis_pose
from oed.trajectories.base import Kinematics, Trajectory, count_periods, round_up
from oed.trajectories.bspline import BSpline, bspline_basis
from oed.trajectories.constant_speed import constant_speed_sweep, spaced_speeds
from oed.trajectories.fourier import FourierSeries, fourier_basis, rest_basis
from oed.trajectories.fourier_polynomial import FourierPolynomial, fourier_polynomial_basis
from oed.trajectories.harmonic_sine import HarmonicSine, harmonic_sine_bounds
from oed.trajectories.polynomial import PiecewisePolynomial
from oed.trajectories.postures import Posture, spread_postures
from oed.trajectories.sequence import KINDS, Segment, Sequence
from oed.trajectories.sinusoid import Sinusoid, shortest_stroke_duration, velocity_reaching_stroke
from oed.trajectories.sweeps import Plateau, Sweep, friction_sweep
from oed.trajectories.warm_up import WarmUp, plan_warm_up

__all__ = [
    "KINDS",
    "BSpline",
    "FourierPolynomial",
    "FourierSeries",
    "HarmonicSine",
    "Kinematics",
    "PiecewisePolynomial",
    "Plateau",
    "Posture",
    "Segment",
    "Sequence",
    "Sinusoid",
    "Sweep",
    "Trajectory",
    "WarmUp",
    "bspline_basis",
    "constant_speed_sweep",
    "count_periods",
    "fourier_basis",
    "fourier_polynomial_basis",
    "friction_sweep",
    "harmonic_sine_bounds",
    "plan_warm_up",
    "rest_basis",
    "round_up",
    "shortest_stroke_duration",
    "spaced_speeds",
    "spread_postures",
    "velocity_reaching_stroke",
    "vertical_axis_pose",
]
