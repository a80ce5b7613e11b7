"""Joint positions and torques of axes whose readings contain other joints: parallelograms, coupled wrists."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from estimation.logs.columns import refuse_text
from estimation.logs.mappings.mapping import LogMapping
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.tables.table import Column, Table

# Condition number from which readings do not determine the joints.
SINGULAR = 1e6


def coupling_matrix(coupling: Mapping[int, Mapping[int, float]], joints: int) -> Array:
    """Gives C (n, n) with the readings ``C q`` of joint positions q.

    Args:
        coupling: of an axis, counted from 1, the other joints in its reading with their factors.
        joints: their number n.

    Raises:
        InputError: a joint that is not there, or readings that do not determine the joints.
    """
    matrix = np.eye(joints)
    for axis, others in coupling.items():
        for joint, factor in others.items():
            if not (1 <= axis <= joints and 1 <= joint <= joints) or axis == joint:
                raise InputError(
                    f"the mapping's coupling of axis {axis} with joint {joint}",
                    allowed=f"two different numbers from 1 to {joints}",
                )
            matrix[axis - 1, joint - 1] = factor
    if not np.isfinite(matrix).all() or np.linalg.cond(matrix) > SINGULAR:
        raise InputError("the mapping's coupling does not determine the joints", allowed="an invertible coupling")
    return matrix


def uncouple(columns: dict[str, Column], mapping: LogMapping, joints: int, table: Table) -> None:
    """Turns readings of coupled axes into joint values, in place: ``q = C^-1 r``, and ``tau = C' tau_r`` by their work.

    Args:
        columns: of a log.
        mapping: with a coupling.
        joints: their number.
        table: that was read, for messages.
    """
    matrix = coupling_matrix(mapping.coupling or {}, joints)
    turns = dict.fromkeys(("q", "dq", "ddq"), np.linalg.inv(matrix))
    if mapping.coupled_torques:
        turns["tau"] = matrix.T
    for prefix, turn in turns.items():
        names = [f"{prefix}{joint}" for joint in range(1, joints + 1)]
        found = [name for name in names if name in columns]
        if not found:
            continue
        missing = [name for name in names if name not in columns]
        if missing:
            raise InputError("a coupled axis lacks its column", file=table.path, column=missing[0])
        for name in found:
            if name in table.columns:
                refuse_text(table, name)
        values = np.stack([columns[name] for name in names], axis=-1).astype(float) @ turn.T
        columns.update((name, values[:, k]) for k, name in enumerate(names))
