"""Default quick designs for public arms, judged by pinocchio and coal with the descriptions' own meshes.

Run it with ``python benchmarks/collision_free_designs.py FOLDER [NAME ...]``; FOLDER is ``robots`` of the package
example-robot-data (in site-packages: ``cmeel.prefix/share/example-robot-data/robots``). For each arm it
prints the share of poses in which two links that are no neighbours collide, the lowest point of a moving link over the
lowest of the base, the time of the design and cond(Y). Pairs that meet in nine of ten random poses are built so, and
the first link, which turns about the mounting axis, cannot be lower than it is.
"""

from __future__ import annotations

import sys
import time
import warnings
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin

import oed
from robots.common.errors import OedError
from robots.loading import load_robot

ARMS = {
    "ur3": ("ur_description/urdf/ur3_robot.urdf", None),
    "ur5": ("ur_description/urdf/ur5_robot.urdf", None),
    "ur10": ("ur_description/urdf/ur10_robot.urdf", None),
    "panda": ("panda_description/urdf/panda_collision.urdf", "panda_hand_tcp"),
    "xarm7": ("xarm_description/urdf/xarm7.urdf", None),
    "z1": ("z1_description/urdf/z1.urdf", None),
    "so100": ("so_arm_description/urdf/so100.urdf", None),
    "so101": ("so_arm_description/urdf/so101.urdf", None),
    "kinova": ("kinova_description/robots/kinova.urdf", None),
    "two dofs": ("asr_twodof_description/urdf/TwoDofs.urdf", None),
    "talos left arm": ("talos_data/robots/talos_left_arm.urdf", None),
    "tiago": ("tiago_description/robots/tiago_no_hand.urdf", "wrist_ft_tool_link"),
    "tiago pro": ("tiago_pro_description/robots/tiago_pro.urdf", "arm_left_7_link"),
    "baxter": ("baxter_description/urdf/baxter.urdf", "left_hand_link"),
    "pr2": ("pr2_description/urdf/pr2.urdf", "r_wrist_roll_link"),
}
STEP, RANDOM, BUILT = 5, 200, 0.9


class Judge:
    """The robot's links as pinocchio reads them; other joints than the arm's stand at their neutral position."""

    def __init__(self, urdf: Path, joints: tuple[str, ...]) -> None:
        folders = [str(folder) for folder in urdf.parents]
        kinds = [pin.GeometryType.COLLISION, pin.GeometryType.VISUAL]
        self.model, collision, visual = pin.buildModelsFromUrdf(str(urdf), package_dirs=folders, geometry_types=kinds)
        self.shapes = collision if collision.ngeoms else visual
        self.joints = [self.model.joints[self.model.getJointId(name)] for name in joints]
        number = {self.model.getJointId(name): index for index, name in enumerate(joints, start=1)}

        def body(joint: int) -> int:
            while joint and joint not in number:
                joint = self.model.parents[joint]
            return number.get(joint, 0)

        self.bodies = [body(item.parentJoint) for item in self.shapes.geometryObjects]
        self.shapes.removeAllCollisionPairs()
        self.pairs = [
            (i, j) for i in range(self.shapes.ngeoms) for j in range(i) if abs(self.bodies[i] - self.bodies[j]) > 1
        ]
        for pair in self.pairs:
            self.shapes.addCollisionPair(pin.CollisionPair(*pair))
        self.data, self.places = self.model.createData(), self.shapes.createData()

    def meet(self, q: np.ndarray) -> np.ndarray:
        """Which pairs collide at each pose (N, P)."""
        met = np.zeros((len(q), len(self.pairs)), dtype=bool)
        for row, pose in enumerate(q):
            pin.computeCollisions(self.model, self.data, self.shapes, self.places, self._configuration(pose), False)
            met[row] = [result.isCollision() for result in self.places.collisionResults]
        return met

    def lowest(self, q: np.ndarray, moving: bool) -> float:
        """Lowest point of the moving links, or of the others, by the vertices of their meshes or balls about them."""
        low = np.inf
        for pose in q:
            pin.updateGeometryPlacements(self.model, self.data, self.shapes, self.places, self._configuration(pose))
            for item, body, place in zip(self.shapes.geometryObjects, self.bodies, self.places.oMg, strict=True):
                if (body > 1) != moving or (body == 1 and not moving):
                    continue
                solid = item.geometry
                if hasattr(solid, "vertices") and hasattr(solid, "num_vertices"):
                    heights = np.array(solid.vertices()) @ place.rotation[2] + place.translation[2]
                else:
                    heights = place.translation[2] - depth(solid, place.rotation[2])
                low = min(low, float(np.min(heights)))
        return low

    def _configuration(self, pose: np.ndarray) -> np.ndarray:
        x = pin.neutral(self.model)
        for joint, angle in zip(self.joints, pose, strict=True):
            if joint.nq == 2:
                x[joint.idx_q : joint.idx_q + 2] = np.cos(angle), np.sin(angle)
            else:
                x[joint.idx_q] = angle
        return x


def depth(solid: coal.ShapeBase, up: np.ndarray) -> float:
    """How far a primitive shape reaches below its centre, by its support function; up (3,) is vertical in its frame."""
    if isinstance(solid, coal.Sphere):
        return solid.radius
    if isinstance(solid, coal.Box):
        return float(np.abs(up) @ solid.halfSide)
    ends = abs(up[2]) * solid.halfLength
    return ends + solid.radius * (1.0 if isinstance(solid, coal.Capsule) else float(np.hypot(up[0], up[1])))


def study(folder: Path, name: str) -> str:
    urdf, tip = folder / ARMS[name][0], ARMS[name][1]
    try:
        robot = load_robot(urdf, tip=tip, unlimited=True)
        begin = time.process_time()
        made = oed.design(robot, search=oed.SearchOptions(effort="quick", workers=1))
        spent = time.process_time() - begin
    except OedError as error:
        return f"{name:15} {error}"
    judge = Judge(urdf, robot.joint_names)
    lower, upper = (np.nan_to_num(x, posinf=np.pi, neginf=-np.pi) for x in (robot.limits.lower, robot.limits.upper))
    built = judge.meet(np.random.default_rng(0).uniform(lower, upper, (RANDOM, robot.n))).mean(axis=0) > BUILT
    q = made.motion.q[::STEP]
    met = judge.meet(q)[:, ~built]
    height = judge.lowest(q[::4], True) - judge.lowest(q[:1], False)
    cond = made.optimised.cond
    worst = ""
    if met.any():
        i, j = np.array(judge.pairs)[~built][met.mean(axis=0).argmax()]
        worst = "  " + " / ".join(judge.shapes.geometryObjects[int(k)].name for k in (i, j))
    return (
        f"{name:15} {100 * met.any(axis=1).mean():9.2f} {1e3 * height:11.0f} {spent:9.1f} {cond or np.nan:9.3g}{worst}"
    )


def main() -> None:
    warnings.simplefilter("ignore")
    folder, names = Path(sys.argv[1]), sys.argv[2:] or list(ARMS)
    print(f"{'arm':15} {'collide %':>9} {'height [mm]':>11} {'time [s]':>9} {'cond(Y)':>9}")
    for name in names:
        print(study(folder, name), flush=True)


if __name__ == "__main__":
    main()
