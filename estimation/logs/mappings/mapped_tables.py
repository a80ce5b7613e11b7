"""A foreign log's table by its mapping: columns renamed and put in order, values in SI units."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimation.logs.columns import BY_FIELD, Quantity, column_name, refuse_text, suits, unit_factor, units_note
from estimation.logs.mappings.coupled_axes import uncouple
from estimation.logs.mappings.mapping import FIELDS, USUAL, LogMapping, PerJoint, Single
from robots.common.errors import InputError
from robots.common.tables.table import Column, Table

UNIT_NOTES = "unit_notes"
"""Key of a mapped table's metadata: notes on units that do not suit all joints."""

# Conversion of motor-side values by the gear: positions are divided, torques multiplied.
_GEARED = {"q": -1, "dq": -1, "ddq": -1, "qlink": -1, "command": -1, "tau": 1, "current": 0, "temperature": 0}


def count_joints(mapping: LogMapping, names: Sequence[str], n: int | None) -> int:
    """Finds the number of joints: as known, as listed, or as many as the position's pattern finds columns for.

    Args:
        mapping: of the file.
        names: the file's columns.
        n: the number of joints where it is known.
    """
    if n is not None:
        return n
    for listed in (mapping.joints, mapping.gear_ratio):
        if listed is not None:
            return len(listed)
    entry = mapping.position
    present = set(names)
    joints = 0
    if entry is None:
        while f"q{joints + 1}" in present:
            joints += 1
        return joints
    if len(entry.columns) > 1:
        return len(entry.columns)
    if entry.columns[0] in present:
        return 1
    while _columns(entry, mapping, joints + 1, present)[-1] in present:
        joints += 1
    return max(joints, 1)


def mapped_sources(mapping: LogMapping, names: Sequence[str], joints: int) -> list[str]:
    """Names the columns of a file that a mapping uses, in the file's order.

    Args:
        mapping: of the file.
        names: the file's columns.
        joints: the number of joints.
    """
    used: set[str] = set()
    for key in FIELDS:
        entry = getattr(mapping, key)
        if entry is not None:
            single = isinstance(entry, Single)
            used.update(
                filter(None, (entry.column, getattr(entry, "nanoseconds", None)))
                if single
                else _columns(entry, mapping, joints, set(names))
            )
    return [name for name in names if name in used]


def stated_columns(mapping: LogMapping, names: Sequence[str] | None, n: int | None) -> list[str]:
    """Names the columns that a mapping states, and not those that it only describes under their usual names.

    Args:
        mapping: of the file.
        names: the file's columns, where they are known.
        n: the number of joints, where it is known.
    """
    usual = {key: None for key in USUAL if (entry := getattr(mapping, key)) and entry.columns == [USUAL[key]]}
    known = names or ()
    return mapped_sources(mapping.model_copy(update=usual), known, count_joints(mapping, known, n))


def map_table(table: Table, mapping: LogMapping, joints: int, kinds: Sequence[str] | None = None) -> Table:
    """Renames and converts a table's columns to those of a log, in SI units.

    Args:
        table: as it was read.
        mapping: what its columns mean; quantities it does not name keep the names of a log.
        joints: the number of joints.
        kinds: "revolute" or "prismatic" of each joint, if known.

    Returns:
        The table; under `UNIT_NOTES` its metadata has notes on joints that a unit for all joints does not suit.

    Raises:
        InputError: a column that is not there or holds text, a list of another length than there are joints, a missing
            gear ratio, rating or unit.
    """
    columns: dict[str, Column] = {}
    units: dict[str, str] = {}
    taken: set[str] = set()
    left: dict[tuple[str, str], list[int]] = {}
    for key, field in FIELDS.items():
        entry, quantity = getattr(mapping, key), BY_FIELD[field]
        if entry is None:
            continue
        if isinstance(entry, Single):
            columns[quantity.prefix] = _value(table, entry.column) * _factor(table, quantity, entry.column, entry.unit)
            taken.add(entry.column)
            continue
        names = _columns(entry, mapping, joints, set(table.names))
        if len(names) != joints:
            raise InputError(
                f"the mapping has {len(names)} columns of {quantity.prefix}", file=table.path, allowed=f"{joints}"
            )
        present = set(table.names)
        for joint, name in enumerate(names, start=1):
            # Not every joint has a thermometer, or an encoder behind its gear.
            if not quantity.complete and name not in present and present.intersection(names):
                continue
            kind = None if kinds is None or entry.side == "motor" else kinds[joint - 1]
            unit = _joint_unit(table, entry, quantity, joint, joints)
            if entry.unit is not None and len(entry.unit) == 1 and unit != "%" and not suits(quantity, str(unit), kind):
                unit_factor(quantity, str(unit), file=table.path, column=name)
                left.setdefault((field, str(unit)), []).append(joint)
                unit, kind = quantity.linear_unit if kind == "prismatic" else quantity.unit, None
            converted = _converted(table, mapping, entry, quantity, joint, name, joints, unit, kind)
            columns[column_name(quantity, joint)] = converted
        taken.update(names)
    if mapping.torque_constant is not None:
        _add_torque(table, mapping, columns, joints)
    for name in table.names:
        if name not in taken and name not in columns:
            columns[name] = table.columns[name]
            if name in table.units:
                units[name] = table.units[name]
    if mapping.coupling is not None:
        uncouple(columns, mapping, joints, table)
    metadata = {key: value for key, value in table.metadata.items() if key != "units" or units}
    if left:
        metadata[UNIT_NOTES] = [units_note(BY_FIELD[field], unit, which) for (field, unit), which in left.items()]
    return Table(
        columns=columns,
        metadata=metadata,
        path=table.path,
        first_row=table.first_row,
        units=units,
        skipped=table.skipped,
    )


def _joint_unit(table: Table, entry: PerJoint, quantity: Quantity, joint: int, joints: int) -> str | None:
    if entry.unit is None:
        return None
    if len(entry.unit) not in (1, joints):
        raise InputError(
            f"the mapping's unit of {quantity.prefix} has {len(entry.unit)} values",
            file=table.path,
            allowed=f"1 or {joints}",
        )
    return entry.unit[joint - 1] if len(entry.unit) > 1 else entry.unit[0]


def _converted(
    table: Table,
    mapping: LogMapping,
    entry: PerJoint,
    quantity: Quantity,
    joint: int,
    name: str,
    joints: int,
    unit: str | None,
    kind: str | None,
) -> Column:
    def own(what: str, values: list[float]) -> float:
        if len(values) not in (1, joints):
            raise InputError(
                f"the mapping's {what} of {quantity.prefix} has {len(values)} values",
                file=table.path,
                allowed=f"1 or {joints}",
            )
        return values[joint - 1] if len(values) > 1 else values[0]

    factor = own("sign", entry.sign) * own("scale", entry.scale)
    if unit == "%":
        if entry.rated is None:
            raise InputError(
                f"the mapping states {quantity.prefix} in % but lacks `rated`",
                file=table.path,
                column=name,
                remedy="state the rated values [N m, N or A] of all joints",
            )
        factor *= own("rated", entry.rated) / 100.0
    else:
        factor *= _factor(table, quantity, name, unit, kind)
    if entry.side == "motor":
        factor *= _gear(table, mapping, joint, joints) ** _GEARED[quantity.field]
    with np.errstate(all="ignore"):
        return np.asarray(_value(table, name) * factor + own("offset", entry.offset))


def _add_torque(table: Table, mapping: LogMapping, columns: dict[str, Column], joints: int) -> None:
    """Torques from currents, beside torques that the file has itself: those count."""
    constant = mapping.torque_constant
    assert constant is not None
    if len(constant) != joints:
        raise InputError(f"the mapping has {len(constant)} torque constants", file=table.path, allowed=f"{joints}")
    if any(f"tau{joint}" in columns for joint in range(1, joints + 1)) or mapping.torque is not None:
        return
    side = mapping.current.side if mapping.current is not None else "link"
    for joint in range(1, joints + 1):
        current = columns.get(f"i{joint}", table.columns.get(f"i{joint}"))
        if current is None or current.dtype == np.dtype(object):
            raise InputError(
                "the mapping has torque constants, but the column is missing", file=table.path, column=f"i{joint}"
            )
        gear = _gear(table, mapping, joint, joints) if side == "motor" else 1.0
        columns[f"tau{joint}"] = current * (constant[joint - 1] * gear)


def _gear(table: Table, mapping: LogMapping, joint: int, joints: int) -> float:
    ratios = mapping.gear_ratio
    if ratios is None or len(ratios) != joints or ratios[joint - 1] == 0.0:
        raise InputError(
            f"the mapping has {'no' if ratios is None else len(ratios)} gear ratios",
            file=table.path,
            allowed=f"{joints}, none of them zero",
            remedy="state gear_ratio",
        )
    return ratios[joint - 1]


def _columns(entry: PerJoint, mapping: LogMapping, joints: int, present: set[str]) -> list[str]:
    """The columns of one quantity, one per joint."""
    pattern = entry.columns[0]
    if len(entry.columns) > 1 or (joints == 1 and pattern in present):
        return list(entry.columns)
    if "{joint}" not in pattern and "{index}" not in pattern:
        # A matrix of a MAT or npz file comes as columns that are numbered from 1.
        pattern += "{joint}"
        named = [str(joint) for joint in range(1, joints + 1)]
    else:
        named = mapping.joints or [str(joint) for joint in range(1, joints + 1)]
    return [
        pattern.replace("{joint}", name).replace("{index}", str(index)) for index, name in enumerate(named[:joints])
    ]


def _value(table: Table, name: str) -> Column:
    if name not in table.columns:
        present = ", ".join((*table.names, *table.skipped))
        raise InputError(
            "the mapping names a column that the file does not have",
            file=table.path,
            column=name,
            allowed=present[:300] + (" ..." if len(present) > 300 else ""),
            kind="mapping_without_column",
        )
    refuse_text(table, name)
    return table.columns[name]


def _factor(table: Table, quantity: Quantity, name: str, unit: str | None, kind: str | None = None) -> float:
    stated = unit if unit is not None else table.units.get(name)
    return 1.0 if stated is None else unit_factor(quantity, stated, kind, file=table.path, column=name)
