from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from numpy.typing import NDArray

from oed.reports.rendering.palette import JOINT_COLOURS, ROLES, colour, joint_role, translucent

# Machado et al. 2009, severity 1, on linear RGB.
VISION = {
    "normal": np.eye(3),
    "deuteranope": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "protanope": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
}
XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])


def linear(value: str) -> NDArray[np.float64]:
    channels = np.array([int(value[start : start + 2], 16) for start in (1, 3, 5)]) / 255
    return np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)


def lab(light: NDArray[np.float64]) -> NDArray[np.float64]:
    ratio = XYZ @ np.clip(light, 0, 1) / [0.9505, 1.0, 1.089]
    f = np.where(ratio > 0.008856, np.cbrt(ratio), 7.787 * ratio + 16 / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def contrast(one: str, other: str) -> float:
    low, high = sorted(float(linear(value) @ XYZ[1]) for value in (one, other))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("vision", VISION)
def test_joint_colours_are_distinguished(vision: str) -> None:
    """Seven joints have seven colours; 20 in L*a*b* is far beyond what eyes confuse (about 2.3) even in thin lines."""
    seen = [lab(VISION[vision] @ linear(value)) for value in JOINT_COLOURS]
    assert min(float(np.linalg.norm(one - other)) for one, other in combinations(seen, 2)) > 20


@pytest.mark.parametrize("background", ["#ffffff", "#14181f"])
def test_colours_show_on_light_and_dark(background: str) -> None:
    """Every colour has a contrast of at least 2.4 to the white and to the dark page."""
    assert min(contrast(value, background) for value in (*JOINT_COLOURS, *ROLES.values())) > 2.4


def test_roles_give_colours() -> None:
    """Joints beyond the last colour start again, and a role can be made translucent."""
    assert colour(joint_role(8)) == colour(joint_role(1)) == "#5594FF"
    assert translucent("main", 0.5) == "rgba(85, 148, 255, 0.5)"
    with pytest.raises(KeyError):
        colour("nonsense")
