"""Shares with their intervals, and the figures that the rows of a benchmark give."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from estimation.uncertainty.quantiles import share_interval

Row = dict[str, Any]

# A gain smaller than this share of the error before is lost in the noise of the unseen log.
LEAST_GAIN = 0.01
CHANGE_TIME, NONLINEAR = 0.2, 0.2
# Names of the truth's parameters, and those a diagnosis gives them.
TIMES = {"change_time": ("change_time",), "start": ("start", "change_time")}
SHAPES = {
    "stribeck_velocity": ("stribeck_velocity",),
    "presliding_distance": ("presliding_travel",),
    "time_constant": ("time_constant",),
    "order": ("order",),
    "delay": ("delay",),
    "limit": ("level",),
    "driven_back": ("driven_back",),
}


def share(name: str, rows: Iterable[Row], hit: Callable[[Row], bool], target: str) -> str:
    """One line: hits of tries, the share, its interval and what is asked for."""
    values = [bool(hit(row)) for row in rows]
    if not values:
        return f"  {name:58} no case                                 wanted {target}"
    hits, tries = sum(values), len(values)
    low, high = share_interval(hits, tries)
    counted = f"{hits} of {tries}"
    return (
        f"  {name:58} {counted:>12} {100 * hits / tries:6.1f} % [{100 * low:5.1f}, {100 * high:5.1f}]  wanted {target}"
    )


def detected(row: Row) -> bool:
    """Whether anything was said."""
    return bool(row["verdict"] != "none")


def first_is_right(row: Row) -> bool:
    """Whether the first finding is a hidden effect on its joint."""
    return bool(row["findings"]) and _pair(row["findings"][0]) in [_pair(e) for e in row["truth"]]


def named_right(row: Row) -> bool:
    """Whether the verdict is ``named`` or ``ambiguous`` and the first finding is right."""
    return row["verdict"] in ("named", "ambiguous") and first_is_right(row)


def in_the_set(row: Row) -> bool:
    """Whether the truth is the first finding or among its rivals."""
    if not row["findings"]:
        return False
    first = row["findings"][0]
    names = {first["effect"], *(rival[0] for rival in first.get("rivals") or ())}
    return first_is_right(row) or any(effect["effect"] in names for effect in row["truth"])


def both(row: Row) -> bool:
    """Whether every hidden effect is found on its joint."""
    found = [_pair(finding) for finding in row["findings"]]
    return all(_pair(effect) in found for effect in row["truth"])


def spurious(row: Row) -> bool:
    """Whether something is named that is not there."""
    true = [_pair(effect) for effect in row["truth"]]
    return any(_pair(finding) not in true and finding["effect"] != "unexplained" for finding in row["findings"])


def within_limits(row: Row) -> bool:
    """Whether each hidden effect is as large as the smallest that its own report says it would have shown."""
    stated = [
        [limit["detectable"] for limit in row.get("limits") or () if _pair(limit) == _pair(effect)]
        for effect in row["truth"]
    ]
    return all(
        any(size is not None and effect["visible"] >= size for size in sizes)
        for effect, sizes in zip(row["truth"], stated, strict=True)
    )


def gain_ratios(rows: Iterable[Row], oracle: str = "oracle_after") -> np.ndarray:
    """Gain over the gain of the true effects' own model, one at most, where that is more than noise and they last.

    Gains are of mean squared errors over mean squared torque, summed over the joints. The diagnosis' gain counts from
    its own base model, with the motion as measured; the true effects' from least squares with the motion as it was, or
    on a joint from the diagnosis' base model where that is better there.

    Args:
        rows: of the benchmark.
        oracle: ``oracle_after``, which knows the motion that the effects act by, or ``oracle_as_measured``, which has
            their formulas and the positions that were logged.
    """
    ratios = []
    for row in rows:
        if not detected(row) or row.get(oracle) is None or not all(e["lasting"] for e in row["truth"]):
            continue
        reported, start = np.array(row["before"]), np.minimum(row["before"], row["oracle_before"])
        possible = float(np.maximum(start - row[oracle], 0.0).sum())
        if possible > LEAST_GAIN * float(start.sum()):
            ratios.append(min(float((reported - row["after_extension"]).sum()) / possible, 1.0))
    return np.array(ratios)


def errors_left(rows: Iterable[Row]) -> np.ndarray:
    """Squared unseen error with what was found over that of least squares with the true effects' own torque."""
    able = (row for row in rows if detected(row) and row.get("oracle_after") is not None)
    return np.array([np.sum(row["after_extension"]) / np.sum(row["oracle_after"]) for row in able])


def file_over_reported(rows: Iterable[Row]) -> np.ndarray:
    """Unseen error of each joint by the model's file over what the diagnosis says of it, where something was found."""
    able = (row for row in rows if row["findings"] and row.get("by_file") is not None)
    return np.array(
        [
            np.sqrt(file / reported)
            for row in able
            for file, reported in zip(row["by_file"], row["after_extension"], strict=True)
            if np.isfinite(reported) and reported > 0
        ]
    )


def parameter_errors(rows: Iterable[Row], wanted: dict[str, tuple[str, ...]]) -> list[dict[str, Any]]:
    """Errors of parameters of effects rightly found: absolute, relative, and whether the interval holds the truth."""
    errors = []
    for row in rows:
        for effect in row["truth"]:
            for finding in row["findings"]:
                if _pair(finding) != _pair(effect):
                    continue
                reported = {p["name"]: p for p in finding["parameters"] or ()}
                for name, value in effect["parameters"].items():
                    match = next((reported[n] for n in wanted.get(name, ()) if n in reported), None)
                    if match is None:
                        continue
                    low, high = match.get("ci95") or (None, None)
                    absolute = abs(float(match["value"]) - value)
                    errors.append(
                        {
                            "key": row["key"],
                            "effect": effect["effect"],
                            "name": name,
                            "absolute": absolute,
                            "relative": absolute / max(abs(value), 1e-12),
                            "stated": low is not None and high is not None,
                            "inside": low is not None and high is not None and low <= value <= high,
                            "marked": not match["determined"],
                        }
                    )
    return errors


def _pair(entry: Row) -> tuple[str, int | None]:
    return entry["effect"], entry["joint"]
