"""The public folder of a benchmark."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.records import Record, damage_refused, read_json
from robots.common.tables.table_files import read_table

FORMAT, CASE_FORMAT, BENCHMARK_VERSION = "oed-benchmark", "oed-benchmark-case", 1
REMEDY = "get the file again"
MANIFEST, CASE, LOG, UNSEEN = "benchmark.json", "case.json", "log.csv", "unseen.csv"


@dataclass(frozen=True, kw_only=True)
class BlindCase:
    """What is public of a case.

    Attributes:
        name: such as ``case-001``.
        folder: of its files.
        joints: number of joints.
        yaml: the robot's description with drives.
        urdf: the robot's description without drives.
        noise: RMS of the torque noise over each joint's torque RMS.
        unseen_rows: number of rows of the unseen motion.
    """

    name: str
    folder: Path
    joints: int
    yaml: Path
    urdf: Path
    noise: float
    unseen_rows: int

    @property
    def log(self) -> Path:
        """The log: t, q, tau."""
        return self.folder / LOG

    @property
    def unseen(self) -> Path:
        """The unseen motion: t, q."""
        return self.folder / UNSEEN


@dataclass(frozen=True, kw_only=True)
class Benchmark(Record):
    """A benchmark without its answers.

    Attributes:
        folder: of its files.
        identity: random name that answers must state.
        commitment: SHA-256 of the file of sealed answers.
        cases: names of its cases.
    """

    ENTRIES = ("folder", "id=identity", "cases", "commitment")

    folder: Path
    identity: str
    commitment: str
    cases: tuple[str, ...]

    def case(self, name: str) -> BlindCase:
        """Reads what is known of a case.

        Args:
            name: of the case.

        Raises:
            InputError: a case file that is missing or damaged.
        """
        file = self.folder / name / CASE
        data = read_json(file, CASE_FORMAT, BENCHMARK_VERSION, remedy=REMEDY)
        with damage_refused(file, remedy=REMEDY):
            return BlindCase(
                name=name,
                folder=file.parent,
                joints=int(data["joints"]),
                yaml=file.parent / data["robot"]["yaml"],
                urdf=file.parent / data["robot"]["urdf"],
                noise=float(data["noise"]["torque_rms_over_signal_rms"]),
                unseen_rows=int(data["unseen"]["rows"]),
            )

    def summary(self) -> str:
        """Says what the benchmark is."""
        return f"benchmark {self.identity}: {len(self.cases)} cases, answers sealed by SHA-256 {self.commitment}"


def read_benchmark(folder: str | PathLike[str]) -> Benchmark:
    """Reads the public folder of a benchmark.

    Args:
        folder: as `make_benchmark` wrote it.

    Raises:
        InputError: a folder that is no benchmark, or one of another version.
    """
    folder = Path(folder)
    file = folder / MANIFEST
    if not file.is_file():
        raise InputError(
            f"is no benchmark: it has no {MANIFEST}", file=folder, remedy="make one with `oed benchmark make FOLDER`"
        )
    data = read_json(file, FORMAT, BENCHMARK_VERSION, remedy=REMEDY)
    with damage_refused(file, remedy=REMEDY):
        return Benchmark(
            folder=folder,
            identity=str(data["id"]),
            commitment=str(data["commitment"]["sha256"]),
            cases=tuple(map(str, data["cases"])),
        )


def default_sealed(folder: Path) -> Path:
    """Returns where the answers of a folder lie by default."""
    absolute = folder.absolute()
    return folder.parent / f"{absolute.name}.answers"


def read_columns(file: Path, names: list[str]) -> Array:
    """Reads columns (N, columns) of a CSV.

    Raises:
        InputError: a column that is missing, or a value that is not a finite number.
    """
    table = read_table(file, wanted=lambda name: name in names)
    missing = [name for name in names if name not in table.columns]
    if missing:
        raise InputError("no such column", file=file, column=missing[0], allowed=", ".join(names))
    values = np.column_stack([np.asarray(table.columns[name], dtype=float) for name in names])
    return values
