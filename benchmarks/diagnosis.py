"""How well the diagnosis finds what is hidden in logs of a plant that shares no code with it.

Run it with ``python benchmarks/diagnosis.py``. Cases are drawn by ``oed/benchmarks/truth``: four kinds of robot,
periodic and aperiodic motion under a closed position loop, logs of t, q and tau at 250 Hz with 2.5 % of coloured
noise. Sizes are the share of a joint's torque RMS that shows beyond the base model. Rows go to a JSON-lines file as
they come; a run that was stopped goes on where it was. Seeds below 1000 are the benchmark's own: no threshold is tuned
on them.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
import time
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

from benchmarks.diagnosis_parts.figures import figures  # noqa: E402
from benchmarks.diagnosis_parts.running import run  # noqa: E402
from benchmarks.diagnosis_parts.strata import STRATA, TUNING, Task, tasks  # noqa: E402
from benchmarks.parallel_work import add_options, finished  # noqa: E402


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=float, default=1.0, help="share of the full number of cases (1540)")
    parser.add_argument("--strata", nargs="+", default=list(STRATA), choices=list(STRATA))
    add_options(parser)
    parser.add_argument("--out", type=Path, default=Path("diagnosis_benchmark.jsonl"), help="rows; continued if there")
    parser.add_argument("--first-seed", type=int, default=0, help=f"{TUNING} or more to tune")
    parser.add_argument(
        "--figures", action="store_true", help="print the figures of the rows that are there, run nothing"
    )
    return parser.parse_args()


def read_rows(path: Path) -> list[dict[str, Any]]:
    """Reads the rows that are there; a last line cut short by an interrupt is left out."""
    rows = []
    for line in path.read_text().splitlines() if path.exists() else ():
        try:
            rows.append(json.loads(line))
        except json.JSONDecodeError:
            continue
    return rows


def work(todo: list[Task], options: argparse.Namespace) -> None:
    """Runs cases and appends their rows."""
    start = time.perf_counter()
    with options.out.open("a") as file:
        for done, (_, row) in enumerate(finished(run, todo, options), start=1):
            file.write(json.dumps(row, default=float) + "\n")
            file.flush()
            said = ", ".join(f"{f['effect']} {f['joint'] or ''}" for f in row.get("findings", ()))
            true = ", ".join(f"{e['effect']} {e['joint'] or ''}" for e in row.get("truth", ()))
            pace = (time.perf_counter() - start) / done
            verdict = row.get("verdict", row["status"])
            print(
                f"{done}/{len(todo)} {row['key']}: {true or 'nothing'} -> {verdict}: {said} ({pace:.1f} s a case)",
                flush=True,
            )


def main() -> int:
    options = arguments()
    rows = read_rows(options.out)
    if not options.figures:
        known = {row["key"] for row in rows}
        todo = [t for t in tasks(options.strata, options.count, options.first_seed) if t.key not in known]
        if todo:
            work(todo, options)
        rows = read_rows(options.out)
    print(f"{platform.processor() or platform.machine()}, Python {platform.python_version()}, {len(rows)} cases")
    print(figures(rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
