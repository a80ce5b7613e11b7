"""Optimal experiment design for robots: what to measure next, and the command line."""

from __future__ import annotations

from robots.common.lazy import lazy_exports, listed

_EXPORTS = {
    "BSpline": "oed.trajectories",
    "Campaign": "oed.campaigns",
    "Criterion": "oed.criteria",
    "Design": "oed.experiments",
    "Discrimination": "oed.campaigns.discriminations",
    "Effort": "oed.experiments",
    "Family": "oed.trajectories",
    "Fourier": "oed.trajectories",
    "FourierPolynomial": "oed.trajectories",
    "GeometricLimit": "oed.constraints.geometric",
    "InteriorPoint": "oed.experiments",
    "Ipopt": "oed.experiments",
    "LimitOptions": "oed.experiments",
    "ModelOptions": "oed.experiments",
    "ParetoFront": "oed.experiments",
    "PoseDesign": "oed.experiments.pose_designs",
    "PoseOptions": "oed.experiments.pose_designs",
    "Programme": "oed.campaigns",
    "RetimedExperiment": "oed.experiments",
    "SearchOptions": "oed.experiments",
    "StateLimit": "oed.constraints",
    "TrajectoryOptions": "oed.experiments",
    "WeightOptions": "oed.experiments",
    "campaign": "oed.campaigns",
    "design": "oed.experiments",
    "design_poses": "oed.experiments.pose_designs",
    "discriminate": "oed.campaigns.discriminations",
    "pareto": "oed.experiments",
    "read_trajectory": "oed.exports",
    "retime": "oed.experiments",
    "write_trajectory": "oed.exports",
    "__version__": "robots.version",
}
__all__ = [name for name in _EXPORTS if name != "__version__"]
__getattr__ = lazy_exports(__name__, _EXPORTS)
__dir__ = listed(_EXPORTS)
