"""Inertial parameters of rigid bodies about a frame of choice."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robots.common.arrays import Array
from robots.common.errors import InputError

BODY_PARAMETERS = 10  # m, mPx, mPy, mPz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz
_UPPER = np.triu_indices(3)  # (xx, xy, xz, yy, yz, zz), the order of our inertial parameters

_NEGLIGIBLE_INERTIA = 1e-12  # kg m2, a grain of dust: some files give markers a mass and an inertia of 1e-35


def symmetric(six: ArrayLike) -> Array:
    """Build the symmetric matrix of ``xx, xy, xz, yy, yz, zz``.

    Args:
        six: (6,).

    Returns:
        (3, 3).
    """
    matrix = np.zeros((3, 3))
    matrix[_UPPER] = six
    return matrix + np.triu(matrix, 1).T


def inertial_parameters(mass: float, com: ArrayLike, inertia_at_com: ArrayLike, transform: ArrayLike) -> Array:
    """Express a body's mass, centre of mass and inertia as parameters about another frame.

    With ``c = R c_b + p`` the parameters are ``m``, ``m c`` and ``I = R I_c R' + m (c'c 1 - c c')`` (parallel axes).

    Args:
        mass: m [kg].
        com: (3,) centre of mass c_b in the body's frame [m].
        inertia_at_com: (3, 3) inertia I_c about the centre of mass, in the body's axes [kg m2].
        transform: (4, 4) pose ``(R, p)`` of the body's frame in the frame of the result.

    Returns:
        (10,) ``m, mPx, mPy, mPz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz`` about the origin of the frame of the result.
    """
    pose = np.asarray(transform, dtype=np.float64)
    rotation = pose[:3, :3]
    c = rotation @ np.asarray(com, dtype=np.float64) + pose[:3, 3]
    about_origin = rotation @ np.asarray(inertia_at_com, dtype=np.float64) @ rotation.T
    about_origin += mass * (c @ c * np.eye(3) - np.outer(c, c))
    return np.concatenate([[mass], mass * c, about_origin[_UPPER]])


def check_body(mass: float, inertia_at_com: ArrayLike, what: str, *, file: str | None = None) -> None:
    """Refuse a mass or inertia that no body has.

    A mass of zero is a frame, and then the inertia must be zero too. Point masses and thin rods, whose inertia is
    singular, pass; so do slight breaches of the triangle inequality, which rounded files often have.

    Args:
        mass: [kg].
        inertia_at_com: (3, 3) about the centre of mass [kg m2].
        what: the body, for the message, such as "link 'forearm'".
        file: where it stands.

    Raises:
        InputError: naming the body.
    """
    inertia = np.asarray(inertia_at_com, dtype=np.float64)
    if not np.isfinite(mass) or mass < 0.0:
        raise InputError(f"{what} has a mass of {mass:g} kg", file=file, allowed="zero or more")
    largest = float(np.abs(inertia).max())
    if mass == 0.0 and largest > 0.0:
        raise InputError(
            f"{what} has an inertia of up to {largest:g} kg m2 but no mass",
            file=file,
            remedy="give it a mass, or an inertia of zero",
        )
    lowest = float(np.linalg.eigvalsh(inertia)[0])
    # Real files carry four or five digits, so the small moment of a thin rod may round below zero.
    if lowest < -max(1e-6 * largest, _NEGLIGIBLE_INERTIA):
        raise InputError(
            f"{what} has an inertia with a negative principal moment of {lowest:.3g} kg m2",
            file=file,
            allowed="a positive definite inertia about the centre of mass",
        )


def body_doubts(mass: float, com: ArrayLike, inertia_at_com: ArrayLike, size: float) -> list[str]:
    """Lists what no body of a robot has, but what a description may still state.

    Args:
        mass: [kg].
        com: (3,) centre of mass in the link's frame [m].
        inertia_at_com: (3, 3) about the centre of mass [kg m2].
        size: the reach of the arm [m].

    Returns:
        One clause each: a principal moment above the sum of the other two, which no distribution of mass has; an
        inertia or a centre of mass much larger than the arm, which is usually one in other units.
    """
    if not mass > 0.0:
        return []
    doubts = []
    low, middle, high = np.linalg.eigvalsh(np.asarray(inertia_at_com, dtype=np.float64))
    # Rounded digits breach the triangle inequality a little, as do scaled models of bodies: by up to 2 %.
    if high > 1.02 * (low + middle) + _NEGLIGIBLE_INERTIA:
        doubts.append(
            f"principal moments of {low:.3g}, {middle:.3g} and {high:.3g} kg m2 that no body has "
            "(the largest exceeds the sum of the others)"
        )
    distance = float(np.linalg.norm(com))
    # The frames of a pendulum or of a single axis may all coincide: an arm counts as 0.3 m long at least.
    scale = 2.0 * max(size, 0.3)
    if distance > scale:
        doubts.append(f"a centre of mass {distance:.3g} m from its joint, farther than the arm reaches")
    gyration = float(np.sqrt(max(high, 0.0) / mass))
    if gyration > max(scale, distance):
        doubts.append(f"an inertia of {high:.3g} kg m2 with {mass:.3g} kg, as if its mass were {gyration:.3g} m away")
    return doubts
