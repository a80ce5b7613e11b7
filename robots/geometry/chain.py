"""A serial chain of joints and its numeric kinematics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike

from robots.common.arrays import Array
from robots.common.errors import InputError

Kind = Literal["revolute", "prismatic"]

_ROTATION_ROUNDING = 1e-15  # below it an entry of a rotation is rounding: cos(90 deg) in floating point is 6e-17, not 0


def _frozen(value: ArrayLike, shape: tuple[int, ...], what: str, joint: str | None = None) -> Array:
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{what} is not numeric", joint=joint) from error
    if array.shape != shape:
        raise InputError(f"{what} has the shape {array.shape}", joint=joint, allowed=f"the shape {shape}")
    if not np.all(np.isfinite(array)):
        raise InputError(f"{what} is not finite", joint=joint)
    array.flags.writeable = False
    return array


def _frozen_rotation(value: ArrayLike, what: str, joint: str | None = None) -> Array:
    rotation = np.array(_frozen(value, (3, 3), what, joint))
    error = np.abs(rotation @ rotation.T - np.eye(3)).max()
    # Rotations built from angles are orthonormal to 1e-15; a mistyped matrix is off by far more.
    if error > 1e-9 or np.linalg.det(rotation) < 0.0:
        raise InputError(f"{what} is not a proper rotation matrix (orthonormality error {error:.1e})", joint=joint)
    # Exact zeros keep the symbolic dynamics sparse, and structurally absent columns exactly absent.
    rotation[np.abs(rotation) < _ROTATION_ROUNDING] = 0.0
    rotation.flags.writeable = False
    return rotation


def homogeneous(rotation: ArrayLike, translation: ArrayLike) -> Array:
    """Compose a homogeneous transform ``[[R, p], [0, 1]]``.

    Args:
        rotation: (3, 3).
        translation: (3,) [m].

    Returns:
        (4, 4).
    """
    transform = np.eye(4)
    transform[:3, :3] = rotation
    transform[:3, 3] = translation
    return transform


def pose_of(values: Sequence[float]) -> Array | None:
    """Compose a pose from numbers.

    Args:
        values: position [m], or position and roll, pitch and yaw [m, rad].

    Returns:
        (4, 4); None for another number of values, or values that are not finite.
    """
    if len(values) not in (3, 6) or not np.isfinite(values).all():
        return None
    return homogeneous(rotation_from_rpy([*values[3:], 0.0, 0.0, 0.0][:3]), values[:3])


def rotation_from_rpy(rpy: ArrayLike) -> Array:
    """Rotation of fixed-axis roll, pitch and yaw, ``R = Rz(yaw) Ry(pitch) Rx(roll)``, as URDF defines it.

    Args:
        rpy: (3,) [rad].

    Returns:
        (3, 3).
    """
    roll, pitch, yaw = np.asarray(rpy, dtype=np.float64)
    cr, sr, cp, sp, cy, sy = np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch), np.cos(yaw), np.sin(yaw)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def rotation_from_quaternion(quaternion: ArrayLike) -> Array:
    """Rotation of a quaternion x, y, z, w, which is normalised.

    Args:
        quaternion: (4,), not zero.

    Returns:
        (3, 3).
    """
    x, y, z, w = np.asarray(quaternion, dtype=np.float64) / np.linalg.norm(quaternion)
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def joint_motion(kind: Kind, axis: ArrayLike, q: ArrayLike) -> Array:
    """Transform that a joint adds: ``R = 1 + sin(q) [k] + (1 - cos(q)) [k]^2`` (Rodrigues), or ``p = k q``.

    Args:
        kind: "revolute" or "prismatic".
        axis: (3,) unit vector k.
        q: (...) joint positions [rad or m].

    Returns:
        (..., 4, 4).
    """
    axis = np.asarray(axis, dtype=np.float64)
    q = np.asarray(q, dtype=np.float64)
    transform = np.zeros((*q.shape, 4, 4))
    transform[..., range(4), range(4)] = 1.0
    if kind == "prismatic":
        transform[..., :3, 3] = q[..., None] * axis
        return transform
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    # 1 - cos(q) cancels at small angles; 2 sin^2(q / 2) does not.
    versine = 2.0 * np.sin(0.5 * q) ** 2
    transform[..., :3, :3] += np.sin(q)[..., None, None] * cross + versine[..., None, None] * (cross @ cross)
    return transform


@dataclass(frozen=True, eq=False)
class Joint:
    """One moving joint.

    The joint frame is fixed in the parent's link frame; the link frame is the joint frame moved by ``q`` about or
    along ``axis``, so both coincide at ``q = 0``.

    Args:
        name: what people call it.
        kind: "revolute" or "prismatic".
        rotation: (3, 3) orientation of the joint frame in the parent's link frame.
        translation: (3,) origin of the joint frame in the parent's link frame [m].
        axis: (3,) axis in the joint frame; it is normalised.

    Raises:
        InputError: naming the joint, on a wrong shape, an improper rotation, or an axis of zero length.
    """

    name: str
    kind: Kind
    rotation: Array
    translation: Array
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))

    def __post_init__(self) -> None:
        if self.kind not in get_args(Kind):
            raise InputError(f"unknown kind {self.kind!r}", joint=self.name, allowed=" or ".join(get_args(Kind)))
        axis = np.array(_frozen(self.axis, (3,), "the axis", self.name))
        length = np.linalg.norm(axis)
        if length < 1e-9:
            raise InputError("the axis has no length", joint=self.name, allowed="a vector other than zero")
        if abs(length - 1.0) > _ROTATION_ROUNDING:
            axis /= length
        axis.flags.writeable = False
        set_ = object.__setattr__
        set_(self, "rotation", _frozen_rotation(self.rotation, "the rotation", self.name))
        set_(self, "translation", _frozen(self.translation, (3,), "the translation", self.name))
        set_(self, "axis", axis)

    @property
    def placement(self) -> Array:
        """(4, 4) transform from the parent's link frame to the joint frame."""
        return homogeneous(self.rotation, self.translation)

    def transform(self, q: ArrayLike) -> Array:
        """Transform from the parent's link frame to this link's frame.

        Args:
            q: (...) position of this joint [rad or m].

        Returns:
            (..., 4, 4).
        """
        return self.placement @ joint_motion(self.kind, self.axis, q)


class LinkPlace(NamedTuple):
    """Where a named link of a file is: ``pose`` (4, 4) in the frame of ``body``, 0 the base, i what joint i moves."""

    name: str
    body: int
    pose: Array


@dataclass(frozen=True, eq=False)
class Chain:
    """A serial chain of joints from a base to a flange.

    Args:
        joints: from the base to the flange; the first joint's parent is the base frame.
        gravity: (3,) acceleration of gravity in the base frame [m/s2].
        tip: (4, 4) transform from the last link's frame to the flange.

    Raises:
        InputError: on no joint, a joint name used twice, a wrong shape or an improper rotation.
    """

    joints: tuple[Joint, ...]
    gravity: Array = field(default_factory=lambda: np.array([0.0, 0.0, -9.81]))
    tip: Array = field(default_factory=lambda: np.eye(4))

    def __post_init__(self) -> None:
        joints = tuple(self.joints)
        if not joints:
            raise InputError("a chain needs at least one moving joint")
        names = [joint.name for joint in joints]
        repeated = next((name for name in names if names.count(name) > 1), None)
        if repeated is not None:
            raise InputError("the joint name is used twice", joint=repeated)
        tip = _frozen(self.tip, (4, 4), "the tip transform")
        if not np.array_equal(tip[3], [0.0, 0.0, 0.0, 1.0]):
            raise InputError("the tip transform is not homogeneous", allowed="a last row of 0 0 0 1")
        tip = homogeneous(_frozen_rotation(tip[:3, :3], "the tip's rotation"), tip[:3, 3])
        tip.flags.writeable = False
        set_ = object.__setattr__
        set_(self, "joints", joints)
        set_(self, "gravity", _frozen(self.gravity, (3,), "gravity"))
        set_(self, "tip", tip)

    @property
    def n(self) -> int:
        """Number of moving joints."""
        return len(self.joints)

    @property
    def names(self) -> tuple[str, ...]:
        """Joint names from the base to the flange."""
        return tuple(joint.name for joint in self.joints)

    @property
    def kinds(self) -> tuple[Kind, ...]:
        """Joint kinds from the base to the flange."""
        return tuple(joint.kind for joint in self.joints)

    def transforms(self, q: ArrayLike | Sequence[Any]) -> Array:
        """Poses of all link frames in the base frame, ``T_i = T_1(q_1) ... T_i(q_i)``.

        Args:
            q: (..., n) joint positions [rad or m].

        Returns:
            (..., n, 4, 4), one pose a link.

        Raises:
            InputError: when the last dimension of ``q`` is not n.
        """
        q = np.asarray(q, dtype=np.float64)
        if q.ndim == 0 or q.shape[-1] != self.n:
            raise InputError(f"q has the shape {q.shape}", allowed=f"a last dimension of {self.n}, one per joint")
        poses = np.empty((*q.shape[:-1], self.n, 4, 4))
        pose: Array = np.eye(4)
        for i, joint in enumerate(self.joints):
            pose = pose @ joint.transform(q[..., i])
            poses[..., i, :, :] = pose
        return poses

    def flange(self, q: ArrayLike | Sequence[Any]) -> Array:
        """Pose of the flange in the base frame.

        Args:
            q: (..., n) joint positions [rad or m].

        Returns:
            (..., 4, 4).
        """
        return self.transforms(q)[..., -1, :, :] @ self.tip
