"""Optimal experiment design for robots: what to measure next, and the command line."""

from __future__ import annotations

from robots.common.lazy import lazy_exports

_EXPORTS = {
    "Campaign": "oed.campaigns",
    "Design": "oed.experiments",
    "Effort": "oed.experiments",
    "InteriorPoint": "oed.experiments",
    "Ipopt": "oed.experiments",
    "ParetoFront": "oed.experiments",
    "Programme": "oed.campaigns",
    "RetimedExperiment": "oed.experiments",
    "campaign": "oed.campaigns",
    "design": "oed.experiments",
    "pareto": "oed.experiments",
    "read_trajectory": "oed.exports",
    "retime": "oed.experiments",
    "write_trajectory": "oed.exports",
}
__all__ = list(_EXPORTS)
__getattr__ = lazy_exports(__name__, _EXPORTS)
