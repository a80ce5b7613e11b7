"""The JSON schema of the configuration file, with which editors complete and check it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from oed.cli.configuration.file import TABLES, named_options
from oed.cli.declarations.declared import Declared
from oed.cli.verbs import Verb

_TYPES = {bool: "boolean", int: "integer", float: "number", str: "string", Path: "string"}


def configuration_schema(verbs: Mapping[str, type[Verb]]) -> dict[str, Any]:
    """Makes the schema: a key for each option of any command, and a table for each command.

    Args:
        verbs: the commands.
    """
    tables = {name: _table(verb) for name, verb in verbs.items()}
    shared: dict[str, list[dict[str, Any]]] = {}
    for table in tables.values():
        for key, schema in table["properties"].items():
            if schema not in shared.setdefault(key, []):
                shared[key].append(schema)
    # A key may be an option and a command; of an option, commands may take different values.
    top = {key: schemas[0] if len(schemas) == 1 else {"anyOf": schemas} for key, schemas in shared.items()}
    commands = {name: {"$ref": f"#/definitions/{name}"} for name in tables}
    for name, table in commands.items():
        top[name] = {"anyOf": [top[name], table]} if name in top else table
    nested = {"type": "object", "properties": commands, "additionalProperties": False}
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "oed.toml: defaults of options",
        "type": "object",
        "properties": {**top, TABLES: nested},
        "additionalProperties": False,
        "definitions": tables,
    }


def _table(verb: type[Verb]) -> dict[str, Any]:
    properties = {name: _schema(option) for name, option in named_options(verb).items()}
    return {"type": "object", "properties": properties, "additionalProperties": False}


def _schema(option: Declared) -> dict[str, Any]:
    single: dict[str, Any] = {"type": _TYPES[option.kind]}
    if option.how.least is not None:
        single["minimum"] = option.how.least
    if option.how.most is not None:
        single["maximum"] = option.how.most
    allowed = [single]
    if option.kind is str:
        allowed.append({"type": "array", "items": {"type": "number"}})
    if option.several:
        allowed.append({"type": "array", "items": {"anyOf": list(allowed)} if len(allowed) > 1 else single})
    schema = {"description": option.help, **(single if len(allowed) == 1 else {"anyOf": allowed})}
    # JSON has no infinity, which the description then states.
    infinite = isinstance(option.default, float) and not math.isfinite(option.default)
    if option.has_default and not infinite:
        schema["default"] = str(option.default) if isinstance(option.default, Path) else option.default
    return schema
