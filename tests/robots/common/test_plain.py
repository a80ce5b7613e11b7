"""Specification of numbers as plain data."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from robots.common.plain import all_finite, finite, number, percent, two_digits


def test_what_json_has_no_number_for_is_null_and_comes_back() -> None:
    """Files stay valid JSON (RFC 8259 knows neither NaN nor Infinity), whatever numpy's types were."""
    values = np.array([1.5, np.nan, np.inf, -np.inf], dtype=np.float32)
    text = json.dumps(all_finite(values), allow_nan=False)
    assert text == "[1.5, null, null, null]"
    assert [number(v, math.inf) for v in json.loads(text)] == [1.5, math.inf, math.inf, math.inf]
    assert math.isnan(number(finite(math.nan)))
    assert number(finite(2)) == pytest.approx(2.0)


def test_two_digits_have_no_exponent() -> None:
    """Sentences have 100 % and 1200, not 1e+02 % and 1.2e+03."""
    shares = (1.0, 0.9996, 12.34, 0.0567, 0.00012)
    assert [percent(share) for share in shares] == ["100 %", "100 %", "1200 %", "5.7 %", "0.012 %"]
    assert two_digits(-0.4567) == "-0.46"
