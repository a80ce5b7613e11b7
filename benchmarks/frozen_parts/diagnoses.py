"""Diagnoses of 84 cases of ``oed/benchmarks/truth`` and of the real logs of ``diagnosis_real.py``."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from benchmarks.diagnosis_parts.running import described, logs_of
from benchmarks.diagnosis_parts.strata import STRATA, Task, draw
from benchmarks.diagnosis_real import SETS

# Seeds of logs of 60 s (most) and 120 s; no threshold was tuned on them. Singles cover every effect of the catalogue.
# 15 without an effect, 25 with one, 10 with two, 10 outside the catalogue; and four each of moves with pauses, of a
# description without drives, of 15 s, and of noise that wanders for a second.
FIRST = 9600
CASES = (
    [Task("none", FIRST + k) for k in range(15)]
    + [Task("one", FIRST + k) for k in range(16)]
    + [Task("half", FIRST + 32 + k) for k in range(9)]
    + [Task("two", FIRST + k) for k in range(10)]
    + [Task("stranger", FIRST + k) for k in range(10)]
    + [
        Task(name, FIRST + k)
        for name in ("idle_moves", "moves", "bare", "brief", "slow_none", "slow")
        for k in range(4)
    ]
)


def run_case(task: Task) -> dict[str, Any]:
    """Diagnoses one case of the truth plant."""
    from estimation import diagnose

    case = draw(task)
    if case is None:
        return {"hidden": True}
    with described(case, STRATA[task.stratum].drives) as robot:
        found = diagnose(robot, logs_of(case.logs), held_out=logs_of(case.unseen) or None)
    truth = [{"effect": effect.name, "joint": effect.joint} for effect in case.effects]
    return {"truth": truth, **found.to_dict()}


def run_set(name: str, folder: Path) -> dict[str, Any]:
    """Diagnoses one set of real logs."""
    from estimation import diagnose

    with tempfile.TemporaryDirectory() as out:
        given = SETS[name](folder, Path(out))
        return diagnose(given.robot, given.logs, held_out=given.unseen).to_dict()
