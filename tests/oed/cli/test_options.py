"""Options that several commands share."""

from __future__ import annotations

import warnings
from pathlib import Path

import pytest

from oed.cli.options import robot_of_file
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
    assert robot_of_file(None, {"robot": "ur10"}, FILE).name == "ur10"
    assert robot_of_file("ur10", {"robot": "ur10"}, FILE).name == "ur10"
    assert robot_of_file("er3a", {}, FILE).name == "er3a"


def test_the_option_wins():
    """The option counts where the file names another robot; what that means is for each command to say."""
    assert robot_of_file("er3a", {"robot": "ur10"}, FILE).name == "er3a"


def test_a_file_without_a_robot_needs_the_option():
    """Nothing is guessed."""
    with pytest.raises(InputError, match="does not name its robot"):
        robot_of_file(None, {}, FILE)
