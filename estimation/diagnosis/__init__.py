"""What a model gets wrong, why, and what mending it brings."""

from __future__ import annotations

from robots.common.lazy import lazy_exports

_EXPORTS = {
    "Diagnosis": "estimation.diagnosis.results.diagnosis",
    "Finding": "estimation.diagnosis.results.diagnosis",
    "diagnose": "estimation.diagnosis.pipeline",
}
__all__ = list(_EXPORTS)
__getattr__ = lazy_exports(__name__, _EXPORTS)
