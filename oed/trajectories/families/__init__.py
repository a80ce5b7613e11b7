"""Families of the optimised part of an experiment, one a file: how few coefficients a joint make a motion."""

from __future__ import annotations

import sys

from oed.trajectories.families.base import Excitation, Family, check_family
from oed.trajectories.families.bspline import BSpline
from oed.trajectories.families.fourier import Fourier
from oed.trajectories.families.fourier_polynomial import FourierPolynomial
from robots.common.registry import Registry, members_of, subclass_check

FAMILIES: Registry[type[Family]] = Registry(
    "trajectory family",
    "robot_oed.trajectories",
    members_of(sys.modules[__name__], Family),  # type: ignore[type-abstract]
    check=subclass_check(Family),
)


def family(choice: str | Family, *, harmonics: int = 5, base_frequency: float = 0.1) -> Family:
    """Gives the family of a name with about 2 N - 1 coefficients a joint, or the one given.

    Args:
        choice: a name such as ``bspline``, or a family.
        harmonics: N.
        base_frequency: one over the duration of a repetition [Hz].

    Raises:
        InputError: an unknown name, or numbers out of range.
    """
    if isinstance(choice, Family):
        return choice
    return FAMILIES.get_or_raise(choice).of_size(harmonics, base_frequency)


__all__ = [
    "FAMILIES",
    "BSpline",
    "Excitation",
    "Family",
    "Fourier",
    "FourierPolynomial",
    "check_family",
    "family",
]
