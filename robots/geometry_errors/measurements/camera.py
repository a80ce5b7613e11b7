"""A camera that sees a board of known points: their places in the image, in pixels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.geometry_errors.measurements.base import (
    Evaluation,
    Measurement,
    Scene,
    point_by_twist,
    setup_jacobian,
)
from robots.geometry_errors.measurements.poses import BodyPoses
from robots.geometry_errors.measurements.setup import Setup, Unknown
from robots.geometry_errors.twists import adjoint, inverse

if TYPE_CHECKING:
    import casadi

NEAREST = 1e-3  # m; what is nearer than this, or behind, is not in an image
UNDISTORTIONS = 20  # fixed-point steps from pixels to directions
FITS = ("known", "intrinsics", "distortion")
LENS = ("k1", "k2", "p1", "p2", "k3")


@dataclass(frozen=True, kw_only=True)
class CameraBoard(Measurement):
    """Pixels ``u = fx x' + cx, v = fy y' + cy`` of the inner corners of a chessboard.

    The lens moves the direction ``x = X / Z, y = Y / Z`` to ``x' = x (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x y +
    p2 (r^2 + 2 x^2)``, and y alike (Brown 1971, as OpenCV has it).

    Attributes:
        rows: corners along the board's y.
        across: corners along the board's x.
        spacing: of the corners [m].
        intrinsics: fx, fy, cx, cy [px].
        distortion: k1, k2, p1, p2, k3.
        fit: what is estimated of the camera itself: "known" for nothing, "intrinsics" for its four numbers,
            "distortion" for the lens, too.
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
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    fit: str = "known"

    def __post_init__(self) -> None:
        if self.fit not in FITS:
            raise InputError(f"a camera of which {self.fit!r} is fitted", allowed=" or ".join(FITS))
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
            **self._optics(),
        }

    def _optics(self) -> Setup:
        """What is estimated of the camera itself."""
        own: dict[str, Unknown] = {}
        if self.fit != "known":
            value = np.array(self.intrinsics, dtype=float)
            own["camera_px"] = Unknown(
                kind="number", value=value, labels=("fx", "fy", "cx", "cy"), unit="px", scale=1.0
            )
        if self.fit == "distortion":
            value = np.array(self.distortion, dtype=float)
            own["lens"] = Unknown(kind="number", value=value, labels=LENS, unit="", scale=0.01)
        return own

    def _numbers(self, setup: Setup) -> tuple[Array, Array]:
        """Intrinsics and distortion of a setup."""
        own = [setup[name].value if name in setup else None for name in ("camera_px", "lens")]
        known = (self.intrinsics, self.distortion)
        first, second = (np.array(k, dtype=float) if o is None else o for o, k in zip(own, known, strict=True))
        return first, second

    def evaluate(self, flanges: Sequence[Array], observed: Array, setup: Setup) -> Evaluation:
        """Computes residuals [px]."""
        flange = flanges[0]
        camera, board = setup["camera"].value, setup["board"].value
        rows, corners = len(flange), self.corners
        view = inverse(flange @ camera if self.on_flange else np.tile(camera, (rows, 1, 1)))
        plate = view @ (board if self.on_flange else flange @ board)
        seen = np.einsum("nij,kj->nki", plate[:, :3, :3], corners) + plate[:, None, :3, 3]
        depth = np.where(seen[..., 2] > NEAREST, seen[..., 2], np.nan)
        (fx, fy, cx, cy), lens = self._numbers(setup)
        x, y = seen[..., 0] / depth, seen[..., 1] / depth
        bent, by_place, by_lens = _bent(x, y, lens)
        pixels = bent * (fx, fy) + (cx, cy)
        by_point = np.zeros((rows, self.count, 2, 3))
        by_point[..., 0, 0] = by_point[..., 1, 1] = 1.0 / depth
        by_point[..., 0, 2], by_point[..., 1, 2] = -x / depth, -y / depth
        focal = np.array([fx, fy])[:, None]
        project = focal * (by_place @ by_point)
        by_camera = project @ -point_by_twist(np.broadcast_to(np.eye(3), (rows, self.count, 3, 3)), seen)
        by_board = project @ point_by_twist(plate[:, None, :3, :3], corners)
        size = 2 * self.count
        moving = by_camera if self.on_flange else by_board
        by_flange = moving.reshape(rows, size, 6) @ adjoint(inverse(camera if self.on_flange else board))
        parts = {
            "camera": by_camera.reshape(rows, size, 6),
            "board": by_board.reshape(rows, size, 6),
        }
        if "camera_px" in setup:
            by_numbers = np.zeros((rows, self.count, 2, 4))
            by_numbers[..., 0, 0], by_numbers[..., 1, 1] = bent[..., 0], bent[..., 1]
            by_numbers[..., 0, 2] = by_numbers[..., 1, 3] = 1.0
            parts["camera_px"] = by_numbers.reshape(rows, size, 4)
        if "lens" in setup:
            parts["lens"] = (focal * by_lens).reshape(rows, size, 5)
        residual = observed - pixels.reshape(rows, size)
        behind = np.isnan(depth).any(axis=1)
        residual[behind] = np.nan
        by_flange[behind] = 0.0
        for part in parts.values():
            part[behind] = 0.0
        return Evaluation(residual=residual, by_flange=(by_flange,), by_setup=setup_jacobian(setup, parts, rows, size))

    def expression(self, moved: Scene, nominal: Scene) -> casadi.SX:
        """Writes the pixels, row by row of the board."""
        import casadi

        flange, parts = moved
        camera, board = parts["camera"], parts["board"]
        # Steps are small: the inverse of a pose is right to first order.
        carried, fixed = (camera, board) if self.on_flange else (board, camera)
        there = flange @ carried
        plate = _inverse(there) @ fixed if self.on_flange else _inverse(fixed) @ there
        px, lens = parts.get("camera_px", casadi.SX(self.intrinsics)), parts.get("lens", casadi.SX(self.distortion))
        found = []
        for corner in self.corners:
            seen = plate[:3, :3] @ casadi.SX(corner) + plate[:3, 3]
            x, y = _distorted(seen[0] / seen[2], seen[1] / seen[2], [lens[k] for k in range(5)])
            found += [px[0] * x + px[2], px[1] * y + px[3]]
        return casadi.vertcat(*found)

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
        bent = (pixels[known] - [cx, cy]) / [fx, fy]
        image = bent.copy()
        for _ in range(UNDISTORTIONS):
            image += bent - np.column_stack(_distorted(image[:, 0], image[:, 1], self.distortion))
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
        poses = {"board": Unknown(kind="pose", value=board), "camera": Unknown(kind="pose", value=np.eye(4))}
        return {**poses, **self._optics()}


def _distorted(x: Any, y: Any, lens: Sequence[Any]) -> tuple[Any, Any]:
    """Where a lens shows a direction; of numbers or expressions."""
    k1, k2, p1, p2, k3 = lens
    square = x * x + y * y
    radial = 1.0 + square * (k1 + square * (k2 + square * k3))
    across = 2.0 * x * y
    return x * radial + p1 * across + p2 * (square + 2.0 * x * x), y * radial + p1 * (
        square + 2.0 * y * y
    ) + p2 * across


def _bent(x: Array, y: Array, lens: Array) -> tuple[Array, Array, Array]:
    """Directions that a lens shows (..., 2), and derivatives by the direction (..., 2, 2) and the lens (..., 2, 5)."""
    k1, k2, p1, p2, k3 = lens
    square = x * x + y * y
    radial = 1.0 + square * (k1 + square * (k2 + square * k3))
    slope = k1 + square * (2.0 * k2 + 3.0 * square * k3)
    mixed = 2.0 * (x * y * slope + p1 * x + p2 * y)
    by_place = np.empty((*x.shape, 2, 2))
    by_place[..., 0, 0] = radial + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x
    by_place[..., 1, 1] = radial + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x
    by_place[..., 0, 1] = by_place[..., 1, 0] = mixed
    first = [x * square, x * square**2, 2.0 * x * y, square + 2.0 * x * x, x * square**3]
    second = [y * square, y * square**2, square + 2.0 * y * y, 2.0 * x * y, y * square**3]
    by_lens = np.stack([np.stack(first, axis=-1), np.stack(second, axis=-1)], axis=-2)
    return np.stack(_distorted(x, y, lens.tolist()), axis=-1), by_place, by_lens


def _inverse(pose: casadi.SX) -> casadi.SX:
    import casadi

    turned = pose[:3, :3].T
    return casadi.vertcat(casadi.horzcat(turned, -turned @ pose[:3, 3]), casadi.SX([[0.0, 0.0, 0.0, 1.0]]))
