"""Freezes what each part says of a fixed set of logs, and compares a later version with it.

Run ``python benchmarks/frozen.py run --data FOLDER --out before.jsonl``, the same with ``after.jsonl`` on the later
version, and ``python benchmarks/frozen.py compare before.jsonl after.jsonl``. FOLDER holds the published logs.
The parts of ``--part``:

- gate: verdicts on the published logs, whole, halved and thirded; on virtual logs whose torque has another meaning; on
  mangled logs; on the logs of published failures, with ``--cases``.
- estimates: parameters, errors, bands and held-out predictions of the published logs, of virtual robots, and of each
  estimator.
- payloads, forces, comparisons, thermal, monitor: virtual robots of known truth.
- diagnoses: 84 cases of ``oed/benchmarks/truth`` and the published logs.
- small: some of these that need no published log. Continuous integration compares them with ``frozen_small.jsonl``.

Texts are left out: a change of wording is no change of behaviour. A run that was stopped goes on where it was.
Processors round differently: compare two runs of one machine.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import traceback
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

from benchmarks import diagnosis_real, torque_columns  # noqa: E402
from benchmarks.diagnosis import read_rows  # noqa: E402
from benchmarks.frozen_parts import campaigns, diagnoses, estimates, verdicts  # noqa: E402
from benchmarks.frozen_parts.comparing import RELATIVE, compare, headline  # noqa: E402
from benchmarks.parallel_work import add_options, finished  # noqa: E402
from benchmarks.transfer_parts import splits  # noqa: E402
from estimation.estimators import ESTIMATORS  # noqa: E402
from robots.common.errors import OedError  # noqa: E402


@dataclass(frozen=True)
class Item:
    """One row of the frozen sets: its key, which begins with its part, and what computes it."""

    key: str
    work: Callable[[], dict[str, Any]]


def gate(data: Path | None, cases: Path | None) -> Iterator[Item]:
    """Verdicts of the gate."""
    for name in diagnosis_real.SETS if data else ():
        yield Item(f"gate/measured/{name}", partial(verdicts.check_measured, name, data))
    for name, seed in product(torque_columns.ROBOTS, range(2)):
        yield Item(f"gate/foreign/{name}-{seed}", partial(verdicts.check_foreign, name, seed))
    for number in range(verdicts.MANGLED):
        yield Item(f"gate/mangled/{number}", partial(verdicts.check_mangled, number))
    for folder in sorted(path.parent for path in cases.glob("*/README.md")) if cases else ():
        yield Item(f"gate/published/{folder.name}", partial(verdicts.check_published, folder))


def estimated(data: Path | None, _: Path | None) -> Iterator[Item]:
    """Estimates with errors, bands and predictions."""
    for name in splits.SETS if data else ():
        yield Item(f"estimates/measured/{name}", partial(estimates.run_splits, name, data))
    for kind, seed in estimates.tasks():
        yield Item(f"estimates/virtual/{kind}-{seed}", partial(estimates.run_virtual, kind, seed))
    for method in ESTIMATORS:
        yield Item(f"estimates/method/{method}", partial(estimates.run_estimator, "ur10", method))


def virtual(_: Path | None, __: Path | None) -> Iterator[Item]:
    """Payloads, forces, comparisons, thermal models and weeks of the monitor."""
    for kind, seed in product(("ur10", "panda"), range(2)):
        yield Item(f"payloads/{kind}-{seed}", partial(campaigns.run_payloads, kind, seed))
    for seed in range(2):
        yield Item(f"forces/{seed}", partial(campaigns.run_forces, seed))
    for damaged, seed in product((None, 2), range(3)):
        yield Item(f"comparisons/{damaged or 'healthy'}-{seed}", partial(campaigns.run_comparison, seed, damaged))
    for order in ("first", "second", "advanced", "fractional"):
        yield Item(f"thermal/{order}", partial(campaigns.run_thermal, order, 0))
    yield Item("thermal/campaign", partial(campaigns.run_campaign, 1))
    for stops, week in product((False, True), range(4)):
        yield Item(f"monitor/{'stops' if stops else 'cycles'}-{week}", partial(campaigns.run_week, week, stops))


def diagnosed(data: Path | None, _: Path | None) -> Iterator[Item]:
    """Diagnoses."""
    for name in diagnosis_real.SETS if data else ():
        yield Item(f"diagnoses/measured/{name}", partial(diagnoses.run_set, name, data))
    for task in diagnoses.CASES:
        yield Item(f"diagnoses/{task.key}", partial(diagnoses.run_case, task))


def small() -> list[Item]:
    """What continuous integration can afford."""
    kept = {"gate/foreign/planar arm-0", "estimates/method/wls"}
    kept |= {f"gate/mangled/{number}" for number in range(12)}
    return [item for item in everything(None, None) if item.key in kept]


def everything(data: Path | None, cases: Path | None) -> list[Item]:
    """All rows; those of published logs where their folder is given."""
    return [item for part in (gate, estimated, virtual, diagnosed) for item in part(data, cases)]


def row_of(item: Item) -> dict[str, Any]:
    """Computes one row; a refusal is a result, and so is a failure."""
    warnings.simplefilter("ignore")
    start = sum(os.times()[:4])  # of this process and its children
    try:
        found = item.work()
    except OedError as error:
        found = {"refused": type(error).__name__, "text": str(error)}
    except Exception:
        found = {"refused": "traceback", "text": traceback.format_exc()}
    # As it is read back, so that rows of a file and of this run compare.
    row = json.loads(json.dumps(found, default=float))
    return {"key": item.key, "seconds": sum(os.times()[:4]) - start, **row}


def run(options: argparse.Namespace) -> int:
    """Computes what is not in the file yet and appends it."""
    cases = options.cases or (options.data.parent / "cases" if options.data else None)
    items = small() if options.part == ["small"] else everything(options.data, cases)
    known = {row["key"] for row in read_rows(options.out)}
    wanted = [i for i in items if "small" in options.part or not options.part or i.key.startswith(tuple(options.part))]
    todo = [item for item in wanted[:: options.every] if item.key not in known]
    with options.out.open("a", encoding="utf-8") as file:
        for done, (_, row) in enumerate(finished(row_of, todo, options), start=1):
            file.write(json.dumps(row, sort_keys=True) + "\n")
            file.flush()
            print(f"{done}/{len(todo)} {row['key']}: {headline(row)}, {row['seconds']:.0f} s", flush=True)
    return 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(dest="verb", required=True)
    runs = verbs.add_parser("run", help="compute the rows")
    runs.add_argument("--out", type=Path, required=True, help="rows; continued if there")
    runs.add_argument("--data", type=Path, help="folder of the published logs; without, they are left out")
    runs.add_argument("--cases", type=Path, help="folder of the published failures; beside the logs by default")
    runs.add_argument("--part", nargs="+", default=[], help="beginnings of keys, such as gate, or small")
    runs.add_argument("--every", type=int, default=1, help="run each N-th row alone: a quick look")
    add_options(runs)
    compares = verbs.add_parser("compare", help="two files of rows")
    compares.add_argument("old", type=Path)
    compares.add_argument("new", type=Path)
    compares.add_argument("--most", type=int, default=5, help="differences printed of one row")
    compares.add_argument("--tolerance", type=float, default=RELATIVE, help="relative, of numbers")
    compares.add_argument("--texts", action="store_true", help="compare sentences, too")
    options = parser.parse_args()
    if options.verb == "run":
        return run(options)
    return compare(options.old, options.new, most=options.most, relative=options.tolerance, texts=options.texts)


if __name__ == "__main__":
    sys.exit(main())
