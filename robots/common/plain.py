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


def joints_in_words(numbers: Iterable[int | str]) -> str:
    """Names joints by their numbers: ``joint 2``, or ``joints 1, 2 and 4``."""
    *first, last = map(str, numbers)
    return f"joints {', '.join(first)} and {last}" if first else f"joint {last}"
