"""Numbers as plain data and in sentences: unknown or infinite numbers become null in JSON."""

from __future__ import annotations

import math
from collections.abc import Iterable


def finite(value: float) -> float | None:
    """Gives None for what JSON has no number for."""
    return float(value) if math.isfinite(value) else None


def all_finite(values: Iterable[float]) -> list[float | None]:
    """Does what `finite` does to each."""
    return [finite(value) for value in values]


def number(value: float | None, missing: float = math.nan) -> float:
    """Gives back what `finite` made None."""
    return missing if value is None else float(value)


def two_digits(value: float) -> str:
    """Writes a number with two significant digits, as people do: 100 and not 1e+02."""
    return f"{float(f'{value:.2g}'):g}"


def percent(share: float) -> str:
    """Writes a share in per cent with two significant digits."""
    return f"{two_digits(100 * share)} %"


def several(count: int, noun: str) -> str:
    """Writes how many there are of something, such as ``1 run`` or ``2 runs``."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def place_of(joints: Iterable[int | None]) -> str:
    """Names joints in a sentence, such as "joints 4 and 5"; the robot where none is known.

    Args:
        joints: counted from 1; None for the whole robot.
    """
    known = sorted({joint for joint in joints if joint is not None})
    return joints_in_words(known) if known else "the robot"


def joints_in_words(numbers: Iterable[int | str]) -> str:
    """Names joints by their numbers: ``joint 2``, or ``joints 1, 2 and 4``."""
    *first, last = map(str, numbers)
    return f"joints {', '.join(first)} and {last}" if first else f"joint {last}"


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


def rounded_percent(fraction: float, digits: int = 3) -> str:
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


def as_html(text: str) -> str:
    """Writes a text as a notebook shows it.

    Args:
        text: of one or more lines.
    """
    from html import escape

    return f"<pre>{escape(text)}</pre>"
