"""How the diagnosis names play, elasticity, a flexible base and a spring in robots that a physics engine integrates.

Run it with ``python benchmarks/closed_loop_plants.py --logs FOLDER --out rows.jsonl``. Each case hides one effect in a
UR10 of MuJoCo, under a position loop at 2 kHz with dry friction: three joints (or bases), three sizes of 2 to 5 % of
the joint's torque, seeds. Logs of 66 s at 250 Hz have 2.5 % of torque noise, half of it coloured, and encoder counts.
Logs stay in the folder, so a changed diagnosis reads them again. Rows are added as they come; a run that was stopped
goes on where it was. ``--figures`` prints the table of the rows that are there.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from itertools import product
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402

from benchmarks.closed_loop_parts.figures import figures  # noqa: E402
from benchmarks.closed_loop_parts.plants import KINDS, UNSEEN, Plant, reference, ride  # noqa: E402
from benchmarks.closed_loop_parts.sizing import noisy, oracle_error, sized  # noqa: E402
from benchmarks.diagnosis import read_rows  # noqa: E402

PLACES = {
    "none": (1,),
    "backlash": (1, 2, 3),
    "joint_elasticity": (1, 2, 3),
    "base_compliance": (1, 2, 3),
    # Over the range of joint 2 a spring is the same as gravity.
    "spring": (1, 3, 5),
}
SIZES = (0.02, 0.035, 0.05)
# A plant in which no amount shows as wanted, to this factor, is left out: its contacts rattle.
FAR = 1.25


def made(key: str, kind: str, place: int, size: float, seed: int, folder: Path) -> dict[str, Any]:
    """Returns the logs and the truth of a case, from the folder if they are there."""
    path = folder / f"{key}.npz"
    if not path.exists():
        plant = Plant(kind="" if kind == "none" else kind, place=place, amount=0.0, seed=seed)
        if kind == "none":
            plant, own, shown, error = plant, ride(plant, reference(100 * seed + place, 66.0)), 0.0, 0.0
        else:
            plant, own, shown = sized(plant, size)
            error = oracle_error(plant, own)
        other = ride(plant, reference(100 * seed + 50 + place, UNSEEN))
        rng = np.random.default_rng([seed, place, 5])
        rows: dict[str, Any] = {"amount": plant.amount, "shown": shown, "oracle": error}
        for name, motion in (("", own), ("unseen_", other)):
            q, tau = noisy(motion, rng)
            rows |= {f"{name}t": motion.t, f"{name}q": q, f"{name}tau": tau, f"{name}slack": motion.slack}
        rows["crossings"] = int(np.sum(np.diff(np.sign(own.slack)) != 0))
        np.savez_compressed(path, **rows)
    with np.load(path) as stored:
        return dict(stored)


def run(key: str, kind: str, place: int, size: float, seed: int, case: dict[str, Any]) -> dict[str, Any]:
    """Diagnoses one case, as `made` returns it."""
    from estimation import diagnose
    from robots import load_robot
    from robots.signals import Log

    logs = [
        Log(t=case[f"{name}t"], q=case[f"{name}q"], tau=case[f"{name}tau"], name=name or "log")
        for name in ("", "unseen_")
    ]
    begun = time.process_time()
    said = diagnose(load_robot("ur10"), logs[0], held_out=logs[1]).to_dict()
    return {
        "key": key,
        "kind": kind,
        "place": place,
        "size": size,
        "seed": seed,
        **{name: float(case[name]) for name in ("amount", "shown", "oracle", "crossings")},
        "verdict": said["verdict"],
        "findings": [
            {n: f.get(n) for n in ("effect", "joint", "parameters", "delta_bic", "gain", "rivals", "pattern")}
            for f in said["findings"]
        ],
        "limits": [x for x in said.get("limits", []) if x["effect"] == kind],
        "cpu": time.process_time() - begun,
    }


def main() -> int:
    """Runs the cases that are missing, and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--logs", type=Path, default=Path("closed_loop_logs"), help="folder of the simulated logs")
    parser.add_argument("--out", type=Path, default=Path("closed_loop_plants.jsonl"), help="rows; continued if there")
    parser.add_argument("--kinds", nargs="+", default=list(KINDS), choices=list(PLACES))
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(1, 11)))
    parser.add_argument("--sizes", type=float, nargs="+", default=list(SIZES))
    parser.add_argument("--places", type=int, nargs="+", default=[1, 2, 3, 5], help="joints, or bases")
    parser.add_argument("--figures", action="store_true", help="print the table, run nothing")
    options = parser.parse_args()
    known = {row["key"] for row in read_rows(options.out)}
    options.logs.mkdir(parents=True, exist_ok=True)
    cases = product(options.seeds, options.sizes, options.kinds)
    for seed, size, kind in () if options.figures else cases:
        for place in (p for p in PLACES[kind] if p in options.places):
            key = f"{kind}-{place}-{size:g}-{seed}"
            if key in known:
                continue
            case = made(key, kind, place, size, seed, options.logs)
            if kind != "none" and not size / FAR < case["shown"] < size * FAR:
                print(f"{key}: left out, because {100 * float(case['shown']):.1f} % of the torque shows at best")
                continue
            row = run(key, kind, place, size, seed, case)
            with options.out.open("a") as file:
                file.write(json.dumps(row, default=float) + "\n")
            named = ", ".join(
                f"{f['effect']} {f['joint'] or ''} {f['parameters'][0]['value']:.3g}"
                if f["parameters"]
                else f["effect"]
                for f in row["findings"]
            )
            print(f"{key}: {row['amount']:.3g} ({100 * row['shown']:.1f} %) -> {row['verdict']}: {named}", flush=True)
    print(figures(read_rows(options.out)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
