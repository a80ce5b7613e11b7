"""One campaign of a catalogue robot and small ones of a two-joint arm, made once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import oed
from oed.campaigns import Campaign, Programme
from oed.controllers.clients import ending
from oed.controllers.recording import recorder
from oed.experiments import Design, Effort, Ipopt
from robots.geometry.chain import Chain, Joint
from robots.limits import Limits
from robots.loading import load_robot
from robots.robot import Robot
from tests.oed import flat

TINY = Effort(islands=1, starts=1, screened=10, hops=0, finish_samples=100)
BRIEF = Ipopt(max_iter=15, finish_iter=10)


@pytest.fixture(autouse=True)
def _impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """The controller of the tests runs faster than real time."""
    monkeypatch.setattr(recorder, "FEEDBACK_TRIAL_TIME", 0.1)
    monkeypatch.setattr(ending, "STANDING_TIME", 0.1)


@pytest.fixture(scope="session")
def er3a() -> Robot:
    return load_robot("er3a")


@pytest.fixture(scope="session")
def er3a_design(er3a: Robot) -> Design:
    """A design that keeps its limits and is worth little."""
    return flat.design(er3a, friction="coulomb-viscous", effort=TINY, solver=BRIEF, workers=1)


@pytest.fixture(scope="session")
def thesis_campaign(er3a: Robot, er3a_design: Design) -> Campaign:
    """The campaign by default: 24 cycles of 5 min."""
    return oed.campaign(er3a, design=er3a_design)


@pytest.fixture(scope="session")
def saved(thesis_campaign: Campaign, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the campaign by default."""
    folder = tmp_path_factory.mktemp("campaign")
    thesis_campaign.save(folder)
    return folder


def arm(**changes: object) -> Robot:
    """Two joints: a vertical axis, and a horizontal one."""
    identity, origin = np.eye(3), np.array([0.0, 0.0, 0.3])
    turned = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    axis = np.array([0.0, 0.0, 1.0])
    limits = {
        "lower": np.full(2, -2.0),
        "upper": np.full(2, 2.0),
        "velocity": np.full(2, 2.0),
        "acceleration": np.full(2, 10.0),
        "jerk": np.full(2, 200.0),
        "torque": np.full(2, 200.0),
    }
    inertia = np.array([[5.0, 0.1, 0, 0.5, 0.1, 0, 0, 0.1, 0, 0.03], [3.0, 0.6, 0, 0, 0.01, 0, 0, 0.16, 0, 0.16]])
    return Robot(
        name="two",
        chain=Chain(
            (Joint("lift", "revolute", identity, origin, axis), Joint("swing", "revolute", turned, origin, axis))
        ),
        limits=Limits(**{**limits, **changes}),
        inertia=inertia,
        friction=np.array([[4.0, 3.0, 0.5, 0.1], [3.0, 2.0, 0.0, 0.0]]),
    )


@pytest.fixture(scope="session")
def two() -> Robot:
    return arm()


@pytest.fixture(scope="session")
def two_design(two: Robot) -> Design:
    return flat.design(two, effort=TINY, solver=BRIEF, periods=1, workers=1)


@pytest.fixture(scope="session")
def brief() -> Programme:
    """Few and short cycles of every kind."""
    return Programme(cycles=2, cycle_time=80.0, warm_up=30.0, duties=(0.2, 1.0), cooling=2, power_on=100.0, plateau=0.3)


@pytest.fixture(scope="session")
def small_campaign(two: Robot, two_design: Design, brief: Programme) -> Campaign:
    """Power-on test, two runs of heating and cooling."""
    return oed.campaign(two, design=two_design, programme=brief)
