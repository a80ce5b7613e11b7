from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from oed.reports import rounded_percent, significant, significant_error, with_error


@pytest.mark.parametrize(
    ("value", "error", "expected"),
    [
        (12.34567, 0.0342, "12.346"),
        (12.34567, 3.42, "12.3"),
        (12345.6, 342.0, "12350"),
        (-0.0001, 0.5, "0.00"),
        (0.0, 0.012, "0.000"),
        (9.9996, 0.0099, "9.9996"),
        (9.96, 0.0996, "9.96"),
        (3.2e-7, 1.4e-8, "3.20e-7"),
        (1.23456e9, 4.5e6, "1.2346e9"),
    ],
)
def test_value_ends_at_the_second_digit_of_its_error(value: float, error: float, expected: str) -> None:
    """A value shows as many digits as its standard error has, counted to the error's second."""
    assert significant(value, error) == expected


@pytest.mark.parametrize(
    ("value", "expected"),
    [(41.267, "41.27"), (0.0, "0"), (99999.6, "100000"), (9999.96, "10000"), (1.5e-5, "1.500e-5"), (2e6, "2.000e6")],
)
def test_value_without_error_has_four_digits(value: float, expected: str) -> None:
    """A value of unknown error shows four digits, with an exponent where zeros would fill the cell."""
    assert significant(value) == expected


def test_words_for_what_is_no_number() -> None:
    """NaN is a dash and infinity its sign; an unknown error leaves the value alone."""
    assert [significant(value) for value in (math.nan, math.inf, -math.inf)] == ["–", "∞", "-∞"]
    assert significant(1.23456, math.nan) == "1.235"
    assert significant_error(math.nan) == "–"
    assert with_error(1.23456, math.nan, "kg") == "1.235 kg"


def test_error_has_two_digits() -> None:
    """A standard error shows two digits, and a value is written with it."""
    assert [significant_error(error) for error in (0.0342, 0.0996, 12.0, 0.0)] == ["0.034", "0.10", "12", "0"]
    assert with_error(12.34567, 0.0342, "kg") == "12.346 ± 0.034 kg"
    assert rounded_percent(0.0342) == "3.42 %"


@pytest.mark.slow
@given(
    st.floats(-1e8, 1e8).filter(lambda value: value == 0 or abs(value) > 1e-8),
    st.floats(1e-9, 1e6),
)
def test_rounding_stays_within_a_twentieth_of_the_error(value: float, error: float) -> None:
    """Reading the text back gives the value to half of the error's second digit, which is at most 0.05 errors."""
    assert float(significant(value, error)) == pytest.approx(value, abs=0.0501 * error, rel=1e-14)
    assert float(significant_error(error)) == pytest.approx(error, rel=0.0501)
