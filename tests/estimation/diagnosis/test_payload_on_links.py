"""A weight on any link is found on that link, on a plant of pinocchio."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import robots
from estimation import diagnose
from robots import load_robot
from robots.signals import Log

pin = pytest.importorskip("pinocchio")

MASS, CENTRE, MOMENT = 2.0, np.array([0.03, 0.05, 0.2]), 12.0


def _log(link: int, centre: np.ndarray = CENTRE) -> Log:
    """A log of 30 s in which a weight is fixed to a link at 12 s; that on the last link has no inertia of its own."""
    rng = np.random.default_rng(1)
    model = pin.buildModelFromUrdf(str(Path(robots.__file__).parent / "catalog" / "ur10.urdf"))
    for k in range(1, model.njoints):
        own = model.inertias[k]
        model.inertias[k] = pin.Inertia(own.mass * rng.uniform(0.85, 1.15), own.lever, own.inertia)
    loaded = model.copy()
    loaded.inertias[link] = loaded.inertias[link] + pin.Inertia(MASS, centre, 0.004 * np.eye(3) * (link < 6))
    t = np.arange(7500) * 0.004
    w = 2 * np.pi * 0.08 * (np.arange(1, 7) + 0.3 * rng.uniform(-1, 1, 6))
    (a, b), phase = rng.normal(size=(2, 6, 6)), np.outer(t, w)
    s, c = np.sin(phase), np.cos(phase)
    q, dq, ddq = s @ (a / w[:, None]) - c @ (b / w[:, None]), c @ a + s @ b, c @ (b * w[:, None]) - s @ (a * w[:, None])
    size = np.array([1.3, 0.7, 1.0, 1.3, 1.3, 1.6]) / np.abs(q).max(axis=0)
    q, dq, ddq = np.array([0, -1.4, 0.6, -0.5, 0.6, 0]) + q * size, dq * size, ddq * size
    data = model.createData(), loaded.createData()
    tau = np.array(
        [
            pin.rnea(*((loaded, data[1]) if time >= MOMENT else (model, data[0])), *state)
            for time, *state in zip(t, q, dq, ddq, strict=True)
        ]
    )
    tau += np.array([9, 10, 6, 1.5, 1.2, 1]) * np.tanh(dq / 1e-3) + dq * np.array([12, 15, 9, 2, 2, 1.5])
    return Log(t=t, q=q, tau=tau + rng.normal(size=tau.shape) * 0.015 * tau.std(axis=0), name="weight")


@pytest.mark.slow
@pytest.mark.parametrize("link", [2, pytest.param(3, marks=pytest.mark.longer)])
def test_a_weight_on_a_link_is_found_there(link: int) -> None:
    """The link, the mass, the centre of mass and the time of the change are those of pinocchio's weight."""
    found = diagnose(load_robot("ur10"), _log(link)).findings
    assert [(f.effect, f.joint) for f in found] == [("payload_change", None)]
    assert f"on link {link} increased" in found[0].sentence
    values = {p.name: p for p in found[0].parameters}
    assert values["link"].value == link
    assert values["link"].determined
    # A vertical first axis does not show how heavy the second link is, only its moments about joint 2.
    truth = {f"moment_change_{k}": MASS * x for k, x in zip("xyz", CENTRE, strict=True)} if link > 2 else {}
    truth |= {"mass_change": MASS} if link > 2 else {}
    for name, true in {**truth, "change_time": MOMENT}.items():
        low, high = values[name].ci95
        assert low <= true <= high, name


@pytest.mark.longer
def test_a_weight_that_may_be_on_two_bodies_is_on_the_flange() -> None:
    """A weight on the axis of the last joint fits on the link before it as well: the flange comes first."""
    found = diagnose(load_robot("ur10"), _log(6, np.array([0.0, 0.1, 0.0]))).findings
    assert [(f.effect, f.joint) for f in found] == [("payload_change", None)]
    assert "The payload increased by" in found[0].sentence
    assert "link" not in {p.name for p in found[0].parameters}
    (mass,) = (p for p in found[0].parameters if p.name == "mass_change")
    assert mass.ci95[0] <= MASS <= mass.ci95[1]
