# ruff: noqa: PT012 - what a context manager does on an error inside needs more than one statement inside
import hashlib
import os
import signal
import subprocess
import sys

import pytest

from robots.common import files
from robots.common.errors import InputError
from robots.common.files import ResultFolder, existing_file, open_atomic, remove_partial_files, sha256, write_atomic


def contents(folder):
    return {str(path.relative_to(folder)): path.read_text() for path in folder.rglob("*") if path.is_file()}


def test_digest_is_that_of_the_bytes(tmp_path):
    """The digest is SHA-256 in hexadecimal digits."""
    path = tmp_path / "a.bin"
    path.write_bytes(b"\x00robot" * 100_000)
    assert sha256(path) == hashlib.sha256(path.read_bytes()).hexdigest()


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda path: None, "no such file"),
        (lambda path: path.mkdir(), "a folder"),
        (lambda path: os.mkfifo(path), "not a regular file"),
    ],
)
@pytest.mark.parametrize("read", [existing_file, sha256])
def test_what_is_no_file_is_refused_by_name(tmp_path, make, word, read):
    """A missing file, a folder and a pipe are input errors that name the path."""
    path = tmp_path / "log.csv"
    make(path)
    with pytest.raises(InputError, match=word) as caught:
        read(path)
    assert caught.value.file == str(path)


def test_unreadable_file_is_refused(tmp_path, monkeypatch):
    """A file without permission to read is an input error that says so, and keeps its cause."""
    path = tmp_path / "log.csv"
    path.write_text("t\n")

    def refuse(*args, **kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(files.Path, "open", refuse)
    with pytest.raises(InputError, match="permission denied") as caught:
        existing_file(path)
    assert isinstance(caught.value.__cause__, PermissionError)


def test_path_with_a_zero_byte_is_refused():
    """A path that no file system takes is an input error."""
    with pytest.raises(InputError):
        existing_file("a\0b.csv")


@pytest.mark.parametrize(
    ("data", "written"), [("a\r\nµ\n", "a\r\nµ\n".encode()), (b"\x00\xff", b"\x00\xff"), ("", b"")]
)
def test_atomic_file_holds_the_data(tmp_path, data, written):
    """Text goes out as UTF-8 with its own line ends, bytes as they are, and nothing else appears."""
    path = tmp_path / "model.json"
    write_atomic(path, data)
    assert path.read_bytes() == written
    assert os.listdir(tmp_path) == ["model.json"]


def test_atomic_file_has_the_usual_permissions(tmp_path):
    """The permissions follow the umask, as for any other new file."""
    (tmp_path / "plain").write_text("")
    write_atomic(tmp_path / "atomic", "")
    assert (tmp_path / "plain").stat().st_mode == (tmp_path / "atomic").stat().st_mode


def test_existing_file_is_replaced_with_force_only(tmp_path):
    """An existing file stays without force, and the message says how to overwrite it."""
    path = tmp_path / "model.json"
    path.write_text("old")
    with pytest.raises(InputError, match="--force") as caught:
        write_atomic(path, "new")
    assert path.read_text() == "old"
    assert caught.value.file == str(path)
    write_atomic(path, "new", force=True)
    assert contents(tmp_path) == {"model.json": "new"}


def test_file_that_appears_meanwhile_is_not_overwritten(tmp_path):
    """Without force the file is checked again before it is put in place."""
    path = tmp_path / "model.json"
    with pytest.raises(InputError, match="exists"), open_atomic(path) as stream:
        stream.write(b"new")
        path.write_text("other")
    assert contents(tmp_path) == {"model.json": "other"}


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_failure_while_writing_leaves_the_old_file(tmp_path, error):
    """On an error or interrupt the old file stays and no partial file remains; the error passes as itself."""
    path = tmp_path / "model.json"
    path.write_text("old")
    with pytest.raises(error), open_atomic(path, force=True) as stream:
        stream.write(b"half")
        raise error
    assert contents(tmp_path) == {"model.json": "old"}


def test_link_keeps_pointing_to_its_replaced_target(tmp_path):
    """Writing to a link replaces the file behind it."""
    target, link = tmp_path / "target", tmp_path / "link"
    target.write_text("old")
    link.symlink_to(target)
    write_atomic(link, "new", force=True)
    assert link.is_symlink()
    assert target.read_text() == "new"


def test_file_needs_a_folder_that_exists_and_is_no_folder_itself(tmp_path):
    """A missing folder, a file as folder, and a folder as file are input errors."""
    (tmp_path / "file").write_text("")
    for path in (tmp_path / "none" / "a", tmp_path / "file" / "a", tmp_path):
        with pytest.raises(InputError):
            write_atomic(path, "x", force=True)


def test_full_disk_is_an_input_error(tmp_path, monkeypatch):
    """What the operating system refuses when the file is put in place is an input error with its reason."""

    def refuse(*args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(files.os, "fsync", refuse)
    with pytest.raises(InputError, match="no space left"):
        write_atomic(tmp_path / "a", "x")
    assert os.listdir(tmp_path) == []


def test_results_appear_together_in_a_new_folder(tmp_path):
    """Files, also those of sub-folders, appear on a clean exit; parents are created."""
    folder = tmp_path / "a" / "b"
    with ResultFolder(folder, names=("model.json",)) as out:
        out.path("model.json").write_text("m")
        out.path("figures/fit.svg").write_text("f")
        assert not folder.exists()
    assert contents(tmp_path) == {"a/b/model.json": "m", "a/b/figures/fit.svg": "f"}


def test_other_files_of_the_folder_stay(tmp_path):
    """An existing folder keeps its other files, with force too."""
    (tmp_path / "notes.txt").write_text("n")
    (tmp_path / "model.json").write_text("old")
    with ResultFolder(tmp_path, force=True, names=("model.json",)) as out:
        out.path("model.json").write_text("new")
        assert (tmp_path / "model.json").read_text() == "old"
    assert contents(tmp_path) == {"notes.txt": "n", "model.json": "new"}


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt, SystemExit])
def test_nothing_is_left_after_a_failure(tmp_path, error):
    """On any exception the tree is as before, created parents included."""
    (tmp_path / "keep").mkdir()
    (tmp_path / "keep" / "notes.txt").write_text("n")
    for folder in (tmp_path / "new" / "deep", tmp_path / "keep"):
        with pytest.raises(error), ResultFolder(folder) as out:
            out.path("model.json").write_text("half")
            raise error
    assert contents(tmp_path) == {"keep/notes.txt": "n"}
    assert os.listdir(tmp_path) == ["keep"]
    assert os.listdir(tmp_path / "keep") == ["notes.txt"]


def test_known_name_is_refused_before_work_begins(tmp_path):
    """An existing file of a name given beforehand is refused on entry."""
    (tmp_path / "model.json").write_text("old")
    with pytest.raises(InputError, match="exists"), ResultFolder(tmp_path, names=("model.json",)):
        pytest.fail("the work began")
    assert os.listdir(tmp_path) == ["model.json"]


def test_unknown_name_is_refused_before_anything_moves(tmp_path):
    """An existing file that was not announced is refused on exit, and no file of the run appears."""
    (tmp_path / "report.html").write_text("old")
    with pytest.raises(InputError, match="exists"), ResultFolder(tmp_path) as out:
        out.path("model.json").write_text("m")
        out.path("report.html").write_text("new")
    assert contents(tmp_path) == {"report.html": "old"}


@pytest.mark.parametrize("failing", range(1, 5))
@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_interrupt_while_moving_restores_the_folder(tmp_path, monkeypatch, failing, error):
    """A failure at any of the moves, or right after one, leaves the old files and no new one."""
    for name in ("a", "b"):
        (tmp_path / name).write_text("old")
    replace, calls = os.replace, []

    def flaky(source, target):
        calls.append(source)
        if len(calls) == failing and isinstance(error, OSError):
            raise error
        replace(source, target)
        if len(calls) == failing:
            raise error

    expected = InputError if isinstance(error, OSError) else KeyboardInterrupt
    with pytest.raises(expected), ResultFolder(tmp_path, force=True) as out:
        for name in ("a", "b"):
            out.path(name).write_text("new")
        monkeypatch.setattr(files.os, "replace", flaky)
    monkeypatch.undo()
    assert contents(tmp_path) == {"a": "old", "b": "old"}
    assert sorted(os.listdir(tmp_path)) == ["a", "b"]


@pytest.mark.parametrize("inside", ["", "sub", "sub/deeper"])
def test_file_in_the_place_of_the_folder_is_refused(tmp_path, inside):
    """A file where the folder or one of its parents should be is an input error that names it."""
    (tmp_path / "out").write_text("x")
    with pytest.raises(InputError, match="this is a file") as caught, ResultFolder(tmp_path / "out" / inside):
        pytest.fail("the work began")
    assert caught.value.file == str(tmp_path / "out")


def test_folder_in_the_place_of_a_result_is_refused(tmp_path):
    """A folder of the name of a result is an input error, with force too."""
    (tmp_path / "model.json").mkdir()
    with pytest.raises(InputError, match="this is a folder"), ResultFolder(tmp_path, force=True, names=["model.json"]):
        pytest.fail("the work began")


def test_folder_that_cannot_be_written_is_refused(tmp_path, monkeypatch):
    """A folder without permission to write is an input error on entry, and created parents go again."""

    def refuse(self, *args, **kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(files.Path, "mkdir", refuse)
    with pytest.raises(InputError, match="permission denied") as caught, ResultFolder(tmp_path):
        pytest.fail("the work began")
    assert caught.value.file == str(tmp_path)
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("name", ["", "../model.json", "/tmp/model.json", "a/../../b"])
def test_names_do_not_lead_out_of_the_folder(tmp_path, name):
    """An absolute name and one with .. are refused."""
    with pytest.raises(InputError), ResultFolder(tmp_path / "out") as out:
        out.path(name)
    assert os.listdir(tmp_path) == []


def test_folder_must_be_entered(tmp_path):
    """A path outside of `with` is a mistake of the caller."""
    with pytest.raises(RuntimeError, match="with"):
        ResultFolder(tmp_path).path("a")


def test_run_without_files_makes_the_folder(tmp_path):
    """A clean run that writes nothing leaves an empty folder."""
    with ResultFolder(tmp_path / "out"):
        pass
    assert os.listdir(tmp_path / "out") == []


KILLED = """
import os, signal, sys
from robots.common.files import ResultFolder
sys.addaudithook(lambda event, _: event == "os.rename" and os.kill(os.getpid(), signal.SIGKILL))
with ResultFolder(sys.argv[1]) as out:
    for name in ("a.json", "b.csv", "sub/c.csv"):
        out.path(name).write_text(name)
"""


def test_a_killed_program_leaves_no_part_of_a_new_folder(tmp_path):
    """A new folder is moved to its place in one step; what is left unfinished can be removed."""
    target = tmp_path / "results"
    done = subprocess.run([sys.executable, "-c", KILLED, target], check=False, timeout=60)
    assert done.returncode == -signal.SIGKILL
    assert not target.exists()
    with ResultFolder(target) as out:
        for name in ("a.json", "sub/c.csv"):
            out.path(name).write_text(name)
    assert sorted(path.name for path in target.rglob("*.*")) == ["a.json", "c.csv"]
    unfinished = target / "sub" / ".c.csv.0123abcd.partial"
    unfinished.write_text("")
    remove_partial_files(target)
    assert not unfinished.exists()
    assert (target / "sub" / "c.csv").exists()
