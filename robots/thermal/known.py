"""Thermal parameters that are published, by robot."""

from __future__ import annotations

from dataclasses import dataclass

from robots.robot import Robot
from robots.thermal.second_order import SecondOrder

# Thesis eq. 130, estimated on joint 4 of an er3a.
_THESIS = {"alpha": -0.0141, "beta": 0.9971, "K1": 4.41, "K2": 4.57, "C1": 737.61, "C2": 9163.45}


@dataclass(frozen=True, kw_only=True)
class KnownThermal:
    """A robot's thermal models.

    Args:
        models: of each joint, (n,).
        sources: where the parameters of each joint come from, (n,).
    """

    models: tuple[SecondOrder, ...]
    sources: tuple[str, ...]


def known_thermal(robot: Robot, *, ambient: float = 20.0) -> KnownThermal | None:
    """Gives the thermal models of a robot's joints.

    Args:
        robot: the robot.
        ambient: ambient temperature [degC].

    Returns:
        The models; None where nothing is published for this robot.
    """
    if robot.origin != "er3a" or robot.n != 6:
        return None
    model = SecondOrder(**_THESIS, ambient=ambient)
    sources = tuple(
        "thesis (eq. 130)" if joint == 4 else "assumed: that of joint 4 (thesis eq. 130)" for joint in range(1, 7)
    )
    return KnownThermal(models=(model,) * robot.n, sources=sources)
