"""Reading measured poses from tables: names of columns, units, and which measurement they hold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimation.calibrations.column_names import column_names, refuse_recordings
from estimation.calibrations.options import ANGLES, LENGTHS, TableOptions
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.files import sha256
from robots.common.tables.table import Table
from robots.common.tables.table_files import read_table
from robots.geometry_errors.measurements import (
    BodyPoses,
    CameraBoard,
    Distances,
    HeldPart,
    Inclinometer,
    Markers,
    Measurement,
    Planes,
    Points,
)
from robots.geometry_errors.poses import MeasuredPoses, approaches
from robots.robot import Robot

QUATERNION = ("qx", "qy", "qz", "qw")
MATRIX = tuple(f"r{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3))
UNIT_LENGTH = 0.05  # a quaternion that is off by more is none

SHOWN = (
    "x,y,z of a marker or x1,y1,z1,x2,... of several [m]; x,y,z and qx,qy,qz,qw or r11..r33 of a pose; d or d1,d2,... "
    "of distances [m]; plane or point with the number of what is touched; other1..otherm of a second arm [rad]; "
    "u1,v1,... of a board [px]; roll,pitch of an inclinometer [rad]"
)


def read_poses(
    path: str | PathLike[str],
    robot: Robot | Sequence[Robot],
    *,
    options: TableOptions | None = None,
    checked: bool = True,
) -> MeasuredPoses:
    """Reads measured poses from a CSV or Parquet table, one row a pose.

    Columns: ``q1..qn`` or the joints' names; what was measured (see the documentation); optionally ``t`` [s],
    ``session``, ``temp`` [degC], ``dq1..dqn``, and ``approach1..n`` (1 or -1). An empty cell was not measured. Without
    columns of approach, the direction is that from the row before: poses are taken to be visited in order. Names as
    trackers and controllers write them are read, too (`column_names`), and units in the header or in a name.

    Args:
        path: the file.
        robot: whose poses they are; two for a part that both arms hold.
        options: units and what the file does not say.
        checked: whether poses are refused that are not what the file says: degrees, millimetres, another order of
            quaternions, a left-handed frame, swapped joints, one pose repeated, a lost marker.

    Returns:
        The poses in SI units.

    Raises:
        InputError: columns that are missing or no numbers, naming them, or poses that fail a check.
    """
    how = options or TableOptions()
    robots = [robot] if isinstance(robot, Robot) else list(robot)
    refuse_recordings(Path(path))
    table = read_table(path)
    reader = _Reader(table, how)
    q = reader.joints(robots[0])
    measurement, observed, second = reader.measured(robots)
    empty = ~np.isfinite(observed).any(axis=1) if observed.shape[1] else np.zeros(len(q), dtype=bool)
    session = reader.session()
    approach = reader.optional([f"approach{i + 1}" for i in range(robots[0].n)])
    velocity = reader.optional([f"dq{i + 1}" for i in range(robots[0].n)])
    temperature = reader.optional(["temp"])
    poses = MeasuredPoses(
        q=q,
        measurement=measurement,
        observed=observed,
        second=second,
        t=None if (t := reader.optional(["t"])) is None else t[:, 0],
        session=session,
        temperature=(
            temperature[:, 0]
            if temperature is not None
            else None
            if how.temperature is None
            else np.full(len(q), how.temperature)
        ),
        velocity=None if velocity is None else velocity * reader.speed(robots[0]),
        approach=approaches(q) if approach is None else np.sign(approach),
        known={name: np.asarray(value, dtype=float) for name, value in how.known.items()},
        line=np.array([table.line(k) for k in range(len(q))], dtype=np.int64),
        source={
            "file": str(path),
            "sha256": sha256(path),
            "lengths": how.lengths,
            "angles": how.angles,
            "not_read": [name for name in table.names if name not in reader.used],
        },
    )
    poses = poses.part(~empty)
    if checked:
        from estimation.calibrations.suspicions import refuse_suspicious

        refuse_suspicious(robots, poses)
    return poses


class _Reader:
    """Columns of one table."""

    def __init__(self, table: Table, how: TableOptions) -> None:
        self.table, self.how = table, how
        self.names, stated = column_names(table.names)
        # A unit in the header of the file is one of its column; one in a name is part of it.
        self.units = {plain: table.units.get(name) or stated[plain] for plain, name in self.names.items()}
        self.used: set[str] = set()

    def has(self, *names: str) -> bool:
        return all(name.lower() in self.names for name in names)

    def numbers(self, names: Sequence[str], *, empty: bool = False) -> Array:
        """Columns (N, K) as they are."""
        columns = []
        for name in names:
            stored = self.names[name.lower()]
            self.used.add(stored)
            if self.table.is_text(stored):
                raise InputError("is text", file=self.table.path, column=stored, allowed="numbers")
            values = np.asarray(self.table.columns[stored], dtype=float)
            wrong = np.flatnonzero(~np.isfinite(values))
            if wrong.size and not empty:
                raise InputError(
                    "an empty cell",
                    file=self.table.path,
                    column=stored,
                    row=self.table.line(int(wrong[0])),
                    allowed="a number in every row",
                    remedy="remove the row, or fill the cell",
                )
            columns.append(np.where(np.isfinite(values), values, np.nan))
        return np.column_stack(columns)

    def optional(self, names: Sequence[str]) -> Array | None:
        return self.numbers(names) if self.has(*names) else None

    def lengths(self, names: Sequence[str]) -> Array:
        """Columns of lengths (N, K) [m]; an empty cell was not measured."""
        return self.numbers(names, empty=True) * self.factors(names, LENGTHS, self.how.lengths)

    def factors(self, names: Sequence[str], units: Mapping[str, float], default: str) -> Array:
        """Factors of columns to SI (K,), by their own units or the stated one."""
        found = []
        for name in names:
            unit = self.units.get(name.lower()) or default
            if unit not in units:
                column, allowed = self.names[name.lower()], " or ".join(units)
                raise InputError(f"unit {unit!r}", file=self.table.path, column=column, allowed=allowed)
            found.append(units[unit])
        return np.array(found)

    def turn(self, robot: Robot, names: Sequence[str]) -> Array:
        """Factors of joint positions to SI (n,)."""
        return np.concatenate(
            [
                self.factors([name], LENGTHS, self.how.lengths)
                if kind == "prismatic"
                else self.factors([name], ANGLES, self.how.angles)
                for name, kind in zip(names, robot.chain.kinds, strict=True)
            ]
        )

    def speed(self, robot: Robot) -> Array:
        """Factors of joint velocities to SI (n,), in the units of the positions."""
        units = (self.how.lengths, self.how.angles)
        return np.array([LENGTHS[units[0]] if kind == "prismatic" else ANGLES[units[1]] for kind in robot.chain.kinds])

    def joints(self, robot: Robot) -> Array:
        """Joint positions in SI units (N, n)."""
        numbered = [f"q{i + 1}" for i in range(robot.n)]
        names = numbered if self.has(*numbered) else list(robot.joint_names)
        if not self.has(*names):
            missing = [name for name in numbered if not self.has(name)]
            raise InputError(
                f"no column {missing[0]}",
                file=self.table.path,
                allowed=f"q1 to q{robot.n}, or the joints' names: {', '.join(robot.joint_names)}",
                remedy="rename the columns, or choose the robot's joints (--joints)",
            )
        more = f"q{robot.n + 1}"
        if names == numbered and self.has(more):
            raise InputError(
                f"a column {more}, but {robot.name} has {robot.n} joints",
                file=self.table.path,
                column=more,
                remedy="choose another robot or its joints (--robot, --joints)",
            )
        return self.numbers(names) * self.turn(robot, names)

    def session(self) -> NDArray[np.int64] | None:
        if not self.has("session"):
            return None
        values = self.table.columns[self.names["session"]]
        _, first, numbers = np.unique(values, return_index=True, return_inverse=True)
        # Sessions are numbered from 1 in the order in which they come.
        order = np.argsort(np.argsort(first))
        return np.asarray(order[numbers.ravel()] + 1, dtype=np.int64)

    def measured(self, robots: Sequence[Robot]) -> tuple[Measurement, Array, Array | None]:
        """The kind of measurement, its numbers in SI units, and the positions of a second arm."""
        if len(robots) == 2:
            names = [f"other{i + 1}" for i in range(robots[1].n)]
            if not self.has(*names):
                raise InputError(f"no columns other1 to other{robots[1].n} of the second arm", file=self.table.path)
            rows = len(self.table)
            return HeldPart(), np.zeros((rows, 0)), self.numbers(names) * self.turn(robots[1], names)
        if self.has("u1", "v1"):
            return self._camera()
        if self.has("roll", "pitch"):
            tilts = ["roll", "pitch"]
            factors = self.factors(tilts, ANGLES, self.how.angles)
            return Inclinometer(), self.numbers(tilts, empty=True) * factors, None
        if self.has("plane") or self.has("point"):
            name = "plane" if self.has("plane") else "point"
            kind: type[Planes] | type[Points] = Planes if name == "plane" else Points
            numbers = self.numbers([name])
            if not np.array_equal(np.unique(numbers), np.arange(1, numbers.max() + 1)):
                raise InputError(
                    "numbers that are not 1, 2, 3, ...", file=self.table.path, column=name, remedy="number them so"
                )
            return kind(count=int(numbers.max())), numbers, None
        if self.has("d") or self.has("d1"):
            names = ["d"] if self.has("d") else self._counted(["d"])
            return Distances(count=len(names), offset=self.how.offset), self.lengths(names), None
        if self.has("x", "y", "z"):
            place = self.lengths(["x", "y", "z"])
            turn = self._turn()
            return (Markers(count=1), place, None) if turn is None else (BodyPoses(), np.hstack([place, turn]), None)
        if self.has("x1", "y1", "z1"):
            names = self._counted(["x", "y", "z"])
            return Markers(count=len(names) // 3), self.lengths(names), None
        raise InputError("no column of a measurement", file=self.table.path, allowed=SHOWN, remedy="rename the columns")

    def _counted(self, stems: Sequence[str]) -> list[str]:
        names: list[str] = []
        while self.has(*(own := [f"{stem}{len(names) // len(stems) + 1}" for stem in stems])):
            names += own
        return names

    def _turn(self) -> Array | None:
        """Quaternions x, y, z, w (N, 4)."""
        if self.has(*MATRIX):
            matrices = self.numbers(MATRIX, empty=True).reshape(-1, 3, 3)
            return self._of_matrices(matrices)
        if not self.has(*QUATERNION):
            return None
        values = self.numbers(QUATERNION, empty=True)
        lengths = np.linalg.norm(values, axis=1)
        wrong = np.flatnonzero(np.abs(lengths - 1.0) > UNIT_LENGTH)
        if wrong.size:
            raise InputError(
                f"a quaternion of length {lengths[wrong[0]]:.3g}",
                file=self.table.path,
                column="qx",
                row=self.table.line(int(wrong[0])),
                allowed="unit quaternions",
                remedy="check the columns qx, qy, qz and qw",
            )
        if self.how.quaternion == "wxyz":
            values = values[:, [1, 2, 3, 0]]
        return values / lengths[:, None]

    def _of_matrices(self, matrices: Array) -> Array:
        result = np.full((len(matrices), 4), np.nan)
        seen = np.isfinite(matrices).all(axis=(1, 2))
        determinant = np.linalg.det(matrices[seen])
        if seen.any() and np.median(determinant) < 0.0:
            raise InputError(
                "rotation matrices of a left-handed frame (determinant -1)",
                file=self.table.path,
                column="r11",
                remedy="export the tracker's data in a right-handed frame",
            )
        error = np.abs(matrices[seen] @ np.swapaxes(matrices[seen], 1, 2) - np.eye(3)).max(axis=(1, 2), initial=0.0)
        wrong = np.flatnonzero(error > UNIT_LENGTH)
        if wrong.size:
            raise InputError(
                "a matrix that is no rotation",
                file=self.table.path,
                column="r11",
                row=self.table.line(int(np.flatnonzero(seen)[wrong[0]])),
                remedy="check r11 to r33: rows first",
            )
        result[seen] = Rotation.from_matrix(matrices[seen]).as_quat()
        return result

    def _camera(self) -> tuple[Measurement, Array, None]:
        if self.how.board is None or self.how.intrinsics is None:
            raise InputError(
                "pixels of a board need the board and the camera",
                file=self.table.path,
                remedy="state --board ACROSS,ALONG,SPACING [m] and --camera FX,FY,CX,CY [px]",
            )
        across, along, spacing = self.how.board
        kind = CameraBoard(
            across=int(across),
            rows=int(along),
            spacing=spacing,
            intrinsics=self.how.intrinsics,
            distortion=self.how.distortion or (0.0, 0.0, 0.0, 0.0, 0.0),
            fit=self.how.fit_camera,
            on_flange=self.how.camera_on_flange,
        )
        names = self._counted(["u", "v"])
        if len(names) != len(kind.columns):
            raise InputError(
                f"{len(names) // 2} corners",
                file=self.table.path,
                allowed=f"{kind.count}, of a board {across:g} x {along:g}",
            )
        return kind, self.numbers(kind.columns, empty=True), None


def poses_to_columns(poses: MeasuredPoses) -> dict[str, Any]:
    """Gives the columns of a table that `read_poses` reads back.

    Args:
        poses: the poses.
    """
    columns: dict[str, Any] = {f"q{i + 1}": values for i, values in enumerate(poses.q.T)}
    if poses.second is not None:
        columns |= {f"other{i + 1}": values for i, values in enumerate(poses.second.T)}
    columns |= dict(zip(poses.measurement.columns, poses.observed.T, strict=True))
    for name, values in (("t", poses.t), ("session", poses.session), ("temp", poses.temperature)):
        if values is not None:
            columns[name] = values
    if poses.velocity is not None:
        columns |= {f"dq{i + 1}": values for i, values in enumerate(poses.velocity.T)}
    return columns
