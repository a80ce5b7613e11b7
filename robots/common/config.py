"""YAML files in, checked objects out: the only place that validates YAML."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from os import PathLike
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError, model_validator
from pydantic_core import PydanticCustomError

from robots.common.errors import InputError
from robots.common.files import existing_file


class Config(BaseModel):
    """Base of everything a YAML file may hold: strict types, no key beyond the declared ones, frozen.

    Numbers may be written as integers; text, booleans and numbers do not turn into each other.
    """

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    @model_validator(mode="before")
    @classmethod
    def _know_every_key(cls, data: Any) -> Any:
        if not isinstance(data, Mapping):
            return data
        allowed = [field.alias or name for name, field in cls.model_fields.items()]
        for key in data:
            if key not in allowed:
                # Ours instead of pydantic's own message: it does not know what would have been allowed.
                context = {"key": str(key), "allowed": ", ".join(allowed)}
                raise PydanticCustomError("unknown_key", "unknown key {key}", context)
        return data


C = TypeVar("C", bound=Config)


class _Loader(yaml.SafeLoader):
    """YAML 1.2 scalars: PyYAML reads 3e-5 as text, and yes, no, on, off as booleans."""


_Loader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if not tag.endswith((":float", ":int", ":bool", ":timestamp"))]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
_Loader.add_implicit_resolver("tag:yaml.org,2002:bool", re.compile(r"^(?:true|True|TRUE|false|False|FALSE)$"), "tTfF")
_Loader.add_implicit_resolver("tag:yaml.org,2002:int", re.compile(r"^[-+]?[0-9]+$"), "-+0123456789")
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(
        r"^(?:[-+]?(?:\.[0-9]+|[0-9]+\.[0-9]*)(?:[eE][-+]?[0-9]+)?|[-+]?[0-9]+[eE][-+]?[0-9]+"
        r"|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))$"
    ),
    "-+.0123456789",
)
_Loader.add_constructor("tag:yaml.org,2002:int", lambda loader, node: int(loader.construct_scalar(node)))


def _key_path(loc: Sequence[int | str]) -> str:
    path = ""
    for part in loc:
        path += f"[{part + 1}]" if isinstance(part, int) else f".{part}" if path else part
    return path


def _line(node: yaml.Node) -> int:
    return int(node.start_mark.line) + 1


def _row(node: yaml.Node | None, loc: Sequence[int | str]) -> int | None:
    """Line of the entry at ``loc``, or of the nearest one around it that exists."""
    if node is None:
        return None
    row = _line(node)
    for part in loc:
        if isinstance(node, yaml.MappingNode):
            found = next(((key, value) for key, value in node.value if key.value == part), None)
            if found is None:
                return row
            row, node = _line(found[0]), found[1]
        elif isinstance(node, yaml.SequenceNode) and isinstance(part, int) and part < len(node.value):
            node = node.value[part]
            row = _line(node)
        else:
            return row
    return row


def _check_keys(node: yaml.Node, file: str, visited: set[int], above: tuple[int | str, ...] = ()) -> None:
    if id(node) in visited:  # an alias: checked where it is defined, and possibly a loop
        return
    visited.add(id(node))
    if isinstance(node, yaml.MappingNode):
        seen: set[str] = set()
        for key, value in node.value:
            if not isinstance(key, yaml.ScalarNode):
                raise InputError("a key that is not plain text", file=file, row=_line(key))
            loc = (*above, key.value)
            if key.value in seen:
                raise InputError("the key appears twice", file=file, column=_key_path(loc), row=_line(key))
            seen.add(key.value)
            _check_keys(value, file, visited, loc)
    elif isinstance(node, yaml.SequenceNode):
        for i, value in enumerate(node.value):
            _check_keys(value, file, visited, (*above, i))


def _compose(text: str, file: str) -> tuple[Any, yaml.Node | None]:
    try:
        loader = _Loader(text)
        node = loader.get_single_node()
        if node is None:
            return None, None
        _check_keys(node, file, set())
        return loader.construct_document(node), node
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        row = None if mark is None else mark.line + 1
        raise InputError(f"not valid YAML: {error.problem or error.context}", file=file, row=row) from error
    except yaml.reader.ReaderError as error:
        row = text.count("\n", 0, error.position) + 1
        raise InputError(f"not valid YAML: {error.reason}", file=file, row=row) from error
    except ValueError as error:
        raise InputError(f"not valid YAML: {error}", file=file) from error
    except RecursionError as error:
        raise InputError("the YAML refers to itself or is nested too deeply", file=file) from error


def _as_input_error(error: ValidationError, node: yaml.Node | None, file: str) -> InputError:
    details = error.errors(include_url=False)
    # In the file's order; but a misspelt key often makes another one missing, and the misspelling is the cause.
    details.sort(key=lambda d: (d["type"] != "unknown_key", _row(node, tuple(d["loc"])) or 0))
    detail = details[0]
    loc, context = tuple(detail["loc"]), detail.get("ctx", {})
    remedy = f"{len(details) - 1} more problem(s) in this file" if len(details) > 1 else None
    allowed = None
    if detail["type"] == "unknown_key":
        key = context["key"]
        loc = (*loc, key)
        problem, allowed = f"unknown key {key!r}", context["allowed"]
        close = get_close_matches(key.lower(), allowed.split(", "), n=1)
        if close:
            remedy = f"did you mean {close[0]!r}?"
    elif detail["type"] == "missing":
        problem = f"the key {loc[-1]!r} is missing"
    elif detail["type"] == "value_error":
        problem = str(context["error"])
    elif detail["type"] == "literal_error":
        problem, allowed = f"found {detail['input']!r}", str(context["expected"])
    else:
        found = detail["input"]
        shown = repr(found) if not isinstance(found, (Mapping, list)) else f"a {type(found).__name__}"
        problem = f"found {shown}; {detail['msg'][0].lower()}{detail['msg'][1:]}"
    return InputError(
        problem, file=file, column=_key_path(loc) or None, row=_row(node, loc), allowed=allowed, remedy=remedy
    )


def parse_config(text: str, kind: type[C], *, file: str | PathLike[str]) -> C:
    """Parse YAML text into a checked object.

    Args:
        text: the YAML.
        kind: the subclass of ``Config`` to make.
        file: where the text comes from, for messages.

    Returns:
        The object.

    Raises:
        InputError: naming the file, the key by its path (``limits.velocity.values[3]``, counted from 1), its line, and
            what is allowed there; on a syntax error, the line.
    """
    name = str(file)
    data, node = _compose(text, name)
    if data is None:
        raise InputError("the file is empty", file=name, kind="empty_file")
    if not isinstance(data, dict):
        raise InputError(f"the file holds a {type(data).__name__}", file=name, allowed="keys and values")
    try:
        return kind.model_validate(data)
    except ValidationError as error:
        raise _as_input_error(error, node, name) from error


def read_config(path: str | PathLike[str], kind: type[C]) -> C:
    """Read a YAML file into a checked object.

    Args:
        path: the file, in UTF-8.
        kind: the subclass of ``Config`` to make.

    Returns:
        The object.

    Raises:
        InputError: as ``parse_config``, and when the file cannot be read.
    """
    name = str(path)
    try:
        text = existing_file(path).read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError("the file is not text in UTF-8", file=name) from error
    return parse_config(text, kind, file=name)
