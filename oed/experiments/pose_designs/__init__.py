"""Designs of poses for a calibration: which to measure, in which order, and what to expect."""

from oed.experiments.pose_designs.designing import design_poses
from oed.experiments.pose_designs.observability import observability_indices
from oed.experiments.pose_designs.result import PoseDesign, load_pose_design
from oed.experiments.pose_options import PoseOptions, View

__all__ = ["PoseDesign", "PoseOptions", "View", "design_poses", "load_pose_design", "observability_indices"]
