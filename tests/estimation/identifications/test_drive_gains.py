"""Drive gains from logs, as a user has them."""

from dataclasses import replace

import numpy as np
import pytest

from estimation import identify_drive_gains
from robots.common.errors import InputError
from robots.geometry.inertia import inertial_parameters
from robots.plants import Plant, Sensors, nominal_plant, simulate
from robots.signals import Log

LOAD = inertial_parameters(1.2, [0.3, 0.05, 0.0], np.diag([0.004, 0.005, 0.003]), np.eye(4))


def loaded(plant):
    """The same plant with the payload on its last link."""
    parameters = np.array(plant.parameters)
    last = [k for k, column in enumerate(plant.model.columns) if column.term == "rigid_body"][-10:]
    parameters[last] += LOAD
    return Plant(model=plant.model, parameters=parameters, sensors=plant.sensors)


@pytest.fixture(scope="module")
def plant(arm):
    return nominal_plant(arm, sensors=Sensors())


@pytest.fixture(scope="module")
def logs(plant, fourier_motion):
    """A run without and one with the payload, on other motions."""
    return (
        simulate(plant, fourier_motion(plant.robot, 0), seed=1),
        simulate(loaded(plant), fourier_motion(plant.robot, 1), seed=2),
    )


def test_gains_are_found_from_currents_with_a_known_payload(arm, logs):
    """Torque constants of 8 and -5 N m/A come out within 2 %."""
    constant = np.asarray(arm.torque_constant)
    runs = [
        (Log(t=log.t, q=log.q, current=log.tau / constant), load) for log, load in zip(logs, (None, LOAD), strict=True)
    ]
    found = identify_drive_gains(replace(arm, torque_constant=np.full(2, np.nan)), runs, friction="coulomb-viscous")
    # The payload's torque is a fifth of the whole, and the noise a fiftieth: standard errors of some 0.5 %.
    np.testing.assert_allclose(found.gains, constant, rtol=0.02)
    with pytest.raises(InputError, match="no currents"):
        identify_drive_gains(arm, [(logs[0], None)])
