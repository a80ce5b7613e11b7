"""Numbers for people: no more digits than are known."""

from __future__ import annotations

import math

MINIMUM_EXPONENT = -4
"""Below 10 to this power, a number is written with an exponent."""

MAXIMUM_EXPONENT = 6
"""From 10 to this power on, a number is written with an exponent."""


def significant(value: float, error: float | None = None, *, digits: int = 4) -> str:
    """Rounds a value to two digits of its standard error, or to a number of digits.

    Args:
        value: the value; NaN and infinities have words of their own.
        error: its standard error in the same unit; None, zero, NaN or infinite where it is not known.
        digits: how many digits stay where there is no error.

    Returns:
        The value, such as "12.346" for 12.34567 with an error of 0.034.
    """
    if not math.isfinite(value):
        return _word(value)
    if error is None or not math.isfinite(error) or error <= 0.0:
        return _without_error(value, digits)
    size = _leading_place(float(f"{error:.1e}"))
    place = size - 1  # the decimal place of the error's second digit
    rounded = round(value, -place)
    leading = max(_leading_place(rounded), size) if rounded else size
    if MINIMUM_EXPONENT <= leading < MAXIMUM_EXPONENT:
        return f"{_positive_zero(rounded):.{max(-place, 0)}f}"
    # As many digits as reach down to the place of the error.
    return _exponential(rounded, max(_leading_place(rounded) - place, 0) if rounded else 0)


def significant_error(error: float) -> str:
    """Rounds a standard error to two digits.

    Args:
        error: the standard error; NaN or infinite where it is not known.

    Returns:
        The error, such as "0.034".
    """
    if not math.isfinite(error):
        return _word(error)
    if error <= 0.0:
        return "0"
    return significant(error, error)


def with_error(value: float, error: float, unit: str = "") -> str:
    """Writes a value with its standard error and unit, such as "12.346 ± 0.034 kg".

    Args:
        value: the value.
        error: its standard error; NaN where it is not known.
        unit: the unit of both.
    """
    text = f"{significant(value, error)} ± {significant_error(error)}" if math.isfinite(error) else significant(value)
    return f"{text} {unit}".rstrip()


def percent(fraction: float, digits: int = 3) -> str:
    """Writes a fraction in percent, such as "3.42 %" for 0.0342.

    Args:
        fraction: the fraction.
        digits: significant digits.
    """
    return f"{significant(100.0 * fraction, digits=digits)} %" if math.isfinite(fraction) else _word(fraction)


def _without_error(value: float, digits: int) -> str:
    if value == 0.0:
        return "0"
    leading = _leading_place(float(f"{value:.{digits - 1}e}"))
    if leading < MINIMUM_EXPONENT or leading >= MAXIMUM_EXPONENT:
        return _exponential(value, digits - 1)
    return f"{value:.{max(digits - 1 - leading, 0)}f}"


def _leading_place(value: float) -> int:
    """The power of ten of the first digit."""
    return int(f"{abs(value):.15e}".split("e")[1])


def _exponential(value: float, decimals: int) -> str:
    mantissa, exponent = f"{_positive_zero(value):.{decimals}e}".split("e")
    return f"{mantissa}e{int(exponent)}"


def _positive_zero(value: float) -> float:
    return value + 0.0 if value else 0.0


def _word(value: float) -> str:
    if math.isnan(value):
        return "–"
    return "∞" if value > 0.0 else "-∞"
