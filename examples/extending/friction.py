"""A friction term of one's own: viscous friction that saturates, as that of a worm gear does.

Run it with ``python friction.py``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi
import numpy as np

from estimation import identify
from robots import Plant, default_model, load_robot, simulate
from robots.terms import TERMS, FrictionTerm


@TERMS.register
@dataclass(frozen=True, kw_only=True)
class SaturatingFriction(FrictionTerm):
    """tau_j = c sign(dq_j) + s dq_j / sqrt(1 + (dq_j / v1)^2), linear in c and s.

    Attributes:
        saturation: v1, the speed at which the second part levels off [rad/s or m/s].
    """

    name: ClassVar[str] = "saturating_friction"
    saturation: float = 1.0

    def units(self, force: str, length: str) -> dict[str, str]:
        """Gives the parameters of one joint with their units."""
        return {"c": force, "s": f"{force} s/{length}"}

    def row(self, dq: casadi.SX, sign: casadi.SX, scale: float) -> casadi.SX:
        """Builds the columns (1, 2) of one joint."""
        return casadi.horzcat(sign, dq / casadi.sqrt(1 + (dq / self.saturation) ** 2))

    def nominal(self, robot) -> np.ndarray:
        """Takes Coulomb and viscous friction of the robot's description as a first guess."""
        return robot.friction[:, :2].reshape(-1)


if __name__ == "__main__":
    import oed

    robot, term = load_robot("er3a"), SaturatingFriction(saturation=0.8)
    design = oed.design(
        robot,
        model=oed.ModelOptions(friction=term),
        trajectory=oed.TrajectoryOptions(periods=1, strokes=False),
        search=oed.SearchOptions(effort=oed.Effort(islands=1, starts=1, hops=0, finish_samples=100), workers=1),
    )
    model = default_model(robot, friction=term, velocity_scale=1e-3)
    plant = Plant(model=model, parameters=np.nan_to_num(model.nominal))
    log = simulate(plant, design.motion, seed=1)
    for friction in (term, "coulomb-viscous"):
        estimate = identify(robot, log, friction=friction)
        level = np.mean([joint.residual_rms / joint.torque_rms for joint in estimate.joints])
        print(f"{friction if isinstance(friction, str) else friction.name}: {100 * level:.2f} % residual")
