"""Where a robot meets itself or what stands around it: capsules, boxes, planes, and distances with exact gradients."""

from robots.collision.boxes import Box, Plane, Scene, floor
from robots.collision.capsules import Capsule, reach, segment_capsules
from robots.collision.coal_ import CoalChecker
from robots.collision.kinematics import Frames, symbolic_frames
from robots.collision.loading import collision_model
from robots.collision.model import CollisionModel
from robots.collision.motion import check_motion
from robots.collision.pairs import Pair
from robots.collision.report import CollisionReport
from robots.collision.surroundings import Surroundings
from robots.collision.travel import travel_bound

__all__ = [
    "Box",
    "Capsule",
    "CoalChecker",
    "CollisionModel",
    "CollisionReport",
    "Frames",
    "Pair",
    "Plane",
    "Scene",
    "Surroundings",
    "check_motion",
    "collision_model",
    "floor",
    "reach",
    "segment_capsules",
    "symbolic_frames",
    "travel_bound",
]
