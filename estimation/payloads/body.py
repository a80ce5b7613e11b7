"""A rigid body in a frame: mass, centre of mass, inertia, principal axes, and the texts that state one."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.records import read, read_json
from robots.consistency import normalised_eigenvalues
from robots.geometry.inertia import BODY_PARAMETERS, check_body, inertial_parameters, symmetric
from robots.terms.situations.flange_body import point_mass
from robots.terms.situations.sensitivities import moved_body

FORMAT = "robot-oed payload"
PAYLOAD_VERSION = 1
DAMAGED = "identify the payload again with oed payload"
EXAMPLE = "a payload.json, or KG,X,Y,Z: mass [kg] and centre of mass in the flange frame [m], such as 1.5,0,0,0.08"


@dataclass(frozen=True, eq=False)
class Body:
    """A rigid body.

    Attributes:
        parameters: ``m, mPx, mPy, mPz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz`` about the frame's origin (10,).
    """

    parameters: Array

    @staticmethod
    def of(mass: float, centre: ArrayLike, inertia: ArrayLike) -> Body:
        """Builds a body.

        Args:
            mass: [kg].
            centre: centre of mass (3,) [m].
            inertia: (3, 3) about the centre of mass [kg m2].
        """
        return Body(inertial_parameters(mass, centre, inertia, np.eye(4)))

    @property
    def mass(self) -> float:
        """[kg]."""
        return float(self.parameters[0])

    @property
    def centre(self) -> Array:
        """Centre of mass (3,) [m]; zero without a mass."""
        return np.asarray(self.parameters[1:4] / (self.parameters[0] or 1.0))

    @cached_property
    def inertia(self) -> Array:
        """Inertia (3, 3) about the centre of mass, in the frame's axes [kg m2]."""
        return central_inertia(self.parameters)

    @property
    def possible(self) -> bool:
        """Whether a body of positive density has these parameters."""
        return bool((normalised_eigenvalues(self.parameters) > 0).all())

    @cached_property
    def principal(self) -> tuple[Array, Array]:
        """Principal moments of inertia (3,) [kg m2], and the principal axes as columns of a rotation matrix (3, 3).

        The axes are those nearest to the frame's own.
        """
        moments, axes = np.linalg.eigh(self.inertia)
        order: list[int] = []
        for row in np.abs(axes):
            order.append(max((k for k in range(3) if k not in order), key=lambda k: row[k]))
        axes = axes[:, order] * np.where(np.diag(axes[:, order]) < 0, -1.0, 1.0)
        if np.linalg.det(axes) < 0:
            axes[:, int(np.argmin(np.abs(np.diag(axes))))] *= -1.0
        return moments[order], axes

    def seen_from(self, pose: ArrayLike) -> Body:
        """Expresses the body in another frame.

        Args:
            pose: (4, 4) of that frame in this body's frame.

        Returns:
            The same body, its parameters about that frame.
        """
        return Body(moved_body(np.linalg.inv(np.asarray(pose, dtype=float))) @ self.parameters)


def central_inertia(parameters: ArrayLike) -> Array:
    """Gives the inertia about the centre of mass.

    ``I_c = I - (h'h 1 - h h') / m`` with h = m c (parallel axes).

    Args:
        parameters: (10,) about a frame's origin; zeros without a mass.

    Returns:
        (3, 3) in the frame's axes [kg m2].
    """
    values = np.asarray(parameters, dtype=float)
    moment = values[1:4]
    return np.asarray(
        symmetric(values[4:]) - (moment @ moment * np.eye(3) - np.outer(moment, moment)) / (values[0] or 1.0)
    )


def read_body(text: str) -> Body:
    """Reads a payload as people state one.

    Args:
        text: a `payload.json` or its folder; or ``KG,X,Y,Z``, a point mass [kg] and its position [m] in the flange
            frame.

    Returns:
        The body in the flange frame.

    Raises:
        InputError: a text of another form, a file that is no payload or one on another link, or a body that cannot
            exist.
    """
    parts = text.split(",")
    if len(parts) == 4:
        try:
            mass, x, y, z = map(float, parts)
        except ValueError:
            raise InputError(f"the payload {text}", allowed=EXAMPLE) from None
        if not np.isfinite([mass, x, y, z]).all():
            raise InputError(f"the payload {text}", allowed="finite numbers")
        check_body(mass, np.zeros((3, 3)), f"the payload {text}")
        return Body(point_mass(mass, (x, y, z)))
    data = read_payload_file(text)
    if data.get("link") is not None:
        raise InputError(f"a payload on link {data['link']}", file=text, allowed="a payload on the flange")
    return body_from_dict(data, text)


def read_payload_file(path: str | Path) -> dict[str, Any]:
    """Reads the data of a `payload.json`, or of the one in a folder.

    Raises:
        InputError: a missing file, or one that is no payload.
    """
    file = Path(path)
    file = file / "payload.json" if file.is_dir() else file
    if not file.exists():
        raise InputError(f"the payload {path}: no such file", allowed=EXAMPLE)
    return read_json(file, FORMAT, PAYLOAD_VERSION, remedy=f"give {EXAMPLE}")


def body_from_dict(data: dict[str, Any], file: str | Path) -> Body:
    """Builds the body that a payload file states, in the flange frame.

    Raises:
        InputError: numbers that are missing, or that no body has.
    """
    parameters = read(Array, data.get("parameters"), "parameters", file=file, remedy=DAMAGED)
    if parameters.shape != (BODY_PARAMETERS,) or not np.isfinite(parameters).all():
        raise InputError(
            f"parameters of shape {parameters.shape}", file=file, allowed=f"{BODY_PARAMETERS} finite numbers"
        )
    if not parameters.any():
        # No payload was found.
        return Body(parameters)
    if parameters[0] <= 0:
        raise InputError(f"a mass of {parameters[0]:g} kg", file=file, allowed="a positive number")
    body = Body(parameters)
    check_body(body.mass, body.inertia, "the payload", file=str(file))
    return body
