"""Freezes what the diagnosis says of a fixed set of logs, and compares a later version with it.

Run ``python benchmarks/diagnosis_frozen.py run --data FOLDER --out now.jsonl`` and then
``python benchmarks/diagnosis_frozen.py compare benchmarks/diagnosis_frozen.jsonl now.jsonl``. The set has 60 cases of
``oed/benchmarks/truth`` (15 without an effect, 25 with one, 10 with two, 10 outside the catalogue) and the real logs of
``diagnosis_real.py``. Texts are left out: a change of wording is no change of behaviour. A run that was stopped goes
on where it was. Processors round differently: compare two runs of one machine.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import tempfile
import warnings
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks.diagnosis import read_rows
from benchmarks.diagnosis_parts.running import described, logs_of
from benchmarks.diagnosis_parts.strata import STRATA, Task, draw
from benchmarks.diagnosis_real import SETS
from benchmarks.parallel_work import add_options, finished

# Seeds of logs of 60 s (most) and 120 s; no threshold was tuned on them. Singles cover every effect of the catalogue.
FIRST = 9600
CASES = (
    [Task("none", FIRST + k) for k in range(15)]
    + [Task("one", FIRST + k) for k in range(16)]
    + [Task("half", FIRST + 32 + k) for k in range(9)]
    + [Task("two", FIRST + k) for k in range(10)]
    + [Task("stranger", FIRST + k) for k in range(10)]
)
# Keys of `Diagnosis.to_dict` and of its parts whose values are sentences.
TEXTS = frozenset({"notes", "unseen", "sentence", "why", "note", "pattern", "advice", "assumed"})
# Two runs on one machine differ by less, unless something else was computed.
RELATIVE, ABSOLUTE = 1e-6, 1e-9


def structure(value: Any) -> Any:
    """Leaves texts out of plain data."""
    if isinstance(value, dict):
        return {key: structure(item) for key, item in value.items() if key not in TEXTS}
    if isinstance(value, list | tuple):
        return [structure(item) for item in value]
    return value


def run_case(task: Task) -> dict[str, Any]:
    """Diagnoses one case of the truth plant."""
    from estimation import diagnose
    from robots.common.errors import AssumedValueWarning

    warnings.simplefilter("ignore", AssumedValueWarning)
    case = draw(task)
    if case is None:
        return {"key": task.key, "hidden": True}
    with described(case, STRATA[task.stratum].drives) as robot:
        found = diagnose(robot, logs_of(case.logs), held_out=logs_of(case.unseen) or None)
    truth = [{"effect": effect.name, "joint": effect.joint} for effect in case.effects]
    return {"key": task.key, "truth": truth, **structure(found.to_dict())}


def run_set(name: str, folder: Path) -> dict[str, Any]:
    """Diagnoses one set of real logs."""
    from estimation import diagnose
    from robots.common.errors import AssumedValueWarning, OedError

    warnings.simplefilter("ignore", AssumedValueWarning)
    with tempfile.TemporaryDirectory() as out:
        try:
            given = SETS[name](folder, Path(out))
            found = diagnose(given.robot, given.logs, held_out=given.unseen)
        except OedError as error:
            return {"key": name, "refused": type(error).__name__}
    return {"key": name, **structure(found.to_dict())}


def differences(old: Any, new: Any, at: str = "") -> Iterator[str]:
    """Lists where two structures differ by more than rounding."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in sorted(old.keys() | new.keys()):
            if key not in old or key not in new:
                yield f"{at}.{key}: only in the {'old' if key in old else 'new'}"
            else:
                yield from differences(old[key], new[key], f"{at}.{key}")
    elif isinstance(old, list) and isinstance(new, list):
        if len(old) != len(new):
            yield f"{at}: {len(old)} entries, now {len(new)}"
        for k, (before, after) in enumerate(zip(old, new, strict=False)):
            yield from differences(before, after, f"{at}[{k}]")
    elif isinstance(old, float) and isinstance(new, int | float):
        if not math.isclose(old, new, rel_tol=RELATIVE, abs_tol=ABSOLUTE):
            yield f"{at}: {old:.8g}, now {new:.8g}"
    elif old != new:
        yield f"{at}: {old!r}, now {new!r}"


def verdict_of(row: dict[str, Any]) -> str:
    """One line of what a row says."""
    named = ", ".join(f"{f['effect']} {f['joint'] or ''}".strip() for f in row.get("findings", ()))
    return f"{row.get('verdict', row.get('refused', 'hidden'))}: {named}"


def compare(old: Path, new: Path, most: int) -> int:
    """Prints the differences of two runs; the exit code is 1 where there are any."""
    before, after = ({row["key"]: row for row in read_rows(path)} for path in (old, new))
    changed = 0
    for key in sorted(before.keys() & after.keys()):
        found = list(differences(before[key], after[key]))
        if found:
            changed += 1
            print(f"{key}: {verdict_of(before[key])} -> {verdict_of(after[key])}; {len(found)} values differ")
            print(*(f"    {line}" for line in found[:most]), sep="\n")
    common = len(before.keys() & after.keys())
    print(f"{common - changed} of {common} rows are the same; {len(before) - common} were not run")
    return 1 if changed or not common else 0


def call(task: partial[dict[str, Any]]) -> dict[str, Any]:
    """Does one task."""
    return task()


def work(options: argparse.Namespace) -> int:
    """Runs what is not in the file yet and appends it."""
    known = {row["key"] for row in read_rows(options.out)}
    todo = [partial(run_set, name, options.data) for name in SETS if options.data and name not in known]
    todo += [partial(run_case, task) for task in CASES[:: options.every] if task.key not in known]
    with options.out.open("a", encoding="utf-8") as file:
        for done, (_, row) in enumerate(finished(call, todo, options), start=1):
            file.write(json.dumps(row, default=float, sort_keys=True) + "\n")
            file.flush()
            print(f"{done}/{len(todo)} {row['key']}: {verdict_of(row)}", flush=True)
    return 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    verbs = parser.add_subparsers(dest="verb", required=True)
    runs = verbs.add_parser("run", help="diagnose the set")
    runs.add_argument("--out", type=Path, required=True, help="rows; continued if there")
    runs.add_argument("--data", type=Path, help="folder of the published logs; without, the real logs are left out")
    add_options(runs)
    runs.add_argument("--every", type=int, default=1, help="run each N-th case alone: a quick look")
    compares = verbs.add_parser("compare", help="two files of rows")
    compares.add_argument("old", type=Path)
    compares.add_argument("new", type=Path)
    compares.add_argument("--most", type=int, default=5, help="differences printed of one row")
    options = parser.parse_args()
    return work(options) if options.verb == "run" else compare(options.old, options.new, options.most)


if __name__ == "__main__":
    sys.exit(main())
