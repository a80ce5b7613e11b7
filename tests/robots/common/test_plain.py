"""Specification of numbers as plain data."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from robots.common.plain import all_finite, finite, number


def test_what_json_has_no_number_for_is_null_and_comes_back() -> None:
    """Files stay valid JSON (RFC 8259 knows neither NaN nor Infinity), whatever numpy's types were."""
    values = np.array([1.5, np.nan, np.inf, -np.inf], dtype=np.float32)
    text = json.dumps(all_finite(values), allow_nan=False)
    assert text == "[1.5, null, null, null]"
    assert [number(v, math.inf) for v in json.loads(text)] == [1.5, math.inf, math.inf, math.inf]
    assert math.isnan(number(finite(math.nan)))
    assert number(finite(2)) == pytest.approx(2.0)
