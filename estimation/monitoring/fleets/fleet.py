"""The verb for fleets: one robot after the other by processes, what is done kept in files."""

from __future__ import annotations

import json
from concurrent.futures import Executor
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from os import PathLike
from pathlib import Path
from typing import Any

from estimation.logs.mappings.mapping import LogMapping, read_mapping
from estimation.monitoring.fleets.members import Member, find_members
from estimation.monitoring.fleets.result import FleetResult
from estimation.monitoring.fleets.robot_row import RobotRow
from estimation.monitoring.log_row import LogRow
from estimation.monitoring.monitor import Monitor
from estimation.monitoring.settings import MonitorSettings
from estimation.monitoring.stored_logs.log_files import read_each
from estimation.monitoring.stored_logs.log_monitoring import monitor_logs
from estimation.monitoring.windows.baseline import Baseline, read_baseline
from robots.common.errors import InputError, OedError
from robots.common.files import sha256, write_atomic
from robots.common.parallel import parallel_map
from robots.common.progress import Progress
from robots.common.records import read_json

KEPT_VERSION = 2


@dataclass(frozen=True, kw_only=True)
class Task:
    """One robot's work.

    Attributes:
        member: the robot.
        model: the file of its model.
        digest: of that file.
        settings: of the monitors.
        kept: folder of what is done.
        mapping: of the logs' columns, or None.
    """

    member: Member
    model: Path
    digest: str
    settings: MonitorSettings
    kept: Path
    mapping: LogMapping | None


def monitor_fleet(
    folder: str | PathLike[str],
    model: str | PathLike[str],
    *,
    kept: str | PathLike[str],
    settings: MonitorSettings | None = None,
    mapping: LogMapping | str | PathLike[str] | None = None,
    workers: int | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> FleetResult:
    """Monitors all robots of a folder.

    Each robot's row and monitor are written when it is done. A later run with the same model and settings takes them
    from there, and sends new logs only.

    Args:
        folder: see `find_members`.
        model: of the robots, a `model.json` or its folder; a robot's own model goes before it.
        kept: folder for what is done; it is made if need be.
        settings: of the monitors.
        mapping: of the logs' columns.
        workers: number of processes; one per core by default.
        executor: does the work instead, such as that of `robots.common.clusters.cluster`.
        progress: receives the number of finished robots.

    Returns:
        The rows, worst first.

    Raises:
        InputError: no logs, no model, or a worker that does not see them.
    """
    # A cluster's workers stand in another folder.
    members = [member.absolute() for member in find_members(folder)]
    place = Path(model).absolute()
    file = place / "model.json" if place.is_dir() else place
    read_baseline(file)
    columns = mapping if isinstance(mapping, LogMapping) or mapping is None else read_mapping(mapping)
    target = Path(kept).absolute()
    target.mkdir(parents=True, exist_ok=True)
    digests = {path: sha256(path) for path in {file, *(m.model for m in members if m.model is not None)}}
    tasks = [
        Task(
            member=member,
            model=member.model or file,
            digest=digests[member.model or file],
            settings=settings or MonitorSettings(),
            kept=target,
            mapping=columns,
        )
        for member in members
    ]
    rows = parallel_map(
        robot_row, tasks, executor=executor, workers=workers, progress=progress, task="monitoring the fleet"
    )
    ordered = sorted((row for row, _ in rows), key=lambda row: row.order)
    top = Path(folder).absolute()
    return FleetResult(
        rows=tuple(ordered),
        resumed=sum(done for _, done in rows),
        single=sum(m.files == (m.files[0],) and m.files[0].parent == top for m in members),
    )


def robot_row(task: Task) -> tuple[RobotRow, bool]:
    """Monitors one robot, or takes what an earlier run has kept of it; never raises for its logs.

    Returns:
        The row, and whether all of it was done before.
    """
    file, state = _kept_files(task)
    files = list(task.member.files)
    logs = {str(path): _version(path) for path in files}
    head = {
        "version": KEPT_VERSION,
        "model": task.digest,
        "settings": asdict(task.settings),
        "mapping": None if task.mapping is None else task.mapping.model_dump(mode="json"),
    }
    kept = _read(file)
    if kept is not None and {key: kept.get(key) for key in head} != head:
        kept = None
    seen = list(kept["logs"]) if kept is not None else []
    if kept is not None and (
        seen != [str(path) for path in files[: len(seen)]] or any(logs[path] != kept["logs"][path] for path in seen)
    ):
        # New logs continue a kept monitor only if they come after all that it has seen, and that has not changed.
        kept, seen = None, []
    if kept is not None and len(seen) == len(files):
        return RobotRow.from_dict(kept["row"], file=file, whole=True), True
    row, monitor = _monitored(task, files, kept if state.exists() else None, len(seen))
    if monitor is not None and monitor.last is not None:
        monitor.save(state)
    content = {**head, "logs": logs, "row": row.to_dict(whole=True)}
    write_atomic(file, json.dumps(content, allow_nan=False), force=True)
    return row, False


def _version(path: Path) -> list[int]:
    """Size and time of a log, which change with it.

    Raises:
        InputError: it is not there.
    """
    try:
        found = path.stat()
    except OSError as error:
        raise InputError(
            f"the log cannot be read ({error.strerror})",
            file=path,
            remedy="leave logs where they are during the work; all machines of a cluster need the same path to them",
        ) from error
    return [found.st_size, found.st_mtime_ns]


def _kept_files(task: Task) -> tuple[Path, Path]:
    """Files of the row and of the monitor of a robot."""
    return task.kept / f"{task.member.name}.json", task.kept / f"{task.member.name}.state.json"


def _monitored(
    task: Task, files: list[Path], kept: dict[str, Any] | None, seen: int
) -> tuple[RobotRow, Monitor | None]:
    name = task.member.name
    old: RobotRow | None = None
    try:
        if kept is None:
            monitor = Monitor(_baseline(task.model, task.digest), task.settings)
        else:
            old, monitor, files = (
                RobotRow.from_dict(kept["row"], whole=True),
                Monitor.load(_kept_files(task)[1]),
                files[seen:],
            )
        logs, refused = read_each(files, monitor.baseline.robot, task.mapping)
        if logs:
            return RobotRow.of(name, monitor_logs(monitor, logs, refused=refused)), monitor
        if old is not None:
            return replace(old, logs=(*old.logs, *refused)), monitor
        return RobotRow.failed(name, refused[0].note, tuple(refused)), None
    except OedError as error:
        return RobotRow.failed(name, str(error), tuple(LogRow.left_out(path.stem, str(error)) for path in files)), None
    except Exception as error:
        # One robot must not cost the others their rows.
        reason = f"{type(error).__name__}: {error}"
        return RobotRow.failed(name, reason, tuple(LogRow.left_out(path.stem, reason) for path in files)), None


@lru_cache(maxsize=4)
def _baseline(model: Path, digest: str) -> Baseline:
    """A model, read and compiled once per process; the digest identifies the version of the file."""
    return read_baseline(model)


def _read(file: Path) -> dict[str, Any] | None:
    try:
        return read_json(file, remedy="")
    except InputError:
        return None
