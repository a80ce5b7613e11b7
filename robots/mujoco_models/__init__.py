"""Robots from MuJoCo's model files (MJCF)."""

from robots.mujoco_models.files import is_mjcf
from robots.mujoco_models.robots import mjcf_tree, robot_from_mjcf

__all__ = ["is_mjcf", "mjcf_tree", "robot_from_mjcf"]
