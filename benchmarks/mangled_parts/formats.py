"""Columns, whatever they are, in a file of one of the formats."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from scipy.io import savemat

Columns = dict[str, np.ndarray]

FORMATS = ("csv", "parquet", "mat", "npz", "mcap", "bag", "v73")


def write(columns: Columns, kind: str, folder: Path) -> Path:
    """Writes columns, whatever they are, in one of the formats."""
    path = folder / f"log.{'mat' if kind == 'v73' else kind}"
    if kind == "csv":
        rows = zip(*columns.values(), strict=True)
        lines = [",".join(columns), *(",".join(repr(float(cell)) for cell in row) for row in rows)]
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    elif kind == "parquet":
        pq.write_table(pa.table(columns), path)
    elif kind == "npz":
        np.savez(path, **{name: values for name, values in columns.items() if name})
    elif kind == "mat":
        stream = io.BytesIO()
        savemat(stream, {_identifier(name): values for name, values in columns.items()}, do_compression=True)
        path.write_bytes(stream.getvalue())
    elif kind == "v73":
        import h5py

        with h5py.File(path, "w", userblock_size=512) as file:
            for name, values in columns.items():
                file[name.strip().replace("/", "_") or "x"] = values[None, :]
    else:
        write_bag(columns, path, kind)
    return path


def _identifier(name: str) -> str:
    kept = "".join(mark if mark.isascii() and mark.isalnum() else "_" for mark in name).lstrip("0123456789_")
    return kept or "x"


def write_bag(columns: Columns, path: Path, kind: str) -> None:
    """Writes joint states, the joints named J1, J2, ...; what is no position or torque is lost."""
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Writer2
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if kind == "bag" else Stores.ROS2_HUMBLE)
    state, header = (store.types[name] for name in ("sensor_msgs/msg/JointState", "std_msgs/msg/Header"))
    time = store.types["builtin_interfaces/msg/Time"]
    inner = path.with_suffix("")
    writer = Writer1(path) if kind == "bag" else Writer2(inner, version=9, storage_plugin=StoragePlugin.MCAP)
    fields = [[values for name, values in columns.items() if name.startswith(key)] for key in ("q", "dq", "tau")]
    q, dq, tau = (
        np.column_stack(found) if found else np.zeros((len(next(iter(columns.values()))), 0)) for found in fields
    )
    clock = columns.get("t", np.arange(len(q), dtype=float))
    with writer:
        connection = writer.add_connection("/joint_states", "sensor_msgs/msg/JointState", typestore=store)
        for row in range(len(q)):
            seconds = float(clock[row])
            nanoseconds = round(min(max(seconds, 0.0), 4e9) * 1e9) if np.isfinite(seconds) else 0
            first = {"seq": row} if kind == "bag" else {}
            stamp = time(sec=int(nanoseconds // 10**9) % 2**31, nanosec=int(nanoseconds % 10**9))
            message = state(
                header=header(**first, stamp=stamp, frame_id=""),
                name=[f"J{joint + 1}" for joint in range(q.shape[1])],
                position=q[row].copy(), velocity=dq[row].copy(), effort=tau[row].copy(),
            )  # fmt: skip
            pack = store.serialize_ros1 if kind == "bag" else store.serialize_cdr
            writer.write(connection, nanoseconds, pack(message, "sensor_msgs/msg/JointState"))
    if kind != "bag":
        (inner / f"{inner.name}.mcap").rename(path)
