"""The arm of these tests, its baseline and a monitor."""

from __future__ import annotations

import pytest

from estimation.monitoring import Monitor, MonitorSettings, baseline_of
from tests.estimation.monitoring.arm import Arm


@pytest.fixture(scope="session")
def arm(tmp_path_factory):
    """The arm, made once."""
    return Arm(tmp_path_factory.mktemp("arm"))


@pytest.fixture(scope="session")
def baseline(arm):
    """Its model as a baseline; the compiled regressor is shared."""
    return baseline_of(arm.model)


@pytest.fixture
def monitor(baseline):
    """A new monitor without heat: the arm of these tests does not warm up."""
    return Monitor(baseline, MonitorSettings(heat="none"))
