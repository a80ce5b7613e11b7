"""The sealed answers: one ZIP file, whose hash the public folder states."""

from __future__ import annotations

import hashlib
import io
import json
import secrets
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from oed.benchmarks.folders import BENCHMARK_VERSION, Benchmark
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.files import existing_file

SEALED_FORMAT = "oed-benchmark-truth"
ANSWERS = "answers.json"


@dataclass(frozen=True, kw_only=True)
class HiddenEffect:
    """An effect that a case hides.

    Attributes:
        effect: its exact name, or ``outside``.
        formula: the plant's class, which separates effects of one name.
        joint: from 1, or None for the whole robot.
        visible: its visible size.
        parameters: true values that are scored, by name.
    """

    effect: str
    formula: str
    joint: int | None
    visible: float
    parameters: dict[str, float]


@dataclass(frozen=True, kw_only=True)
class Truth:
    """What a case hides.

    Attributes:
        stratum: nothing, one, two or outside.
        effects: what is hidden.
        noise: RMS of the noise (n,) in the held-back torque [N m].
        torque: t and the held-back torque (N, 1 + n) [s, N m].
    """

    stratum: str
    effects: tuple[HiddenEffect, ...]
    noise: Array
    torque: Array


def seal(stream: BinaryIO, identity: str, cases: Mapping[str, tuple[dict[str, Any], Array]]) -> str:
    """Writes the sealed answers and returns their SHA-256.

    The file contains 32 random bytes, so that nobody can guess it and compare hashes.

    Args:
        stream: where to write.
        identity: of the benchmark.
        cases: what is hidden, and t and the held-back torque (N, 1 + n), by the case's name.
    """
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        data = {
            "format": SEALED_FORMAT,
            "format_version": BENCHMARK_VERSION,
            "benchmark": identity,
            "salt": secrets.token_hex(32),
            "cases": {name: truth for name, (truth, _) in cases.items()},
        }
        archive.writestr(ANSWERS, json.dumps(data, indent=1) + "\n")
        for name, (_, torque) in cases.items():
            text = io.StringIO()
            header = ",".join(["t", *(f"tau{j + 1}" for j in range(torque.shape[1] - 1))])
            np.savetxt(text, torque, delimiter=",", header=header, comments="", fmt="%.9g")
            archive.writestr(f"{name}.csv", text.getvalue())
    stream.write(content.getvalue())
    return hashlib.sha256(content.getvalue()).hexdigest()


def unseal(path: str | PathLike[str], benchmark: Benchmark) -> dict[str, Truth]:
    """Reads the sealed answers of a benchmark.

    Args:
        path: the file that `make_benchmark` wrote beside the folder.
        benchmark: the public part.

    Raises:
        InputError: a file that is missing, was changed, or belongs to another benchmark.
    """
    path = existing_file(Path(path))
    content = path.read_bytes()
    try:
        archive = zipfile.ZipFile(io.BytesIO(content))
        data = json.loads(archive.read(ANSWERS))
        identity = data["benchmark"] if data["format"] == SEALED_FORMAT else None
    except (zipfile.BadZipFile, KeyError, TypeError, ValueError, UnicodeDecodeError) as error:
        raise InputError(
            "is no file of sealed answers, or a damaged one", file=path, allowed="what `oed benchmark make` wrote"
        ) from error
    if identity != benchmark.identity:
        raise InputError(
            f"holds the answers of another benchmark ({identity})",
            file=path,
            allowed=f"those of {benchmark.identity}, of {benchmark.folder}",
        )
    digest = hashlib.sha256(content).hexdigest()
    if digest != benchmark.commitment:
        raise InputError(
            f"was changed after the benchmark was made: its SHA-256 is {digest[:16]}...",
            file=path,
            allowed=f"{benchmark.commitment[:16]}..., as {benchmark.folder / 'benchmark.json'} states",
            remedy="get the original file",
        )
    return {name: _truth(entry, archive.read(f"{name}.csv")) for name, entry in data["cases"].items()}


def _truth(entry: dict[str, Any], table: bytes) -> Truth:
    return Truth(
        stratum=entry["stratum"],
        effects=tuple(
            HiddenEffect(**{name: effect[name] for name in ("effect", "formula", "joint", "visible", "parameters")})
            for effect in entry["effects"]
        ),
        noise=np.array(entry["noise"], dtype=float),
        torque=np.loadtxt(io.BytesIO(table), delimiter=",", skiprows=1),
    )
