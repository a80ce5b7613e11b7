"""The public files of a case: the robot as described, the log, the unseen motion, and what is known."""

from __future__ import annotations

import json
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from oed.benchmarks.folders import CASE as CASE_FILE
from oed.benchmarks.folders import CASE_FORMAT, UNSEEN, VERSION
from oed.benchmarks.folders import LOG as LOG_FILE
from oed.benchmarks.making.drawing import Array, DrawnCase
from oed.benchmarks.truth.description import write_description
from oed.benchmarks.truth.plant import CONTROL_STEP, LOG_EVERY, PAUSE
from robots.common.files import ResultFolder

DIGITS = "%.9g"


def write_case(out: ResultFolder, name: str, case: DrawnCase) -> None:
    """Writes a case into its folder.

    Args:
        out: the open folder of the benchmark.
        name: of the case.
        case: what to write.
    """
    n = case.machine.n
    with TemporaryDirectory() as scratch:
        described = write_description(case.machine, Path(scratch))
        urdf = described.with_suffix(".urdf")
        for path in (described, urdf):
            out.path(f"{name}/{path.name}").write_text(path.read_text(encoding="utf-8"), encoding="utf-8")
    positions = [f"q{j + 1}" for j in range(n)]
    torques = [f"tau{j + 1}" for j in range(n)]
    write_columns(out.path(f"{name}/{LOG_FILE}"), ["t", *positions, *torques], case.log)
    write_columns(out.path(f"{name}/{UNSEEN}"), ["t", *positions], case.unseen[:, : n + 1])
    period = CONTROL_STEP * LOG_EVERY
    facts = {
        "format": CASE_FORMAT,
        "format_version": VERSION,
        "case": name,
        "joints": n,
        "robot": {
            "yaml": described.name,
            "urdf": urdf.name,
            "note": (
                "the description is nominal: masses, centres of mass and second moments of mass differ from the true "
                "ones by up to 8 %, rotor inertias by up to 15 %; friction and torque offsets are not stated"
            ),
        },
        "log": {"file": LOG_FILE, "rows": len(case.log), "motion": case.motion},
        "unseen": {
            "file": UNSEEN,
            "rows": len(case.unseen),
            "note": f"on the log's clock, after a rest of {PAUSE:g} s; its torque is held back",
        },
        "sample_period": period,
        "noise": {
            "torque_rms_over_signal_rms": case.truth["noise_level"],
            "note": "half of the variance is white, half is coloured; it is heavy-tailed and shared by joints at times",
        },
        "units": {"t": "s", "q": "rad", "tau": "N m"},
    }
    out.path(f"{name}/{CASE_FILE}").write_text(json.dumps(facts, indent=2) + "\n", encoding="utf-8")


def write_columns(path: Path, names: list[str], values: Array) -> None:
    """Writes a CSV of columns (N, columns) under a bare header line."""
    np.savetxt(path, values, delimiter=",", header=",".join(names), comments="", fmt=DIGITS)
