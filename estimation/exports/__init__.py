"""Exports of an identified model: an updated URDF or MJCF, and C code for a controller."""

from estimation.exports.c_code import c_code, export_c
from estimation.exports.mjcf import build_mjcf, export_mjcf
from estimation.exports.standard import standard_parameters
from estimation.exports.urdf import build_urdf, export_urdf, urdf_text

__all__ = [
    "build_mjcf",
    "build_urdf",
    "c_code",
    "export_c",
    "export_mjcf",
    "export_urdf",
    "standard_parameters",
    "urdf_text",
]
