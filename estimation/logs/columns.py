"""The columns of a log: their names, the field of a `Log` each belongs to, and their units."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from robots.common.errors import InputError
from robots.common.tables.table import Table

_DEGREE = float(np.pi / 180.0)
_TURN = float(2.0 * np.pi)
_POSITION = {"rad": 1.0, "deg": _DEGREE, "mrad": 1e-3, "turn": _TURN, "m": 1.0, "mm": 1e-3}
_VELOCITY = {"rad/s": 1.0, "deg/s": _DEGREE, "rpm": _TURN / 60.0, "m/s": 1.0, "mm/s": 1e-3}
_TORQUE = {"Nm": 1.0, "N": 1.0, "Nmm": 1e-3, "mNm": 1e-3, "kNm": 1e3, "kN": 1e3}
_TIME = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0, "d": 86400.0}
_LINEAR = {"m", "mm", "m/s", "mm/s", "m/s2", "mm/s2", "N", "kN"}
# In SI units: files of earlier versions state them for linear axes, too, and N is often written for N m.
_HARMLESS = {"rad", "rad/s", "rad/s2", "Nm", "N"}
_ACCELERATION = {"rad/s2": 1.0, "deg/s2": _DEGREE, "m/s2": 1.0, "mm/s2": 1e-3}


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """One measured quantity.

    Args:
        prefix: the column name, to which a per-joint quantity adds the joint, counted from 1.
        field: the field of `Log`.
        units: the units a file may state, without spaces and signs of product or power, with their factor to the first,
            which is the unit of `Log`.
        unit: that unit as it is written.
        per_joint: whether there is a column a joint.
        complete: whether all joints must have their column.
        linear_unit: the unit of `Log` on a prismatic joint, where it is another one.
    """

    prefix: str
    field: str
    units: Mapping[str, float]
    unit: str
    per_joint: bool = True
    complete: bool = True
    linear_unit: str = ""


QUANTITIES = (
    Quantity(prefix="t", field="t", unit="s", units=_TIME, per_joint=False),
    Quantity(prefix="q", field="q", unit="rad", units=_POSITION, linear_unit="m"),
    Quantity(prefix="dq", field="dq", unit="rad/s", units=_VELOCITY, linear_unit="m/s"),
    Quantity(prefix="ddq", field="ddq", unit="rad/s^2", units=_ACCELERATION, linear_unit="m/s^2"),
    Quantity(prefix="tau", field="tau", unit="N m", units=_TORQUE, linear_unit="N"),
    Quantity(prefix="i", field="current", unit="A", units={"A": 1.0, "mA": 1e-3}),
    Quantity(prefix="temp", field="temperature", unit="degC", units={"degC": 1.0, "deg_C": 1.0}, complete=False),
    Quantity(prefix="temp_env", field="ambient", unit="degC", units={"degC": 1.0, "deg_C": 1.0}, per_joint=False),
    Quantity(prefix="qlink", field="qlink", unit="rad", units=_POSITION, complete=False, linear_unit="m"),
    Quantity(prefix="qref", field="command", unit="rad", units=_POSITION, linear_unit="m"),
    Quantity(prefix="segment", field="segment", unit="", units={"": 1.0}, per_joint=False),
    Quantity(prefix="cycle", field="cycle", unit="", units={"": 1.0}, per_joint=False),
)
"""All quantities in the order of a written log."""

BY_FIELD = {quantity.field: quantity for quantity in QUANTITIES}

_BY_PREFIX = {quantity.prefix: quantity for quantity in QUANTITIES}
_NAME = re.compile(r"([a-z]+)(\d+)")
_ANGLES = {"q": "", "qlink": "", "qref": "", "dq": "/s", "ddq": "/s2"}


def parse_name(name: str) -> tuple[Quantity, int | None] | None:
    """Returns the quantity and the joint number of a column, or None for a column that is not one of a log.

    Args:
        name: the column name; the joint number is returned as written, so 0 and numbers beyond n are possible.
    """
    match = _NAME.fullmatch(name)
    if match is None:
        quantity = _BY_PREFIX.get(name)
        return (quantity, None) if quantity is not None and not quantity.per_joint else None
    quantity = _BY_PREFIX.get(match[1])
    return (quantity, int(match[2])) if quantity is not None and quantity.per_joint else None


def column_name(quantity: Quantity, joint: int | None) -> str:
    """Returns the column name of a quantity at a joint, counted from 1."""
    return f"{quantity.prefix}{joint}" if quantity.per_joint and joint is not None else quantity.prefix


def unit_factors(
    table: Table, names: Mapping[str, Quantity], kinds: Sequence[str] | None = None
) -> tuple[dict[str, float], list[dict[str, object]]]:
    """Returns the factor that brings each column to the unit of `Log`.

    A file states units by column (ECSV, Parquet), for all angles (``units: deg``), or by quantity
    (``units: {q: deg, tau: N m}``); without a statement the columns are in SI units. A unit of angles that is stated
    for all joints leaves linear axes in m and N, and the other way round.

    Args:
        table: the file as read.
        names: the quantity of each column.
        kinds: "revolute" or "prismatic" of each joint, if known.

    Returns:
        The factors, and notes on the joints that a unit for all joints does not suit.

    Raises:
        InputError: a unit that is not known or does not suit its joint, or two statements that differ.
    """
    stated = _stated_units(table)
    factors: dict[str, float] = {}
    left: dict[tuple[str, str], list[int]] = {}
    for name, quantity in names.items():
        own = _normal(table.units[name]) if name in table.units else None
        shared = stated.get(quantity.prefix)
        if own is not None and shared is not None and own != shared and not (quantity.linear_unit and own in _LINEAR):
            raise InputError(
                f"the column states the unit {table.units[name]!r}, but `units` in the file's head states {shared!r}",
                file=table.path,
                column=name,
                remedy="state the unit in one place",
            )
        unit = table.units.get(name, shared)
        if unit is None:
            factors[name] = 1.0
            continue
        joint = parsed[1] if (parsed := parse_name(name)) else None
        kind = None if kinds is None or joint is None or joint > len(kinds) else kinds[joint - 1]
        alike = suits(quantity, unit, kind)
        if own is None and not alike and joint is not None:
            unit_factor(quantity, unit, file=table.path, column=name)
            left.setdefault((quantity.prefix, unit), []).append(joint)
            factors[name] = 1.0
        else:
            factors[name] = unit_factor(quantity, unit, kind, file=table.path, column=name)
    return factors, [units_note(_BY_PREFIX[prefix], unit, joints) for (prefix, unit), joints in left.items()]


def suits(quantity: Quantity, unit: str, kind: str | None) -> bool:
    """Returns whether a unit suits a joint: one of angles a revolute joint, one of lengths a prismatic one.

    Args:
        quantity: what is measured.
        unit: as the file writes it.
        kind: of the joint; any unit suits an unknown one.
    """
    plain = _normal(unit)
    linear = plain in _LINEAR
    return kind is None or not quantity.linear_unit or plain in _HARMLESS or linear == (kind == "prismatic")


def units_note(quantity: Quantity, unit: str, joints: Sequence[int]) -> dict[str, object]:
    """Writes the note on joints that a unit for all joints does not suit."""
    linear = _normal(unit) in _LINEAR
    kind, read = ("revolute", quantity.unit) if linear else ("linear", quantity.linear_unit)
    return {
        "name": "unit_for_all",
        "text": f"the unit {unit} of {quantity.prefix} does not suit {kind} joint {', '.join(map(str, joints))}",
        "action": f"read in {read} there; state one unit per joint if that is wrong",
        "value": len(joints),
        "unit": "joints",
    }


def unit_factor(
    quantity: Quantity, unit: str, kind: str | None = None, *, file: Path | None = None, column: str | None = None
) -> float:
    """Returns the factor that brings a unit to that of `Log`.

    Args:
        quantity: what is measured.
        unit: as the file writes it; spaces and signs of product or power do not matter.
        kind: "revolute" or "prismatic", if the joint's is known.
        file: for the message.
        column: for the message.

    Raises:
        InputError: a unit that is not known, or that does not suit the joint.
    """
    factor = quantity.units.get(_normal(unit))
    if factor is None or not suits(quantity, unit, kind):
        fitting = [known for known in quantity.units if suits(quantity, known, kind)]
        joint = "" if factor is None else f" of a {'linear axis' if kind == 'prismatic' else 'revolute joint'}"
        raise InputError(
            f"unit {unit!r}{joint}",
            file=file,
            column=column,
            allowed=", ".join(fitting).strip(", ") or "no unit",
            kind="unknown_unit",
        )
    return factor


def _stated_units(table: Table) -> dict[str, str]:
    for key in table.metadata:
        if key != "units" and key.lower() in ("unit", "units"):
            raise InputError(
                f"key {key!r} in the head of the file", file=table.path, allowed="units", remedy="rename it"
            )
    stated: Any = table.metadata.get("units")
    if stated is None:
        return {}
    if isinstance(stated, Mapping):
        for key in stated:
            if key not in _BY_PREFIX:
                raise InputError(
                    f"`units` names {key!r}", file=table.path, allowed=", ".join(_BY_PREFIX), remedy="correct the key"
                )
        return {str(key): _normal(str(unit)) for key, unit in stated.items()}
    if stated not in ("rad", "deg"):
        raise InputError(f"`units` is {stated!r}", file=table.path, allowed="rad or deg, or a mapping such as {q: deg}")
    return {prefix: f"{stated}{rate}" for prefix, rate in _ANGLES.items()}


def _normal(unit: str) -> str:
    return re.sub(r"[\s*.^·]", "", unit)


def refuse_text(table: Table, name: str) -> None:
    """Refuses a column of a log that holds text.

    Raises:
        InputError: with its first cell.
    """
    if table.is_text(name):
        raise InputError(
            f"found {str(table.columns[name][0])[:40]!r}",
            file=table.path,
            column=name,
            row=table.first_row,
            allowed="a number",
        )
