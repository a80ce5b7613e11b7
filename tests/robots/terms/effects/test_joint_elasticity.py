"""Specification of the link that swings on a gear."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from robots import load_robot
from robots.terms.effects import EFFECTS
from robots.terms.effects.joint_elasticity import LARGEST_STIFFNESS_RATIO, SCANNED, followed, least_inertia


def test_a_wrist_whose_inertia_is_fitted_negative_swings_all_the_same() -> None:
    """An inertia that errs by more than it is makes no link run away: the load passes, in other poses too."""
    wrong = 0.01 * np.sin(np.linspace(0, 20, 5000))[:, None, None]
    situation = SimpleNamespace(
        sensitivity=lambda name: wrong, rotors=np.zeros((2, 1)), runs=(slice(0, 5000),), period=0.004
    )
    inertia = least_inertia(situation, 1)  # type: ignore[arg-type]
    assert inertia.min() >= 0.02 * inertia.max() > 0
    load = np.cos(np.linspace(0, 60, 5000))
    for resonance in SCANNED:
        stiffness = (2 * np.pi * resonance) ** 2 * float(inertia.mean())
        assert np.abs(followed(situation, load, stiffness, inertia)).max() < 20.0  # type: ignore[arg-type]


def test_a_gear_has_one_stiffness() -> None:
    """What winds up by one stiffness and swings by another, far from it, is no gear."""
    gear, robot = EFFECTS["joint_elasticity"], load_robot("ur10")
    compliance = np.array([1e-4])
    assert gear.is_plausible(robot, 2, compliance, (1e4, 0.0, 0.05))
    assert gear.is_plausible(robot, 2, compliance, (0.9 * LARGEST_STIFFNESS_RATIO * 1e4, 0.0, 0.05))
    for ratio in (1.1 * LARGEST_STIFFNESS_RATIO, 1 / (1.1 * LARGEST_STIFFNESS_RATIO)):
        assert not gear.is_plausible(robot, 2, compliance, (ratio * 1e4, 0.0, 0.05))
