"""An effect of one's own: a hose that pulls at a joint beyond some angle.

Run it with ``python effect.py``.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import ClassVar

import casadi
import numpy as np

from estimation import diagnose, load_model
from robots import Robot, load_robot, nominal_plant, simulate
from robots.plants import plant_effect
from robots.terms.base import force_unit
from robots.terms.effects import EFFECTS, Coefficient, Shape, StaticJointEffect


class TightHose(StaticJointEffect):
    """tau = k max(q - q0, 0)^2: nothing below the angle q0, then a pull that grows."""

    name: ClassVar[str] = "tight_hose"
    title: ClassVar[str] = "tight hose"
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("free_angle", "rad", -1.5, 1.5, "linear", (-0.8, -0.4, 0.0, 0.4, 0.8)),
    )
    rivals: ClassVar[tuple[str, ...]] = ("spring",)
    experiments: ClassVar[tuple[str, ...]] = ("sweep", "static_hold")

    def parameters(self, robot: Robot, joint: int | None) -> tuple[Coefficient, ...]:
        """Describes the one linear coefficient with its unit."""
        return (Coefficient("hose_stiffness", f"{force_unit(robot, joint - 1)}/rad2"),)

    def row(self, robot: Robot, joint: int, at) -> casadi.SX:
        """Builds the torque per unit of the coefficient, from the joint's own position."""
        return casadi.fmax(at.q - at.shape[0], 0.0) ** 2

    def describe(self, joint, coefficients, shape=(), *, force="N m", length="rad") -> str:
        """Says in one sentence what these values mean."""
        return f"A hose pulls at joint {joint} beyond {shape[0]:.2f} {length}: {coefficients[0]:.3g} {force}/{length}2."


if __name__ == "__main__":
    import oed

    robot = load_robot("er3a")
    EFFECTS.register(TightHose)
    hose = plant_effect(robot, "tight_hose", 2, {"hose_stiffness": 12.0, "free_angle": 0.2})
    plant = nominal_plant(robot, friction="coulomb-viscous", effects=(hose,))
    logs = []
    for seed in (0, 1):
        search = oed.SearchOptions(
            effort=oed.Effort(islands=1, starts=1, hops=0, finish_samples=100), workers=1, seed=seed
        )
        plan = oed.TrajectoryOptions(periods=1, strokes=False)
        motion = oed.design(robot, search=search, trajectory=plan).motion
        logs.append(simulate(plant, motion, seed=seed))
    found = diagnose(robot, logs[0], held_out=logs[1], candidates=[TightHose(), "spring", "stribeck"])
    print(found.summary())
    with tempfile.TemporaryDirectory() as folder:
        found.model.save(Path(folder) / "model.json")
        again = load_model(Path(folder) / "model.json")
    for extension in again.extensions:
        print(f"the saved model has {extension.effect} on joint {extension.joint}")
    assert np.isfinite(again.values).all()
