"""Options that several commands share."""

from __future__ import annotations

import warnings
from pathlib import Path

import pytest

from oed.cli.options.robots import FileRobot
from robots.common.errors import AssumedValueWarning, InputError

FILE = Path("trajectory.csv")


@pytest.fixture(autouse=True)
def only_notes_on_robots():
    """Assumed values of the catalogue's robots are no subject here."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AssumedValueWarning)
        yield


def test_the_file_names_its_robot():
    """Without an option the file's robot counts."""
    assert FileRobot(robot="").load_for({"robot": "ur10"}, FILE).name == "ur10"
    assert FileRobot(robot="ur10").load_for({"robot": "ur10"}, FILE).name == "ur10"
    assert FileRobot(robot="er3a").load_for({}, FILE).name == "er3a"


def test_the_option_wins():
    """The option counts where the file names another robot; what that means is for each command to say."""
    assert FileRobot(robot="er3a").load_for({"robot": "ur10"}, FILE).name == "er3a"


def test_a_file_without_a_robot_needs_the_option():
    """Nothing is guessed."""
    with pytest.raises(InputError, match="does not name its robot"):
        FileRobot(robot="").load_for({}, FILE)
