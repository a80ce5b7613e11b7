"""The ``#`` block at the head of a CSV file: YAML by the ECSV standard, or plain ``key: value`` lines."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from robots.common.errors import InputError

_ECSV = re.compile(r"%ECSV\s+\d")
_PAIR = re.compile(r"([A-Za-z_][\w-]*)\s*[:=]\s*(\S.*)")
# PyYAML lets the ValueError of an impossible date through.
_YAML_ERRORS = (yaml.YAMLError, ValueError)


@dataclass(frozen=True, kw_only=True)
class Header:
    """The content of a ``#`` block.

    Args:
        metadata: everything that is not about single columns.
        units: the unit of each column that states one.
        datatypes: the ECSV datatype of each column that states one.
    """

    metadata: dict[str, Any] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    datatypes: dict[str, str] = field(default_factory=dict)


def parse_header(lines: Sequence[str], path: Path) -> Header:
    """Reads a ``#`` block.

    Without ``%ECSV`` in front, the block is YAML if it can be, else each line of the form ``key: value`` counts and the
    others are remarks.

    Args:
        lines: the block with its ``#`` marks.
        path: the file, for messages.

    Raises:
        InputError: an ECSV block that is not valid, or that announces another delimiter than the comma.
    """
    text = [line[2:] if line.startswith("# ") else line[1:] for line in lines]
    if any(_ECSV.match(line.strip()) for line in text[:1]):
        # The mark of a YAML document would otherwise read as a second document.
        body = "\n".join("" if line.strip() == "---" else line for line in text[1:])
        try:
            return _from_ecsv(yaml.safe_load(body), path)
        except _YAML_ERRORS as error:
            mark = getattr(error, "problem_mark", None)
            raise InputError(
                f"the ECSV block is not valid YAML ({getattr(error, 'problem', None) or error})",
                file=path,
                row=None if mark is None else mark.line + 2,
                remedy="correct the lines that begin with #, or remove them",
            ) from error
    try:
        content = yaml.safe_load("\n".join(text))
    except _YAML_ERRORS:
        content = None
    if not isinstance(content, dict):
        content = _pairs(text)
    return Header(metadata={str(key): value for key, value in content.items()})


def format_header(
    columns: Mapping[str, np.ndarray], metadata: Mapping[str, Any], units: Mapping[str, str]
) -> list[str]:
    """Returns the lines of an ECSV block, each with its ``#`` mark.

    Args:
        columns: the columns by name.
        metadata: anything that YAML can hold; numpy values become plain ones.
        units: the unit of a column by its name.
    """
    content: dict[str, Any] = {
        "delimiter": ",",
        "datatype": [
            {"name": name, **({"unit": units[name]} if name in units else {}), "datatype": _datatype(array)}
            for name, array in columns.items()
        ],
    }
    if metadata:
        content["meta"] = plain(metadata)
    # Without allow_unicode: a line end of Unicode (U+0085) would go out bare and come back as a space.
    text = yaml.safe_dump(content, default_flow_style=None, sort_keys=False, width=2**31)
    return ["# %ECSV 1.0", "# ---", *(f"# {line}".rstrip(" ") for line in text.rstrip("\n").split("\n"))]


def plain(value: Any) -> Any:
    """Returns a value made of dicts, lists, text, numbers, booleans and None only; other objects become text."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(item) for item in value]
    if value is None or type(value) in (bool, int, float, str):
        return value
    return str(value)


def _from_ecsv(content: Any, path: Path) -> Header:
    remedy = "correct the lines that begin with #, or remove them"
    if not isinstance(content, dict):
        raise InputError("the ECSV block holds no keys", file=path, allowed="delimiter, datatype, meta", remedy=remedy)
    delimiter = content.get("delimiter", " ")
    if delimiter != ",":
        raise InputError(
            f"the ECSV block announces the delimiter {delimiter!r}",
            file=path,
            allowed="','",
            remedy="write with commas",
        )
    entries = content.get("datatype") or []
    if not isinstance(entries, list) or not all(isinstance(entry, dict) and "name" in entry for entry in entries):
        raise InputError("the ECSV datatype is not a list of columns with names", file=path, remedy=remedy)
    metadata = content.get("meta") or {}
    if isinstance(metadata, list):
        # The standard's ordered map (!!omap) reads as a list of pairs.
        metadata = dict(pair for pair in metadata if isinstance(pair, tuple))
    if not isinstance(metadata, dict):
        raise InputError("the ECSV meta is not a mapping", file=path, remedy=remedy)
    return Header(
        metadata={str(key): value for key, value in metadata.items()},
        units={str(entry["name"]): str(entry["unit"]) for entry in entries if entry.get("unit") is not None},
        datatypes={str(entry["name"]): str(entry["datatype"]) for entry in entries if "datatype" in entry},
    )


def _pairs(lines: Sequence[str]) -> dict[str, Any]:
    pairs: dict[str, Any] = {}
    for line in lines:
        match = _PAIR.fullmatch(line.strip())
        if match is None:
            continue
        try:
            pairs[match[1]] = yaml.safe_load(match[2])
        except _YAML_ERRORS:
            pairs[match[1]] = match[2]
    return pairs


def _datatype(array: np.ndarray) -> str:
    if array.dtype.kind == "f":
        return "float64"
    return "int64" if array.dtype.kind in "iu" else "string"
