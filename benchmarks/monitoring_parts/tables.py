"""The figures of the monitoring studies, from the rows that they left."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from estimation.uncertainty.quantiles import share_interval


def print_table(folder: Path, variants: Iterable[str], *, cycle: float, damage: float) -> None:
    """Prints the figures of all rows.

    Args:
        folder: with a file of rows for each study.
        variants: names of the monitors that are compared.
        cycle: within which a damage is to be named [s].
        damage: its size, as a share.
    """
    for study in ("thesis", "night", "start", "healthy", "weeks", "stops", "speed"):
        file = folder / f"{study}.jsonl"
        rows = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
        if not rows:
            continue
        print(f"{study}: {len(rows)} rows")
        for name in variants:
            found = [row[name] for row in rows if name in row]
            if not found:
                continue
            if study in ("thesis", "night"):
                seen = [f for f in found if f["delay"] is not None]
                good = [
                    f
                    for f in seen
                    if f["delay"] <= cycle
                    and f["dated"]
                    and (f["width"] <= cycle or study == "night")
                    and abs(f["size"] - 100 * damage) <= 5
                ]
                clean = sum(not f["false"] for f in found)
                print(
                    f"  {name:14} named in {len(seen)} of {len(found)}; within 5 min, dated within it, size within 5 "
                    f"points: {len(good)}; without any other finding: {clean}; sizes "
                    f"{_range([f['size'] for f in seen])} %; delays {_range([f['delay'] for f in seen])} s; intervals "
                    f"hold 32 %: {sum(bool(f['covered']) for f in seen)}; heat {_range([f['heat'] for f in found])} %"
                )
            elif study == "start":
                ill = [row[name] for row in rows if row["damaged"]]
                well = [row[name] for row in rows if not row["damaged"]]
                held = [held for f in ill for held in f["covered"]]
                print(
                    f"  {name:14} damaged: found in {sum(f['found'] for f in ill)} of {len(ill)}, intervals hold "
                    f"30 % in {sum(held)} of {len(held)}; healthy: red {sum(f['act'] > 0 for f in well)}, amber "
                    f"{sum(bool(f['false']) and not f['act'] for f in well)} of {len(well)}; beside a damage: "
                    f"{sum(len(f['false']) for f in ill)} other findings"
                )
            elif study == "healthy":
                hours, motion = sum(row["hours"] for row in rows), sum(row["motion"] for row in rows)
                print(f"  {name:14} {sum(map(len, found))} false alarms in {hours:.0f} h, {motion:.1f} h of it logged")
            elif study in ("weeks", "stops"):
                right = sum(f["right"] for f in found)
                low, high = share_interval(right, len(found))
                by = {row["kind"]: [0, 0] for row in rows}
                for row in rows:
                    by[row["kind"]][0] += row[name]["right"]
                    by[row["kind"]][1] += 1
                sizes = np.array([s for f in found for s in f["sizes"]])
                held = np.mean((sizes[:, 2] <= sizes[:, 1]) & (sizes[:, 1] <= sizes[:, 3])) if len(sizes) else np.nan
                print(
                    f"  {name:14} kind and joint right in {right} of {len(found)} ({100 * low:.0f} to {100 * high:.0f} "
                    f"%); intervals of sizes hold the truth in {100 * held:.0f} % of {len(sizes)}; "
                    + ", ".join(f"{kind} {a}/{b}" for kind, (a, b) in sorted(by.items()))
                )
            else:
                print(f"  {name:14} {np.median(found):.0f} times real time")


def _range(values: Sequence[float]) -> str:
    return f"{min(values):.3g} to {max(values):.3g}" if values else "none"
