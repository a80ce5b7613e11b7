"""Compressed logs read as what is in them."""

import bz2
import gzip
import lzma
import zipfile

import numpy as np
import pytest

from estimation.logs import read_log, read_logs
from robots.common.errors import InputError
from robots.common.tables.table_files import write_table
from tests.estimation.logs.made_logs import columns, text

DATA = columns()


def same(log):
    np.testing.assert_array_equal(log.q, np.column_stack([DATA["q1"], DATA["q2"]]))
    np.testing.assert_array_equal(log.tau, np.column_stack([DATA["tau1"], DATA["tau2"]]))


@pytest.mark.parametrize(("suffix", "pack"), [("gz", gzip.open), ("bz2", bz2.open), ("xz", lzma.open)])
@pytest.mark.parametrize("name", ["log.csv.{}", "log.{}", "log.csv"])
def test_a_compressed_file_is_the_log_in_it(tmp_path, suffix, pack, name):
    """The first bytes count, and not the name; the log names the file that was given."""
    path = tmp_path / name.format(suffix)
    with pack(path, "wb") as stream:
        stream.write(text(DATA).encode())
    log = read_log(path, n=2)
    same(log)
    assert log.metadata["file"] == str(path)


def test_a_compressed_parquet_file_is_read(tmp_path):
    """Arrays stay valid after the unpacked file is gone."""
    write_table(tmp_path / "log.parquet", DATA)
    packed = tmp_path / "log.parquet.gz"
    packed.write_bytes(gzip.compress((tmp_path / "log.parquet").read_bytes()))
    same(read_log(packed, n=2))


def test_a_zip_file_holds_one_log(tmp_path):
    """Other files beside the log do not matter; a second log does, and is named."""
    path = tmp_path / "log.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("run/log.csv", text(DATA))
        archive.writestr("__MACOSX/run/log.csv", "x")
        archive.writestr("README.md", "a run")
    same(read_log(path, n=2))
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("run/other.csv", text(DATA))
    with pytest.raises(InputError, match=r"2 logs in the zip file: run/log.csv, run/other.csv") as caught:
        read_log(path, n=2)
    assert caught.value.file == str(path)
    assert "unpack" in caught.value.remedy


def test_an_archive_of_numpy_under_another_name_stays_one(tmp_path):
    """Numpy writes zip files, too."""
    np.savez(tmp_path / "log.npz", t=DATA["t"], q=np.ones((4, 2)), tau=np.ones((4, 2)))
    (tmp_path / "log.npz").rename(tmp_path / "log.dat")
    assert read_log(tmp_path / "log.dat", n=2).tau.tolist() == [[1.0, 1.0]] * 4


def test_errors_name_the_file_that_was_given(tmp_path):
    """A fault inside has the line of the table, and the name of the compressed file; so has a damaged one."""
    path = tmp_path / "log.csv.gz"
    path.write_bytes(gzip.compress(b"t,q1,tau1\n0,1,2\n1,x,3\n"))
    with pytest.raises(InputError, match="'x'") as caught:
        read_log(path, n=1)
    assert (caught.value.file, caught.value.column, caught.value.row) == (str(path), "q1", 3)
    path.write_bytes(gzip.compress(text(DATA).encode())[:-9])
    with pytest.raises(InputError, match="compressed file cannot be read"):
        read_log(path, n=2)
    path.write_bytes(b"PK\x03\x04 no archive")
    with pytest.raises(InputError, match="compressed file cannot be read"):
        read_log(path, n=2)


def test_a_workbook_is_to_be_saved_as_csv(tmp_path):
    """A spreadsheet's file is a zip file with a table of contents."""
    with zipfile.ZipFile(tmp_path / "log.xlsx", "w") as archive:
        archive.writestr("[Content_Types].xml", "<Types/>")
    with pytest.raises(InputError, match="workbook") as caught:
        read_log(tmp_path / "log.xlsx", n=2)
    assert "CSV" in caught.value.remedy


def test_folders_hold_compressed_logs(tmp_path):
    """A campaign may be compressed file by file."""
    for number in (1, 2):
        data = {**DATA, "t": DATA["t"] + 10.0 * number}
        (tmp_path / f"log{number}.csv.gz").write_bytes(gzip.compress(text(data).encode()))
    assert [log.t[0] for log in read_logs(tmp_path, n=2)] == [10.0, 20.0]
