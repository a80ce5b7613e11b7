"""Where a payload is fixed: on the flange, or on a link before it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.regressor import TorqueModel
from robots.robot import Robot
from robots.terms.situations.flange_body import link_columns, require_flange


@dataclass(frozen=True, eq=False)
class Mount:
    """The body that carries a payload.

    Attributes:
        robot: the robot.
        link: the link, counted from 1 by the joint that moves it; None for the flange.

    Raises:
        InputError: a link that the robot does not have, or a robot whose flange is not known.
    """

    robot: Robot
    link: int | None = None

    def __post_init__(self) -> None:
        if self.link is None:
            require_flange(self.robot)
        elif not 1 <= self.link <= self.robot.n:
            raise InputError(f"link {self.link}", allowed=f"1 to {self.robot.n}, by the joint that moves the link")

    @property
    def name(self) -> str:
        """As texts say it."""
        return "flange" if self.link is None else f"link {self.link}"

    @property
    def joints(self) -> int:
        """Number of joints that move it."""
        return self.link or self.robot.n

    @property
    def pose(self) -> Array:
        """Pose (4, 4) of the payload's frame on its link: the flange, or the frame of the link."""
        return self.robot.chain.tip if self.link is None else np.eye(4)

    def columns(self, model: TorqueModel) -> tuple[int, ...]:
        """Gives the indices of the ten columns of the link that carries the payload."""
        return link_columns(model, self.link)

    def poses(self, q: ArrayLike, gravity: Array | None) -> tuple[Array, Array]:
        """Poses (N, 4, 4) of the payload's frame over positions (N, n), and gravity (3,) in the base frame [m/s2]."""
        chain = self.robot.under(gravity).chain
        return chain.transforms(q)[..., self.joints - 1, :, :] @ self.pose, np.asarray(chain.gravity, dtype=float)
