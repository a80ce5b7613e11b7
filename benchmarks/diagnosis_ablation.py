"""What each rule and each deciding constant of the diagnosis brings: paired runs on cases of the truth plant.

Run ``python benchmarks/diagnosis_ablation.py run --out rows.jsonl`` for the rules, with ``--constants`` for the
constants of ``estimation/diagnosis/calibration.py``, each halved and doubled, and then
``python benchmarks/diagnosis_ablation.py table rows.jsonl``. A rule is switched off only in cases in which it changed
something; elsewhere the result is the same by construction. A run that was stopped goes on where it was.
"""

from __future__ import annotations

import argparse
import json
import sys
import warnings
from collections.abc import Iterator
from contextlib import AbstractContextManager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks.diagnosis import read_rows
from benchmarks.diagnosis_parts.running import described, logs_of
from benchmarks.diagnosis_parts.strata import STRATA, Task, draw
from benchmarks.parallel_work import add_options, finished

# Seeds of tuning; the benchmark has those below 1000. From here on the logs are of 60 s.
FIRST = 6016
COUNTS = {"one": 20, "half": 14, "two": 14, "stranger": 12, "none": 10}
# Constants that only the comparison of names and the held-out data use: the search need not be repeated for them.
LATE = (
    "MIN_EXPLAINED_SHARE",
    "NEARLY_EXPLAINED_SHARE",
    "MIN_RETAINED_CHI2",
    "MAX_FREE_FUNCTIONS",
    "MIN_FREE_SHARE",
    "FREE_P_VALUE",
    "MIN_RETAINED_GAIN",
    "OSCILLATION_P_VALUE",
    "CONTRADICTION_SHARE",
    "MIN_SUPPORT",
    "MIN_SUPPORT_CHI2",
    "MAX_SHAPE_CHI2",
    "MIN_JOINT_GAIN",
    "ONE_LOG_ENERGY",
)


class Case:
    """One case, whose search is done once for all variants that act after it."""

    def __init__(self, task: Task) -> None:
        from estimation.diagnosis import pipeline

        self.pipeline, self.case = pipeline, draw(task)
        self.steps = {name: getattr(pipeline, name) for name in ("search", "measure", "find_limits", "report")}
        self.known: dict[str, Any] = {}

    def diagnose(self, robot: Any, *, late: bool = False) -> dict[str, Any]:
        """Diagnoses the case up to the decision; `late` takes the search and the free functions of the first run."""
        assert self.case is not None
        result: dict[str, Any] = {}

        def searched(*arguments: Any) -> Any:
            if not late or "search" not in self.known:
                self.known["search"] = self.steps["search"](*arguments)
            return replace(self.known["search"], entries=[])

        def measured(*arguments: Any) -> Any:
            if not late or "measure" not in self.known:
                self.known["measure"] = self.steps["measure"](*arguments)
            return list(self.known["measure"])

        def decided(*stages: Any) -> None:
            validated, decision = stages[5], stages[6]
            places = [found.effect.hypothesis for found in validated.findings]
            result.update(verdict=decision.verdict, named=sorted([h.name, h.joint or 0] for h in places))

        own = {"search": searched, "measure": measured, "find_limits": lambda *_, **__: (), "report": decided}
        try:
            for name, step in own.items():
                setattr(self.pipeline, name, step)
            self.pipeline.diagnose(robot, logs_of(self.case.logs), held_out=logs_of(self.case.unseen) or None)
        finally:
            for name, step in self.steps.items():
                setattr(self.pipeline, name, step)
        return result


def variants(constants: bool, acted: set[str]) -> Iterator[tuple[str, AbstractContextManager[None], bool]]:
    """Gives each variant's name, how it is switched on, and whether it acts after the search alone."""
    from benchmarks.diagnosis_parts.rules import RULES, scaled, without
    from estimation.diagnosis import calibration

    if constants:
        for name in (key for key in vars(calibration) if key.isupper()):
            for factor in (0.5, 2.0):
                yield f"{name} x {factor:g}", scaled(name, factor), name in LATE
    else:
        for name, rule in RULES.items():
            if name in acted:
                yield name, without(rule), rule.late


def run_case(task: Task, constants: bool) -> dict[str, Any]:
    """Runs one case with all variants."""
    from benchmarks.diagnosis_parts.rules import watched
    from robots.common.errors import AssumedValueWarning

    warnings.simplefilter("ignore", AssumedValueWarning)
    own = Case(task)
    if own.case is None:
        return {"key": task.key, "hidden": True}
    acted: set[str] = set()
    truth = sorted([effect.name, effect.joint or 0] for effect in own.case.effects)
    with described(own.case, STRATA[task.stratum].drives) as robot:
        with watched(acted):
            base = own.diagnose(robot)
        first, found = dict(own.known), {}
        for name, changed, late in variants(constants, acted):
            own.known = dict(first)
            with changed:
                found[name] = own.diagnose(robot, late=late)
    return {"key": task.key, "stratum": task.stratum, "truth": truth, "base": base, "variants": found}


def quality(row: dict[str, Any], said: dict[str, Any]) -> float:
    """Rates a result: 1 for the truth, 0.5 for part of it and nothing wrong, 0 for a wrong name or a false alarm."""
    if row["stratum"] == "none":
        return float(said["verdict"] == "none")
    if row["stratum"] == "stranger":
        return 0.0 if said["named"] else 1.0 if said["verdict"] == "unexplained" else 0.5
    if said["named"] == row["truth"]:
        return 1.0
    return 0.5 if all(one in row["truth"] for one in said["named"]) else 0.0


def table(rows: list[dict[str, Any]]) -> None:
    """Prints for each variant in how many cases it changed the result, and for how many that was better or worse."""
    rows = [row for row in rows if "base" in row]
    score = sum(quality(row, row["base"]) for row in rows)
    print(
        f"{len(rows)} cases, score {score:.1f}\n\n| variant | ran | changed | better | worse |\n|---|---|---|---|---|"
    )
    for name in sorted({name for row in rows for name in row["variants"]}):
        ran = [row for row in rows if name in row["variants"]]
        differences = [quality(row, row["variants"][name]) - quality(row, row["base"]) for row in ran]
        changed = sum(row["variants"][name] != row["base"] for row in ran)
        better, worse = (sum(sign * difference > 0 for difference in differences) for sign in (1, -1))
        print(f"| {name} | {len(ran)} | {changed} | {better} | {worse} |")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    verbs = parser.add_subparsers(dest="verb", required=True)
    runs = verbs.add_parser("run", help="run the cases")
    runs.add_argument("--out", type=Path, required=True, help="rows; continued if there")
    runs.add_argument("--constants", action="store_true", help="halve and double constants instead of rules off")
    runs.add_argument("--share", type=float, default=1.0, help="share of the cases")
    runs.add_argument("--first-seed", type=int, default=FIRST)
    add_options(runs)
    prints = verbs.add_parser("table", help="print what rows say")
    prints.add_argument("rows", type=Path, nargs="+")
    options = parser.parse_args()
    if options.verb == "table":
        table([row for path in options.rows for row in read_rows(path)])
        return 0
    known = {row["key"] for row in read_rows(options.out)}
    # One of each stratum in turn, so that a run that is stopped has some of all.
    longest = max(round(options.share * count) for count in COUNTS.values())
    tasks = [
        Task(stratum, options.first_seed + k)
        for k in range(longest)
        for stratum, count in COUNTS.items()
        if k < round(options.share * count)
    ]
    todo = [task for task in tasks if task.key not in known]
    with options.out.open("a", encoding="utf-8") as file:
        results = finished(partial(run_case, constants=options.constants), todo, options)
        for done, (_, row) in enumerate(results, start=1):
            file.write(json.dumps(row, default=float) + "\n")
            file.flush()
            print(f"{done}/{len(todo)} {row['key']}: {row.get('base', 'hidden')}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
