"""The plane that a robot is mounted on, which is the floor of an arm that stands on it."""

from __future__ import annotations

import numpy as np

from robots.collision.boxes import FLOOR, Plane
from robots.collision.pairs import random_poses
from robots.geometry.chain import Chain
from robots.limits import Limits

UPRIGHT = float(np.cos(np.deg2rad(10.0)))  # of the first axis; beyond, nothing says where the mounting plane is


def base_plane(chain: Chain, limits: Limits, span: tuple[float, float] | None = None) -> Plane | None:
    """Finds the plane that an arm is mounted on: across its first turning axis, at the far end of its base.

    Args:
        chain: the arm.
        limits: of its joints.
        span: lowest and highest point of the base along z of its frame [m]; by default the frame's origin.

    Returns:
        The plane with its free side towards the arm. None where the first turning axis is not along z of the base
        frame: then the description does not say what the robot is mounted on.
    """
    turning = [joint for joint, kind in enumerate(chain.kinds) if kind != "prismatic"]
    if not turning:
        return None
    q = random_poses(limits, 100)
    poses = chain.transforms(q)
    axis = poses[:, turning[0], :3, :3] @ chain.joints[turning[0]].axis
    if np.abs(axis[:, 2]).min() < UPRIGHT:
        return None
    low, high = span or (0.0, 0.0)
    arm = float(np.mean(chain.flange(q)[:, 2, 3])) - (low + high) / 2.0
    below = arm >= 0.0
    # Meshes end somewhere near a round height.
    offset = round(low if below else -high, 4) + 0.0  # not -0
    return Plane(name=FLOOR, normal=np.array([0.0, 0.0, 1.0 if below else -1.0]), offset=offset)
