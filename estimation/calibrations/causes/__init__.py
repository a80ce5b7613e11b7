"""Causes of geometric errors: which physical defect explains what the description gets wrong."""

from estimation.calibrations.causes.diagnosing import GeometryDiagnosis, diagnose_geometry
from estimation.calibrations.causes.findings import CauseFinding

__all__ = ["CauseFinding", "GeometryDiagnosis", "diagnose_geometry"]
