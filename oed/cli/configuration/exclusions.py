"""Defaults of the file that do not apply beside what else was given: they are left out instead of refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from oed.cli.configuration.defaults import is_from_file
from oed.cli.designs.discriminating import APPLY
from oed.cli.designs.payload_designs import MEANINGLESS

_Given = Callable[[str], bool]


def left_out(context: Any) -> set[str]:
    """Lists the parameters whose values of the file do not apply.

    Args:
        context: of the command, its words parsed.
    """

    def typed(parameter: str) -> bool:
        source = context.get_parameter_source(parameter)
        return source is not None and source.name == "COMMANDLINE"

    rule = _RULES.get(str(context.command.name))
    unused = _one_of(typed, "workers", "cluster") | (rule(context.params, typed) if rule else set())
    return {name for name in unused if name in context.params and is_from_file(context, name)}


def _compare(values: dict[str, Any], typed: _Given) -> set[str]:
    """Models need no robot; a mapping belongs to logs."""
    models = all(path.suffix == ".json" or (path / "model.json").is_file() for path in map(Path, values["models"]))
    return {"robot", "mapping", "rate", "tip", "joints", "lock"} if models and not typed("robot") else set()


def _design(values: dict[str, Any], typed: _Given) -> set[str]:
    if values["discriminate"] is not None and not typed("payload_only"):
        return set(values) - APPLY
    if values["payload_only"]:
        return {*MEANINGLESS, *({"criterion", "strokes"} if typed("payload_only") else ())}
    return set()


def _diagnose(values: dict[str, Any], typed: _Given) -> set[str]:
    if values["limits"]:
        return {"log", "held_out", "mapping", "rate", "payload", "gravity", "torque_is", "urdf", "mjcf"}
    return {"trajectory", "model"}


def _force(values: dict[str, Any], typed: _Given) -> set[str]:
    return _one_of(typed, "healthy", "calibration")


def _payload(values: dict[str, Any], typed: _Given) -> set[str]:
    """A body that all logs carry cancels out between logs with and without the payload."""
    unused = _one_of(typed, "without", "model")
    carried = values["without"] and "without" not in unused and any("=" not in text for text in values["payload"] or [])
    return unused | ({"payload"} if carried else set())


def _simulate(values: dict[str, Any], typed: _Given) -> set[str]:
    unused = _one_of(typed, "trajectory", "campaign") | _one_of(typed, "plant", "model")
    return unused | ({"model", "payload"} if values["campaign"] and "campaign" not in unused else set())


def _one_of(typed: _Given, first: str, second: str) -> set[str]:
    """What was typed takes the place of the other."""
    return {second} if typed(first) else {first} if typed(second) else set()


_RULES: dict[str, Callable[[dict[str, Any], _Given], set[str]]] = {
    "compare": _compare,
    "design": _design,
    "diagnose": _diagnose,
    "force": _force,
    "payload": _payload,
    "simulate": _simulate,
}
