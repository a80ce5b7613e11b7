"""Which logs a model was fitted to."""

import hashlib

import pytest

from estimation.logs.provenance import describe_logs, log_hash
from robots.common.errors import InputError
from robots.signals import Log


def bag(tmp_path, **files):
    """A folder of rosbag 2 with these files' contents."""
    folder = tmp_path / "bag"
    folder.mkdir()
    (folder / "metadata.yaml").write_text("rosbag2_bagfile_information: {}")
    for name, content in files.items():
        (folder / name.replace("_", ".")).write_bytes(content)
    return folder


def test_folder_of_one_bag_file_has_its_hash(tmp_path):
    """A rosbag 2 given as folder and as file is the same log, whatever its metadata file says."""
    folder = bag(tmp_path, a_db3=b"messages")
    assert log_hash(folder) == log_hash(folder / "a.db3") == hashlib.sha256(b"messages").hexdigest()


def test_folder_of_several_bag_files_depends_on_each(tmp_path):
    """A recording that was split has a hash of all its parts, in order."""
    folder = bag(tmp_path, a_mcap=b"first", b_mcap=b"second")
    whole = log_hash(folder)
    (folder / "b.mcap").write_bytes(b"other")
    assert len(whole) == 64
    assert log_hash(folder) != whole


def test_log_from_a_bag_folder_is_described(tmp_path):
    """The description of a log states the hash of its folder."""
    folder = bag(tmp_path, a_db3=b"messages")
    log = Log(t=[0.0, 1.0], q=[[0.0], [1.0]], metadata={"file": str(folder)})
    assert describe_logs([log])[0]["sha256"] == log_hash(folder)


def test_missing_file_is_refused(tmp_path):
    """A log that was deleted since is an input error."""
    with pytest.raises(InputError, match=r"gone\.csv"):
        log_hash(tmp_path / "gone.csv")
