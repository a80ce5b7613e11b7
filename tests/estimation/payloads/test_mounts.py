"""A payload on a link before the flange."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from estimation.payloads import identify_payload, load_payload, read_body
from estimation.payloads.identification import _elsewhere
from estimation.payloads.mounts import Mount
from oed.benchmarks.truth.machines import draw_machine
from oed.benchmarks.truth.noise import draw_noise
from oed.benchmarks.truth.plant import play
from oed.benchmarks.truth.references import draw_periodic
from robots import load_robot
from robots.common.errors import InputError, NotIdentifiableError
from robots.signals import Log
from tests.estimation.payloads.conftest import Experiment

FOREARM, MASS, CENTRE, INERTIA = 3, 2.5, np.array([0.25, 0.03, 0.06]), np.diag([0.004, 0.02, 0.02])


@pytest.fixture(scope="module")
def loaded() -> Log:
    """The path of the free log with a body on the forearm, and noise of its own."""
    rng = np.random.default_rng(54)
    # The machine, noise and path of the experiment: its first draws.
    machine = draw_machine("ur10", rng)
    noise = draw_noise(machine.n, machine.gear, rng)
    path = draw_periodic(machine, rng, cycles=2)
    model = pin.Model(machine.model)
    model.inertias[FOREARM] += pin.Inertia(MASS, CENTRE, INERTIA)
    (record,) = play(replace(machine, model=model), [path], [], noise, np.random.default_rng(7))
    return Log(t=record.t + 100.0, q=record.q, tau=record.tau)


@pytest.mark.slow
def test_a_body_on_the_forearm_is_found_there(experiment: Experiment, loaded: Log, tmp_path: Path) -> None:
    """Mass, centre and inertia hold within four standard errors, in the frame of the link, and survive their file."""
    found = identify_payload(
        loaded, robot=experiment.robot, without=experiment.free, model=experiment.estimate, link=FOREARM
    )
    assert found.link == FOREARM
    truth = [MASS, *CENTRE, *INERTIA[np.triu_indices(3)]]
    for item, value in zip(found.quantities, truth, strict=True):
        assert abs(item.unconstrained - value) < 4.0 * item.half_width / 1.96 + 1e-6, item.name
    assert found.quantities[0].half_width < 0.1 * MASS
    assert "on link 3, in its frame" in found.summary()
    found.save(tmp_path)
    assert load_payload(tmp_path).summary() == found.summary()
    with pytest.raises(InputError, match="on link 3"):
        read_body(str(tmp_path))


@pytest.mark.slow
def test_the_flange_does_not_explain_it(experiment: Experiment, loaded: Log) -> None:
    """A body on the forearm has no mass on the flange: the logs are refused, and another link is suggested."""
    with pytest.raises(NotIdentifiableError, match="--link"):
        identify_payload(loaded, robot=experiment.robot, without=experiment.free, model=experiment.estimate)


def test_a_link_that_is_not_there_is_refused() -> None:
    """Links count from 1 by the joint that moves them."""
    ur10 = load_robot("ur10")
    with pytest.raises(InputError, match="link 7"):
        Mount(ur10, 7)
    assert Mount(ur10, 6).joints == 6
    np.testing.assert_array_equal(Mount(ur10, 2).pose, np.eye(4))


def test_logs_that_differ_without_a_payload_on_the_flange_say_so() -> None:
    """Six times the error on one joint is no body on the flange; errors as before are nothing."""
    ur10 = load_robot("ur10")
    known: Any = SimpleNamespace(provenance={"residual_rms": [1.0] * 6, "torque_rms": [50.0] * 6})
    rms, errors = np.full(6, 50.0), np.array([1.0, 6.0, 1.0, 1.0, 1.0, 1.0])
    (text,) = _elsewhere(Mount(ur10), known, rms, errors)
    assert "joint 2 is 6 times" in text
    assert "--link" in text
    assert _elsewhere(Mount(ur10), known, rms, np.ones(6)) == []
