"""The figures of the benchmark: right names, intervals that hold the truth, widths against an oracle's fit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

Row = dict[str, Any]

# Parameter of each effect that states the plant's size.
STATED = {
    "backlash": "gap_crossed",
    "joint_elasticity": "compliance",
    "base_compliance": "compliance_1",
    "spring": "stiffness",
}
QUANTILE = 1.96


def is_right(row: Row) -> bool:
    """Returns whether the first finding is the hidden effect, at its joint."""
    if not row["findings"]:
        return False
    first = row["findings"][0]
    return bool(first["effect"] == row["kind"] and first["joint"] in (None, row["place"]))


def stated(row: Row) -> tuple[float, float, float] | None:
    """Returns the estimate of the plant's size and its 95 % interval; None if it is not named."""
    if not is_right(row) or row["kind"] not in STATED:
        return None
    name = STATED[row["kind"]]
    if row["kind"] == "base_compliance":  # the softer axis
        name = "compliance_2" if row["place"] == 3 else "compliance_1"
    for parameter in row["findings"][0]["parameters"]:
        if parameter["name"] == name:
            low, high = parameter["ci95"]
            low, high = (-np.inf if low is None else low), (np.inf if high is None else high)
            return parameter["value"], low, high
    return None


def figures(rows: Sequence[Row]) -> str:
    """Writes the table, one line per effect."""
    head = "effect             cases  right name  alone  interval holds  error, median  width over the oracle's, median"
    lines = [head]
    for kind in sorted({row["kind"] for row in rows}):
        own = [row for row in rows if row["kind"] == kind]
        if kind == "none":
            lines.append(f"{'none':18} {len(own):5}  {sum(not row['findings'] for row in own):10}")
            continue
        right = [row for row in own if is_right(row)]
        alone = [row for row in right if len(row["findings"]) == 1]
        values = [(row, value) for row in right if (value := stated(row)) is not None]
        holds = sum(low <= row["amount"] <= high for row, (_, low, high) in values)
        errors = [value / row["amount"] - 1 for row, (value, *_) in values]
        widths = [(high - low) / (2 * QUANTILE * row["oracle"]) for row, (_, low, high) in values]
        lines.append(
            f"{kind:18} {len(own):5}  {len(right):10}  {len(alone):5}  {holds:6} of {len(values):4}  "
            f"{_percent(errors):>13}  {np.median(widths) if widths else np.nan:8.1f}"
        )
    return "\n".join(lines)


def _percent(errors: Sequence[float]) -> str:
    return f"{100 * np.median(errors):+.0f} %" if errors else "-"
