"""What can be chosen of a calibration, and of the reading of its table."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any

from robots.common.errors import InputError
from robots.common.options import Names, Option, Seed, numbers

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

LENGTHS = {"m": 1.0, "mm": 1e-3}
ANGLES = {"rad": 1.0, "deg": math.pi / 180.0}
ORDERS = ("xyzw", "wxyz")


@dataclass(frozen=True, kw_only=True)
class CalibrationOptions:
    """How a calibration is done.

    Attributes:
        kinds: kinds of errors to fit, comma-separated: joint_zero, link_placement, gear_ratio, eccentricity,
            joint_compliance, link_compliance, thermal_growth, backlash, load_backlash, time_offset, base_motion.
            Default: those that held-out poses support.
        diagnose: look for the causes of the errors.
        seed: seed of the random numbers.

    Raises:
        InputError: an unknown kind.
    """

    kinds: Names = None
    diagnose: Annotated[bool, Option(name="diagnosis")] = True
    seed: Seed = 0

    def __post_init__(self) -> None:
        from robots.geometry_errors.terms import error_term

        for kind in self.kinds or ():
            error_term(kind)


def read_board(option: str, text: str) -> tuple[int, int, float]:
    """Reads corners across, corners along, and spacing of a board.

    Args:
        option: for the message.
        text: as typed.

    Raises:
        InputError: something else.
    """
    values = numbers(option, text)
    if len(values) != 3 or values[0] != int(values[0]) or values[1] != int(values[1]):
        raise InputError(f"{option} {text}", allowed="ACROSS,ALONG,SPACING, such as 8,6,0.025")
    return int(values[0]), int(values[1]), values[2]


def read_camera(option: str, text: str) -> tuple[float, float, float, float]:
    """Reads the four numbers of a camera.

    Args:
        option: for the message.
        text: as typed.

    Raises:
        InputError: something else.
    """
    values = numbers(option, text)
    if len(values) != 4:
        raise InputError(f"{option} {text}", allowed="FX,FY,CX,CY [px]")
    fx, fy, cx, cy = values
    return fx, fy, cx, cy


def read_lens(option: str, text: str) -> tuple[float, float, float, float, float]:
    """Reads the four or five numbers of a lens.

    Args:
        option: for the message.
        text: as typed.

    Raises:
        InputError: something else.
    """
    values = numbers(option, text)
    if len(values) not in (4, 5):
        raise InputError(f"{option} {text}", allowed="K1,K2,P1,P2 or K1,K2,P1,P2,K3, as OpenCV has them")
    k1, k2, p1, p2, k3 = (*values, 0.0)[:5]
    return k1, k2, p1, p2, k3


def read_part(option: str, text: str) -> tuple[str, ArrayLike]:
    """Reads a known part of the setup: its name, and a point (3,) or a pose (4, 4).

    Args:
        option: for the message.
        text: as typed.

    Raises:
        InputError: something else.
    """
    from robots.geometry.chain import pose_of

    name, _, values = text.partition("=")
    read = numbers(option, values or "none")
    pose = pose_of(read)
    if pose is None:
        raise InputError(f"{option} {text}", allowed="NAME=X,Y,Z of a point, or NAME=X,Y,Z,ROLL,PITCH,YAW of a pose")
    return name.strip(), pose[:3, 3] if len(read) == 3 else pose


@dataclass(frozen=True, kw_only=True)
class TableOptions:
    """How a table of poses is to be read.

    Attributes:
        lengths: unit of measured lengths: m or mm. Units in the file's own header go before.
        angles: unit of joint positions and measured angles: rad or deg.
        quaternion: order of the four columns of a quaternion: xyzw or wxyz. Columns qx, qy, qz, qw are taken by their
            names, unless the order is wxyz: then the file has them swapped.
        offset: distances: estimate the zero of the instrument, too (draw wires).
        board: camera: corners across, corners along, spacing [m] of the board.
        intrinsics: camera: FX,FY,CX,CY [px].
        distortion: camera: K1,K2,P1,P2[,K3] of its lens, as OpenCV has them.
        fit_camera: camera: what is fitted of it beside its place: known (nothing), intrinsics, or distortion (both).
        camera_on_flange: whether the camera is on the flange, and the board stands.
        known: a part of the setup that is known, as NAME=X,Y,Z[,ROLL,PITCH,YAW] [m, rad]: tracker (the pose of the base
            in the tracker's frame), tool, marker_1. Repeatable.
        temperature: for poses without a column of their own [degC].

    Raises:
        InputError: another unit or order.
    """

    lengths: str = "m"
    angles: str = "rad"
    quaternion: str = "xyzw"
    offset: bool = False
    board: Annotated[tuple[int, int, float] | None, Option(reads=read_board)] = None
    intrinsics: Annotated[tuple[float, float, float, float] | None, Option(reads=read_camera, name="camera")] = None
    distortion: Annotated[tuple[float, float, float, float, float] | None, Option(reads=read_lens)] = None
    fit_camera: str = "known"
    camera_on_flange: Annotated[bool, Option(hidden=True)] = True
    known: Annotated[Mapping[str, Any], Option(reads=read_part, several=True)] = field(default_factory=dict)
    temperature: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "known", dict(self.known))
        from robots.geometry_errors.measurements.camera import FITS

        allowed_: dict[str, Iterable[str]] = {"lengths": LENGTHS, "angles": ANGLES, "quaternion": ORDERS}
        for name, allowed in (allowed_ | {"fit_camera": FITS}).items():
            if getattr(self, name) not in allowed:
                raise InputError(f"{name} {getattr(self, name)!r}", allowed=" or ".join(allowed))
