"""The entry of one case in a file of answers, checked key by key."""

from __future__ import annotations

import math
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from oed.benchmarks.answers.answer import VERDICTS, CaseAnswer, NamedEffect, StatedValue
from oed.benchmarks.taxonomy import EFFECT_NAMES, PARAMETERS
from robots.common.errors import InputError


def case_answer(entry: Any, joints: int, file: Path, place: str) -> tuple[CaseAnswer, str | None]:
    """Checks the entry of a case.

    Args:
        entry: as read from JSON.
        joints: number of joints of the case's robot.
        file: for messages.
        place: path of the entry in the file, for messages.

    Returns:
        The answer without its prediction, and the path of the prediction or None.

    Raises:
        InputError: a key that is unknown or missing, or a value that is not allowed.
    """
    _keys(entry, ("verdict", "effects", "predicted_torque"), ("verdict",), file, place)
    verdict = entry["verdict"]
    if verdict not in VERDICTS:
        raise InputError(f"found {verdict!r}", file=file, column=f"{place}.verdict", allowed=", ".join(VERDICTS))
    listed = entry.get("effects", [])
    if not isinstance(listed, list):
        raise InputError(f"found {listed!r}", file=file, column=f"{place}.effects", allowed="a list")
    if verdict == "nothing" and listed:
        raise InputError(
            "effects beside the verdict 'nothing'",
            file=file,
            column=f"{place}.effects",
            allowed="an empty list, or the verdict 'effects'",
        )
    if verdict == "effects" and not listed:
        raise InputError(
            "no effect beside the verdict 'effects'",
            file=file,
            column=f"{place}.effects",
            allowed="at least one effect; 'unknown' is one without a name",
        )
    prediction = entry.get("predicted_torque")
    if prediction is not None and not isinstance(prediction, str):
        raise InputError(
            f"found {prediction!r}",
            file=file,
            column=f"{place}.predicted_torque",
            allowed="the path of a CSV, beside the file of answers",
        )
    effects = tuple(_effect(one, joints, file, f"{place}.effects[{k + 1}]") for k, one in enumerate(listed))
    return CaseAnswer(verdict=verdict, effects=effects), prediction


def _effect(entry: Any, joints: int, file: Path, place: str) -> NamedEffect:
    _keys(entry, ("effect", "joints", "parameters", "confidence"), ("effect",), file, place)
    name = entry["effect"]
    if name not in EFFECT_NAMES:
        close = get_close_matches(str(name), EFFECT_NAMES, n=1)
        raise InputError(
            f"no effect is called {name!r}" + (f"; did you mean {close[0]}?" if close else ""),
            file=file,
            column=f"{place}.effect",
            allowed="the names and classes in benchmark.json, or 'unknown'",
        )
    where = entry.get("joints", [])
    if not isinstance(where, list) or not all(type(j) is int and 1 <= j <= joints for j in where):
        raise InputError(
            f"found {where!r}",
            file=file,
            column=f"{place}.joints",
            allowed=f"a list of joints from 1 to {joints}; an empty one for the whole robot",
        )
    confidence = entry.get("confidence")
    if confidence is not None and not (_is_number(confidence) and 0 <= confidence <= 1):
        raise InputError(f"found {confidence!r}", file=file, column=f"{place}.confidence", allowed="0 to 1")
    values = entry.get("parameters", {})
    if not isinstance(values, dict):
        raise InputError(f"found {values!r}", file=file, column=f"{place}.parameters", allowed="an object")
    return NamedEffect(
        effect=name,
        joints=tuple(where),
        parameters={key: _value(key, one, file, f"{place}.parameters.{key}") for key, one in values.items()},
        confidence=confidence,
    )


def _value(name: str, entry: Any, file: Path, place: str) -> StatedValue:
    if name not in PARAMETERS:
        raise InputError("no such parameter", file=file, column=place, allowed=", ".join(PARAMETERS))
    _keys(entry, ("value", "interval"), ("value",), file, place)
    if not _is_number(entry["value"]):
        raise InputError(f"found {entry['value']!r}", file=file, column=f"{place}.value", allowed="a finite number")
    interval = entry.get("interval")
    if interval is None:
        return StatedValue(value=float(entry["value"]))
    if (
        not isinstance(interval, list)
        or len(interval) != 2
        or not all(map(_is_number, interval))
        or interval[0] > interval[1]
    ):
        raise InputError(
            f"found {interval!r}", file=file, column=f"{place}.interval", allowed="[lower, upper], the 95 % interval"
        )
    return StatedValue(value=float(entry["value"]), interval=(float(interval[0]), float(interval[1])))


def _keys(entry: Any, allowed: tuple[str, ...], required: tuple[str, ...], file: Path, place: str) -> None:
    if not isinstance(entry, dict):
        raise InputError(f"found {entry!r}", file=file, column=place, allowed=f"an object with {', '.join(allowed)}")
    for key in entry:
        if key not in allowed:
            raise InputError(f"unknown key {key}", file=file, column=place, allowed=", ".join(allowed))
    for key in required:
        if key not in entry:
            raise InputError(f"no key {key}", file=file, column=place, allowed=", ".join(allowed))


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
