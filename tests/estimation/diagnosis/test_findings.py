"""Tests of the text of a finding's parameters."""

from __future__ import annotations

import numpy as np
import pytest

from estimation.diagnosis.findings import MOST_LISTED, Parameter, list_parameters


@pytest.mark.parametrize(
    ("value", "ci95", "unit", "reported"),
    [
        (0.5, (0.4, 0.6), "N m", "size (0.4 to 0.6 N m)"),
        (320.0, (319.967, 320.033), "periods per turn", "size (319.97 to 320.03 periods per turn)"),
        (41.2574, (41.25738, 41.25742), "s", "size (41.25738 to 41.25742 s)"),
        (0.0, (-1e-9, 1e-9), "1", "size (-1e-09 to 1e-09)"),
        (1.0, (1.0, 1.0), "", "size = 1"),
        (0.0, (0.0, 0.0), "s", "size = 0 s"),
        (3.0, (-np.inf, np.inf), "N m", "size"),
    ],
)
def test_both_ends_of_an_interval_are_distinguished(value: float, ci95: tuple, unit: str, reported: str) -> None:
    """An interval has enough digits to distinguish its ends; choices and undetermined values have no interval."""
    parameter = Parameter(name="size", value=value, unit=unit, standard_error=1.0, ci95=ci95, determined=True)
    assert parameter.text == reported


def test_a_summary_lists_no_more_parameters_than_a_line_holds() -> None:
    """A summary lists a limited number of parameters, and the number of further ones."""
    names = [f"place_{k}" for k in range(12)]
    assert list_parameters(names[:MOST_LISTED]) == ", ".join(names[:MOST_LISTED])
    assert list_parameters(names[: MOST_LISTED + 1]) == ", ".join(names[: MOST_LISTED + 1])
    assert list_parameters(names) == ", ".join(names[:MOST_LISTED]) + ", and 4 more in diagnosis.json"
