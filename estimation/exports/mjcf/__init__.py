"""Identified models as MuJoCo model files (MJCF)."""

from estimation.exports.mjcf.mjcf import Mjcf, build_mjcf, export_mjcf

__all__ = ["Mjcf", "build_mjcf", "export_mjcf"]
