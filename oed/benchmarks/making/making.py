"""The verb `make_benchmark`: blind cases in a folder, and the sealed answers in a file beside it."""

from __future__ import annotations

import json
import secrets
from collections.abc import Sequence
from functools import partial
from os import PathLike
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from oed.benchmarks.folders import (
    BENCHMARK_VERSION,
    CASE_FORMAT,
    FORMAT,
    MANIFEST,
    UNSEEN,
    Benchmark,
    default_sealed,
    read_benchmark,
)
from oed.benchmarks.folders import CASE as CASE_FILE
from oed.benchmarks.folders import LOG as LOG_FILE
from oed.benchmarks.making.drawing import Array, DrawnCase, draw
from oed.benchmarks.making.options import MakeOptions
from oed.benchmarks.making.strata import tasks
from oed.benchmarks.sealing import seal
from oed.benchmarks.taxonomy import CLASSES, PARAMETERS, UNKNOWN
from oed.benchmarks.truth.description import write_description
from oed.benchmarks.truth.plant import CONTROL_STEP, LOG_EVERY, LOG_PAUSE
from robots.common.errors import InputError
from robots.common.files import ResultFolder, open_atomic, sha256
from robots.common.parallel import parallel_map
from robots.common.progress import Progress
from robots.version import VERSION as TOOL


def make_benchmark(
    folder: str | PathLike[str],
    *,
    options: MakeOptions | None = None,
    seed: int | None = None,
    sealed: str | PathLike[str] | None = None,
    force: bool = False,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Benchmark:
    """Writes blind cases to a folder, and what they hide to a file that is sealed by its hash in the folder.

    Args:
        folder: for the public part: robots, logs, unseen motions.
        options: what the benchmark holds.
        seed: of everything random except the salt. By default a secret one: whoever knows the seed knows the answers.
        sealed: the file for the sealed answers; by default the folder's name with ``.answers``.
        force: whether files of the same names may be replaced.
        workers: number of processes; None for one per core.
        progress: receives the number of finished cases.

    Returns:
        The benchmark.

    Raises:
        InputError: an option out of its range; a folder or file that exists, or cannot be written.
        InfeasibleError: no robot shows an effect of the size that was asked for.
    """
    options = options or MakeOptions()
    folder = Path(folder)
    target = Path(sealed) if sealed is not None else default_sealed(folder)
    if target.resolve().is_relative_to(folder.resolve()):
        raise InputError("lies in the public folder", file=target, remedy="choose a file outside of it")
    rng = np.random.default_rng(secrets.randbits(128) if seed is None else seed)
    todo = list(tasks(options.cases, options.robots, rng))
    names = [f"case-{task.number:03d}" for task in todo]
    identity = secrets.token_hex(8)
    with ResultFolder(folder, force, names=[MANIFEST]) as out, open_atomic(target, force=force) as stream:
        drawn = parallel_map(
            partial(draw, size=options.size, noise=options.noise, duration=options.duration, unseen=options.unseen),
            todo,
            workers=workers,
            progress=progress,
            task="drawing cases",
        )
        for name, case in zip(names, drawn, strict=True):
            write_case(out, name, case)
        digest = seal(stream, identity, dict(zip(names, map(_hidden, drawn), strict=True)))
        out.path(MANIFEST).write_text(json.dumps(_manifest(identity, names, digest), indent=2) + "\n", encoding="utf-8")
    assert sha256(target) == digest
    return read_benchmark(folder)


def _hidden(case: DrawnCase) -> tuple[dict[str, object], np.ndarray]:
    joints = case.machine.n
    return case.truth, np.delete(case.unseen, np.s_[1 : 1 + joints], axis=1)


def _manifest(identity: str, names: Sequence[str], digest: str) -> dict[str, object]:
    return {
        "format": FORMAT,
        "format_version": BENCHMARK_VERSION,
        "id": identity,
        "tool_version": TOOL,
        "cases": list(names),
        "hidden": "each case hides nothing, one effect, two effects, or one effect that no name below fits",
        "commitment": {"sha256": digest, "of": "the file of sealed answers, which contains 32 random bytes"},
        "effects": {kind: list(group.effects) for kind, group in CLASSES.items()} | {UNKNOWN: []},
        "parameters": {name: {"unit": p.unit, "effects": list(p.effects)} for name, p in PARAMETERS.items()},
    }


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
        "format_version": BENCHMARK_VERSION,
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
            "note": f"on the log's clock, after a rest of {LOG_PAUSE:g} s; its torque is held back",
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
