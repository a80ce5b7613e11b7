"""What the logs say: models identified from measured data, with honest uncertainty."""

from __future__ import annotations

from robots.common.lazy import lazy_exports

_EXPORTS = {
    "Estimate": "estimation.estimate",
    "Model": "estimation.model",
    "Prediction": "estimation.prediction",
    "identify": "estimation.identification",
    "load_model": "estimation.model",
    "predict": "estimation.prediction",
    "read_log": "estimation.logs",
    "read_logs": "estimation.logs",
    "write_log": "estimation.logs",
}
__all__ = list(_EXPORTS)
__getattr__ = lazy_exports(__name__, _EXPORTS)
