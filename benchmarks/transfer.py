"""How well models predict motions that were not recorded: splits of measured logs that are extrapolations.

Run ``python benchmarks/transfer.py FOLDER``, where FOLDER holds the published logs as ``tests`` read them, or
``python benchmarks/transfer.py --virtual 10`` for so many virtual robots of each kind. The rival is a plain script
(``transfer_parts/plain.py``). Errors are residual RMS over the torque's standard deviation, of the rows that count; the
band is that of ``oed predict``, which should hold 95 %.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from numpy.typing import NDArray

from benchmarks.transfer_parts import plain, virtual
from benchmarks.transfer_parts.splits import SETS, Split
from estimation import diagnose, identify, predict
from estimation.logs.clocks import on_one_clock
from estimation.regressions.preparation import torque_of
from robots.common.errors import AssumedValueWarning, OedError

Array = NDArray[np.float64]


def rival_error(split: Split) -> Array:
    """Error (n,) of the plain script."""
    chain = split.robot.chain
    joints = [(j.kind, np.array(j.rotation), np.array(j.translation), np.array(j.axis)) for j in chain.joints]
    model = plain.build_model(joints, np.asarray(chain.gravity, dtype=float))
    logs = [(log.t, log.q, torque_of(split.robot, log)) for log in split.fit if len(log) > 60]
    values = plain.fit(model, logs)
    return _error(split, plain.predict(model, values, split.test.t, split.test.q))


def own_error(split: Split, options: dict[str, Any], how: str) -> tuple[Array, Array]:
    """Error (n,) of this project's model, and share (n,) of the rows within its band."""
    if how == "diagnose":
        model = diagnose(split.robot, on_one_clock(list(split.fit))).model
    else:
        model = identify(split.robot, list(split.fit), check=False, **options).model
    found = predict(model, split.test)
    coverage = np.full(split.robot.n, np.nan)
    if found.band is not None and found.measured is not None:
        coverage = (np.abs(found.measured - found.predicted) <= found.band)[split.rows].mean(axis=0)
    return _error(split, found.predicted), coverage


def _error(split: Split, predicted: Array) -> Array:
    measured = torque_of(split.robot, split.test)
    moves = np.ptp(split.test.q, axis=0) > 0
    error = np.sqrt(np.mean((measured - predicted)[split.rows] ** 2, axis=0)) / measured.std(axis=0)
    return np.where(moves, error, np.nan)


def run_virtual(count: int, options: dict[str, Any]) -> None:
    """Prints per kind of robot the error from the slow log, over that from a log of the full motion, and the band."""
    print("| robot | over the full fit: median | worst | over the plain script: median | worst | in the band | least |")
    print("|---|---|---|---|---|---|---|")
    for kind in virtual.KINDS:
        rows = []
        for seed in range(count):
            slow, full = virtual.slowed(kind, seed)
            error, coverage = own_error(slow, options, "identify")
            best, _ = own_error(full, options, "identify")
            rows.append(
                (np.mean(error) / np.mean(best), np.mean(error) / np.mean(rival_error(slow)), np.mean(coverage))
            )
        to_full, to_plain, held = np.array(rows).T
        print(
            f"| {kind} | {np.median(to_full):.2f} | {to_full.max():.2f} | {np.median(to_plain):.2f} "
            f"| {to_plain.max():.2f} | {100 * held.mean():.0f} % | {100 * held.min():.0f} % |",
            flush=True,
        )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path, nargs="?", help="of the published logs, a folder a set")
    parser.add_argument("--virtual", type=int, default=0, help="virtual robots of each kind, instead of logs")
    parser.add_argument("--sets", nargs="+", default=list(SETS), choices=list(SETS))
    parser.add_argument("--friction", default=None, help="of identify; its default otherwise")
    parser.add_argument("--how", choices=("identify", "diagnose"), default="identify")
    options = parser.parse_args()
    warnings.simplefilter("ignore", AssumedValueWarning)
    given = {"friction": options.friction} if options.friction else {}
    if options.virtual:
        run_virtual(options.virtual, given)
        return 0
    if options.folder is None or not options.folder.is_dir():
        parser.error(f"no folder {options.folder}" if options.folder else "give the folder of the logs, or --virtual")
    ratios = []
    print("| split | plain | own | ratio | own by joint | in the band | worst joint |\n|---|---|---|---|---|---|---|")
    for name in options.sets:
        for split in SETS[name](options.folder):
            rival = rival_error(split)
            try:
                own, coverage = own_error(split, given, options.how)
            except OedError as error:
                print(f"| {split.name} | {np.nanmean(rival):.3f} | refused: {error} |", flush=True)
                continue
            ratios.append(float(np.nanmean(own) / np.nanmean(rival)))
            joints = " ".join(f"{value:.2g}" for value in own)
            print(
                f"| {split.name} | {np.nanmean(rival):.3f} | {np.nanmean(own):.3f} | {ratios[-1]:.2f} | {joints} "
                f"| {100 * np.nanmean(coverage):.0f} % | {100 * np.nanmin(coverage):.0f} % |",
                flush=True,
            )
    if ratios:
        print(f"\nratio: median {np.median(ratios):.2f}, worst {max(ratios):.2f}, of {len(ratios)} splits")
    return 0


if __name__ == "__main__":
    sys.exit(main())
