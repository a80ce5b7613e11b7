"""Physical effects, one per file, each used by the simulator, the design, the estimation and the diagnosis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from robots.common.errors import InputError
from robots.common.registry import Registry, subclass_check
from robots.terms.base import Column, Term
from robots.terms.friction import (
    COULOMB_VISCOUS,
    FINE_BENDS,
    POLYNOMIAL,
    BendingFriction,
    FrictionPolynomial,
    FrictionTerm,
)
from robots.terms.position_torque import PositionTorque
from robots.terms.rigid_body import RigidBody
from robots.terms.rotor_inertia import RotorInertia
from robots.terms.torque_offset import TorqueOffset

TERMS: Registry[type[Term]] = Registry(
    "term",
    "robot_oed.terms",
    (RigidBody, FrictionPolynomial, BendingFriction, RotorInertia, TorqueOffset, PositionTorque),
    check=subclass_check(Term),
)


def describe_term(term: Term) -> dict[str, Any]:
    """Converts a term to plain data for a model file."""
    return {"name": term.name} | {item.name: getattr(term, item.name) for item in fields(term)}  # type: ignore[arg-type]


def build_term(description: Mapping[str, Any]) -> Term:
    """Builds a term from the output of `describe_term`.

    Args:
        description: the term's name and settings.

    Raises:
        InputError: the term is unknown, or does not have one of the settings.
    """
    settings = dict(description)
    name = settings.pop("name", None)
    kind = TERMS.get_or_raise(name)
    try:
        values = {key: tuple(value) if isinstance(value, list) else value for key, value in settings.items()}
        return kind(**values)
    except TypeError as error:
        raise InputError(f"term {name}: {error}") from error


__all__ = [
    "TERMS",
    "COULOMB_VISCOUS",
    "FINE_BENDS",
    "POLYNOMIAL",
    "Column",
    "FrictionPolynomial",
    "FrictionTerm",
    "PositionTorque",
    "RigidBody",
    "RotorInertia",
    "BendingFriction",
    "Term",
    "TorqueOffset",
    "build_term",
    "describe_term",
]
