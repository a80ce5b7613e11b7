"""Exports of an identified model: an updated URDF, and C code for a controller."""

from estimation.exports.c_code import c_code, export_c
from estimation.exports.standard import standard_parameters
from estimation.exports.urdf import export_urdf, urdf_text

__all__ = ["c_code", "export_c", "export_urdf", "standard_parameters", "urdf_text"]
