"""Robots: description, dynamics, limits, signals and the virtual robot."""

from __future__ import annotations

from robots.common.lazy import lazy_exports, listed

_EXPORTS = {
    "AssumedValueWarning": "robots.common.errors",
    "BaseParameters": "robots.base_parameters",
    "InfeasibleError": "robots.common.errors",
    "InputError": "robots.common.errors",
    "Limits": "robots.limits",
    "Log": "robots.signals",
    "Motion": "robots.signals",
    "NotIdentifiableError": "robots.common.errors",
    "OedError": "robots.common.errors",
    "Plant": "robots.plants",
    "Robot": "robots.robot",
    "Sensors": "robots.plants",
    "SolverError": "robots.common.errors",
    "TorqueModel": "robots.regressor",
    "default_model": "robots.regressor",
    "find_base_parameters": "robots.base_parameters",
    "load_robot": "robots.loading",
    "nominal_plant": "robots.plants",
    "simulate": "robots.plants",
    "__version__": "robots.version",
}
__all__ = [name for name in _EXPORTS if name != "__version__"]
__getattr__ = lazy_exports(__name__, _EXPORTS)
__dir__ = listed(_EXPORTS)
