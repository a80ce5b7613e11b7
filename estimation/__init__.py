"""Estimation: models identified from measured data, with realistic uncertainty."""

from __future__ import annotations

from robots.common.lazy import lazy_exports, listed

_EXPORTS = {
    "Calibration": "estimation.calibrations",
    "Diagnosis": "estimation.diagnosis",
    "Estimate": "estimation.identifications.estimate",
    "GateReport": "estimation.gate",
    "Model": "estimation.models.model",
    "ModelComparison": "estimation.comparisons",
    "PayloadEstimate": "estimation.payloads",
    "Prediction": "estimation.predictions.prediction",
    "ThermalEstimate": "estimation.thermal",
    "ThermalRun": "estimation.thermal",
    "bootstrap": "estimation.identifications.bootstrap",
    "calibrate": "estimation.calibrations",
    "check_log": "estimation.gate",
    "choose_thermal": "estimation.thermal",
    "compare": "estimation.comparisons",
    "compare_methods": "estimation.predictions.method_table",
    "diagnose": "estimation.diagnosis",
    "export_c": "estimation.exports",
    "export_mjcf": "estimation.exports",
    "export_urdf": "estimation.exports",
    "fit_campaign": "estimation.thermal",
    "fit_thermal": "estimation.thermal",
    "identify": "estimation.identifications.identification",
    "identify_drive_gains": "estimation.identifications.drive_gains",
    "identify_payload": "estimation.payloads",
    "load_calibration": "estimation.calibrations",
    "load_model": "estimation.models.model",
    "load_payload": "estimation.payloads",
    "on_one_clock": "estimation.logs.clocks",
    "predict": "estimation.predictions.prediction",
    "read_log": "estimation.logs",
    "read_logs": "estimation.logs",
    "read_poses": "estimation.calibrations",
    "write_log": "estimation.logs",
    "__version__": "robots.version",
}
__all__ = [name for name in _EXPORTS if name != "__version__"]
__getattr__ = lazy_exports(__name__, _EXPORTS)
__dir__ = listed(_EXPORTS)
