"""Kinds of geometric errors, one file each."""

from __future__ import annotations

from robots.common.errors import InputError
from robots.geometry_errors.terms.backlash import Backlash
from robots.geometry_errors.terms.base import Column, ErrorParameter, ErrorTerm
from robots.geometry_errors.terms.base_motion import BaseMotion
from robots.geometry_errors.terms.eccentricity import Eccentricity
from robots.geometry_errors.terms.gear_ratio import GearRatio
from robots.geometry_errors.terms.joint_compliance import JointCompliance
from robots.geometry_errors.terms.joint_zero import JointZero
from robots.geometry_errors.terms.link_compliance import LinkCompliance
from robots.geometry_errors.terms.link_placement import LinkPlacement
from robots.geometry_errors.terms.load_backlash import LoadBacklash
from robots.geometry_errors.terms.thermal_growth import ThermalGrowth
from robots.geometry_errors.terms.time_offset import TimeOffset

TERMS: tuple[ErrorTerm, ...] = (
    JointZero(),
    LinkPlacement(),
    GearRatio(),
    Eccentricity(),
    JointCompliance(),
    LinkCompliance(),
    ThermalGrowth(),
    Backlash(),
    LoadBacklash(),
    TimeOffset(),
    BaseMotion(),
)
"""All kinds, in the order in which parameters that no pose distinguishes are kept."""


def error_term(kind: str) -> ErrorTerm:
    """Finds a kind of geometric errors.

    Args:
        kind: its name.

    Raises:
        InputError: an unknown name.
    """
    found = next((term for term in TERMS if term.kind == kind), None)
    if found is None:
        raise InputError(f"unknown geometric error {kind!r}", allowed=", ".join(term.kind for term in TERMS))
    return found


__all__ = ["TERMS", "Column", "ErrorParameter", "ErrorTerm", "error_term"]
