"""What the readers' messages advise is pasted, and must help."""

import gzip
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import estimation.logs
from estimation.logs import read_log
from estimation.logs.mappings.mapping import stated_rate
from robots.common.errors import InputError
from tests.estimation.logs.made_logs import csv, text

ROWS, JOINTS = 6, 3
T = 0.004 * np.arange(ROWS)
Q = np.arange(18.0).reshape(ROWS, JOINTS) / 10.0
TAU = 5.0 + np.arange(18.0).reshape(ROWS, JOINTS)
NAMES = ["arm_joint1", "arm_joint2", "arm_joint3"]
ABB = ["waist", "shoulder", "elbow"]


def pasted(message, folder):
    """Does what a message says: saves the mapping that it prints, and adds the options that it names."""
    mapping = None
    if "mapping.yaml:\n" in message:
        mapping = folder / "mapping.yaml"
        mapping.write_text(message.split("mapping.yaml:\n", 1)[1])
    rate = re.search(r"--rate ([\d.]+)", message)
    return mapping if rate is None else stated_rate(float(rate[1]), mapping)


def table(time, position, torque, *, names=None, scale=1.0, more=()):
    """Columns by patterns with {} for what counts the joints."""
    data = {} if time is None else {time: scale * T}
    for pattern, values in ((position, Q), (torque, TAU)):
        for joint in range(JOINTS):
            data[pattern(joint, names)] = values[:, joint]
    return data | {name: np.zeros(ROWS) for name in more}


def by(pattern, first=1, width=1):
    """Names that count the joints, or contain their names."""
    return lambda joint, names: pattern.format(f"{joint + first:0{width}d}" if names is None else names[joint])


CASES = {
    "counted from 1": table("time", by("pos_{}"), by("torque_{}")),
    "counted from 0": table("stamp", by("pos_{}", 0), by("trq_{}", 0)),
    "leading zeros": table("stamp", by("pos_{}", 1, 2), by("trq_{}", 1, 2)),
    "leading zeros from 0": table("stamp", by("axis{}.angle", 0, 2), by("axis{}.effort", 0, 2)),
    "one from 0, one from 1": table("stamp", by("angle{}", 0), by("load{}", 1)),
    "names with digits": table("__time", by("/js/{}/position"), by("/js/{}/effort"), names=NAMES),
    "names without digits": table("__time", by("/js/{}/position"), by("/js/{}/effort"), names=ABB),
    "brackets and blanks": table("Time [s]", by("Axis {} pos [rad]"), by("Axis {} torque [Nm]")),
    "German": table("Zeit [ms]", by("Achse{}_Winkel"), by("Achse{}_Drehmoment"), scale=1e3),
    "current torque": table(
        "ts", by("pos{}"), by("current_torque_{}"), more=[f"torque_current_{k}" for k in (1, 2, 3)]
    ),
    "time behind the text": table("Datum", by("pos{}"), by("tau_{}")),
    "milliseconds": table("t_ms", by("pos{}"), by("tau_{}"), scale=1e3),
    "reserved words": table("time: s", by("pos #{}"), by("effort, {}")),
    "without time": table(None, by("pos_{}"), by("trq_{}")),
    "usual, without time": table(None, by("q{}"), by("tau{}")),
    "usual from 0, without time": table(None, by("q{}", 0), by("tau{}", 0)),
    "usual from 0, time elsewhere": table("time", by("q{}", 0), by("tau{}", 0)),
    "commanded beside measured": table("time", by("pos_{}"), by("trq_{}"), more=[f"target_pos_{k}" for k in (1, 2, 3)]),
    "two kinds of names": table("time", by("{}_position"), by("torque{}"), names=None)
    | {"arm_joint1_position": Q[:, 0], "arm_joint2_position": Q[:, 1], "arm_joint3_position": Q[:, 2]},
}
CASES["two kinds of names"] = {
    name: values for name, values in CASES["two kinds of names"].items() if not re.fullmatch(r"\d_position", name)
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("packed", [True, False])
def test_the_mapping_of_a_message_reads_the_log(tmp_path, name, known, packed):
    """Pasted as it is, with and without the robot's joints, it gives the values that the test wrote."""
    joints = (ABB if "without digits" in name else NAMES) if known else None
    quoted = {f'"{key}"' if "," in key else key: values for key, values in CASES[name].items()}
    path = csv(tmp_path, text(quoted))
    if packed:
        path = tmp_path / "log.csv.gz"
        path.write_bytes(gzip.compress((tmp_path / "log.csv").read_bytes()))
    n = JOINTS if known else None
    with pytest.raises(InputError) as caught:
        read_log(path, n, joints=joints)
    if not known and name == "names without digits":
        assert "mapping.yaml:" not in str(caught.value)  # nothing says what differs by the joint
        return
    log = read_log(path, n, joints=joints, mapping=pasted(str(caught.value), tmp_path))
    np.testing.assert_allclose(log.t, T, atol=1e-12)
    np.testing.assert_array_equal(log.q, Q)
    np.testing.assert_array_equal(log.tau, TAU)


@pytest.mark.parametrize("name", ["observation.state", "position"])
def test_the_mapping_for_lists_reads_them(tmp_path, name):
    """Lists in the cells of a Parquet file are columns of the mapping."""
    effort = "observation.effort" if "." in name else "torque"
    columns = {"timestamp": T, name: pa.array(Q.tolist(), pa.list_(pa.float64(), JOINTS)), effort: TAU.tolist()}
    pq.write_table(pa.table(columns), tmp_path / "log.parquet")
    with pytest.raises(InputError) as caught:
        read_log(tmp_path / "log.parquet", JOINTS, joints=NAMES)
    log = read_log(tmp_path / "log.parquet", JOINTS, mapping=pasted(str(caught.value), tmp_path))
    np.testing.assert_array_equal(log.q, Q)
    np.testing.assert_array_equal(log.tau, TAU)


def test_the_command_for_an_archive_writes_one(tmp_path):
    """What a damaged archive's message calls, with the arrays in it, writes a log."""
    path = tmp_path / "log.npz"
    path.write_bytes(b"PK\x03\x04")
    with pytest.raises(InputError) as caught:
        read_log(path)
    call = re.search(r"numpy\.savez\(.*\)", str(caught.value))[0]
    arrays = {"t": T.tolist(), "q": Q.tolist(), "tau": TAU.tolist()}
    for name, values in arrays.items():
        call = call.replace(f"{name}=...", f"{name}={values}")
    code = f"import numpy; path = {str(path)!r}; {call}"
    subprocess.run([sys.executable, "-c", code], check=True)
    np.testing.assert_array_equal(read_log(path, JOINTS).tau, TAU)


def test_options_and_packages_of_messages_exist():
    """Each option that a reader names is one of the command line, and each extra of the package can be installed."""
    from typer.main import get_command

    from oed.cli.app import app

    root = Path(estimation.logs.__file__).parent
    source = "\n".join(path.read_text() for path in root.rglob("*.py"))
    parameters = [parameter for command in get_command(app).commands.values() for parameter in command.params]
    options = {name for parameter in parameters for name in (*parameter.opts, *parameter.secondary_opts)}
    named = set(re.findall(r"(?<![-\w])--[a-z][a-z-]+", source))
    assert {"--mapping", "--rate", "--no-stream"} <= named <= options
    extras = tomllib.loads((root.parents[1] / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    assert set(re.findall(r"robot-oed\[(\w+)\]", source)) <= set(extras)
