"""A camera that sees a board of known points: their places in the image, in pixels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from robots.common.errors import InputError
from robots.geometry_errors.measurements.base import Evaluation, Measurement, point_by_twist, setup_jacobian
from robots.geometry_errors.measurements.poses import BodyPoses
from robots.geometry_errors.measurements.setup import Setup, Unknown
from robots.geometry_errors.twists import adjoint, inverse

Array = NDArray[np.float64]


NEAREST = 1e-3  # m; what is nearer than this, or behind, is not in an image


@dataclass(frozen=True, kw_only=True)
class CameraBoard(Measurement):
    """Pixels ``u = fx x / z + cx, v = fy y / z + cy`` of the inner corners of a chessboard, without distortion.

    Attributes:
        rows: corners along the board's y.
        across: corners along the board's x.
        spacing: of the corners [m].
        intrinsics: fx, fy, cx, cy [px].
        on_flange: whether the camera is on the flange and the board stands, or the other way round.

    Raises:
        InputError: fewer than 2 x 2 corners, or a spacing or focal length that is not positive.
    """

    kind = "camera"
    title = "a camera that sees a board"
    block = 2
    rows: int = 4
    across: int = 5
    spacing: float = 0.03
    intrinsics: tuple[float, float, float, float] = (1000.0, 1000.0, 640.0, 480.0)
    on_flange: bool = True

    def __post_init__(self) -> None:
        if min(self.rows, self.across) < 2 or self.spacing <= 0.0 or min(self.intrinsics[:2]) <= 0.0:
            raise InputError(
                f"a board of {self.across} x {self.rows} corners at {self.spacing:g} m, focal lengths "
                f"{self.intrinsics[0]:g} and {self.intrinsics[1]:g} px",
                allowed="2 x 2 corners or more, and positive lengths",
            )

    @property
    def count(self) -> int:
        """Number of corners."""
        return self.rows * self.across

    @property
    def corners(self) -> Array:
        """Corners on the board (K, 3) [m], row by row."""
        x, y = np.meshgrid(np.arange(self.across), np.arange(self.rows))
        return self.spacing * np.column_stack([x.ravel(), y.ravel(), np.zeros(self.count)]).astype(float)

    @property
    def units(self) -> tuple[str, ...]:
        """Pixels."""
        return ("px",) * (2 * self.count)

    @property
    def columns(self) -> tuple[str, ...]:
        """``u1, v1, u2, ...``, row by row of the board."""
        return tuple(f"{axis}{k + 1}" for k in range(self.count) for axis in "uv")

    def start(self, flanges: Sequence[Array], observed: Array) -> Setup:
        """Finds the board in each image by its homography (Zhang 2000), and from that the poses of both."""
        boards = np.full((len(observed), 4, 4), np.nan)
        for row, pixels in enumerate(observed.reshape(len(observed), -1, 2)):
            if np.isfinite(pixels).all(axis=1).sum() >= 4:
                boards[row] = self._board(pixels)
        # The board in the camera, or the camera in the frame of the board: poses that a tracker would measure.
        seen = np.isfinite(boards).all(axis=(1, 2))
        measured = inverse(boards[seen]) if self.on_flange else boards[seen]
        table = np.hstack([measured[:, :3, 3], Rotation.from_matrix(measured[:, :3, :3]).as_quat()])
        found = BodyPoses().start([flanges[0][seen]], table)
        tracker, tool = found["tracker"].value, found["tool"].value
        return {
            "board" if self.on_flange else "camera": Unknown(kind="pose", value=inverse(tracker)),
            "camera" if self.on_flange else "board": Unknown(kind="pose", value=tool),
        }

    def evaluate(self, flanges: Sequence[Array], observed: Array, setup: Setup) -> Evaluation:
        """Computes residuals [px]."""
        flange = flanges[0]
        camera, board = setup["camera"].value, setup["board"].value
        rows, corners = len(flange), self.corners
        view = inverse(flange @ camera if self.on_flange else np.tile(camera, (rows, 1, 1)))
        plate = view @ (board if self.on_flange else flange @ board)
        seen = np.einsum("nij,kj->nki", plate[:, :3, :3], corners) + plate[:, None, :3, 3]
        depth = np.where(seen[..., 2] > NEAREST, seen[..., 2], np.nan)
        fx, fy, cx, cy = self.intrinsics
        pixels = np.stack([fx * seen[..., 0] / depth + cx, fy * seen[..., 1] / depth + cy], axis=-1)
        project = np.zeros((rows, self.count, 2, 3))
        project[..., 0, 0], project[..., 0, 2] = fx / depth, -fx * seen[..., 0] / depth**2
        project[..., 1, 1], project[..., 1, 2] = fy / depth, -fy * seen[..., 1] / depth**2
        by_camera = project @ -point_by_twist(np.broadcast_to(np.eye(3), (rows, self.count, 3, 3)), seen)
        by_board = project @ point_by_twist(plate[:, None, :3, :3], corners)
        size = 2 * self.count
        moving = by_camera if self.on_flange else by_board
        by_flange = moving.reshape(rows, size, 6) @ adjoint(inverse(camera if self.on_flange else board))
        parts = {
            "camera": by_camera.reshape(rows, size, 6),
            "board": by_board.reshape(rows, size, 6),
        }
        residual = observed - pixels.reshape(rows, size)
        behind = np.isnan(depth).any(axis=1)
        residual[behind] = np.nan
        by_flange[behind] = 0.0
        for part in parts.values():
            part[behind] = 0.0
        return Evaluation(residual=residual, by_flange=(by_flange,), by_setup=setup_jacobian(setup, parts, rows, size))

    def simulate(self, flanges: Sequence[Array], setup: Setup, noise: Mapping[str, float], seed: int) -> Array:
        """Gives pixels (N, 2 K); NaN where a corner is out of an image of twice the principal point."""
        exact = -self.evaluate(flanges, np.zeros((len(flanges[0]), 2 * self.count)), setup).residual
        cx, cy = self.intrinsics[2:]
        size = np.tile([2.0 * cx, 2.0 * cy], self.count)
        # An image shows all corners, or the board was not found.
        exact[((exact < 0.0) | (exact > size)).any(axis=1)] = np.nan
        return exact + noise.get("px", 0.0) * np.random.default_rng(seed).standard_normal(exact.shape)

    def _board(self, pixels: Array) -> Array:
        """Pose of the board in the camera (4, 4)."""
        fx, fy, cx, cy = self.intrinsics
        known = np.isfinite(pixels).all(axis=1)
        image = (pixels[known] - [cx, cy]) / [fx, fy]
        x, y = self.corners[known, 0], self.corners[known, 1]
        one, zero = np.ones_like(x), np.zeros_like(x)
        upper = np.column_stack([x, y, one, zero, zero, zero, -image[:, 0] * x, -image[:, 0] * y, -image[:, 0]])
        lower = np.column_stack([zero, zero, zero, x, y, one, -image[:, 1] * x, -image[:, 1] * y, -image[:, 1]])
        h = np.linalg.svd(np.vstack([upper, lower]))[2][-1].reshape(3, 3)
        h = h / np.sqrt(np.linalg.norm(h[:, 0]) * np.linalg.norm(h[:, 1])) * (1.0 if h[2, 2] > 0 else -1.0)
        left, _, right = np.linalg.svd(np.column_stack([h[:, 0], h[:, 1], np.cross(h[:, 0], h[:, 1])]))
        pose = np.eye(4)
        pose[:3, :3] = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
        pose[:3, 3] = h[:, 2]
        return pose

    @property
    def example(self) -> Setup:
        """A camera that looks ahead of the flange, and a board in front of the robot."""
        board = np.eye(4)
        board[:3, 3] = (0.5, 0.0, 0.0)
        return {"board": Unknown(kind="pose", value=board), "camera": Unknown(kind="pose", value=np.eye(4))}
