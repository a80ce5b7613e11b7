"""What commands write, and where."""

from __future__ import annotations

import warnings

import numpy as np

from oed.cli.console import Console
from robots.common.errors import AssumedValueWarning


def test_warnings_of_ours_are_notes_and_those_of_libraries_are_not(capsys) -> None:
    """An assumption is for the reader; an overflow in a library is for a developer's log."""
    with Console().working():
        warnings.warn("a value is assumed", AssumedValueWarning, stacklevel=1)
        np.array([1e300]) * np.array([1e300])
        warnings.warn("this will be removed", DeprecationWarning, stacklevel=1)
    assert capsys.readouterr().err == "note: a value is assumed\n"


def test_quiet_shows_no_notes(capsys) -> None:
    """With --quiet there is nothing but errors."""
    with Console(quiet=True).working():
        warnings.warn("a value is assumed", AssumedValueWarning, stacklevel=1)
    assert capsys.readouterr().err == ""
