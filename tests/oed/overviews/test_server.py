"""The server of results: one page and the files of its folder, and nothing else."""

from __future__ import annotations

import http.client
import os
import socket
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from oed.overviews import OverviewServer
from robots.common.errors import InputError
from tests.oed.overviews.test_entries import DESIGN, write

SECRET = "not for readers"


@pytest.fixture
def server(tmp_path: Path) -> Iterator[OverviewServer]:
    """A folder with a design, beside a file that nobody may read."""
    write(tmp_path, "secret.json", SECRET)
    write(tmp_path, "results-old/design.json", SECRET)
    folder = tmp_path / "results"
    write(folder, "a b/design.json", DESIGN)
    write(folder, "a b/report.html", "<html>report</html>")
    write(folder, ".git/config.json", SECRET)
    write(folder, "key.pem", SECRET)
    os.symlink(tmp_path / "secret.json", folder / "link.json")
    os.symlink(tmp_path, folder / "up")
    with OverviewServer(folder) as started:
        thread = threading.Thread(target=started.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        yield started
        started.shutdown()
        thread.join()


def ask(server: OverviewServer, path: str, *, method: str = "GET", host: str = "") -> tuple[int, str, dict]:
    """Asks with a path as it is: a client of higher level would resolve the dots itself."""
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=10)
    connection.putrequest(method, path, skip_host=True)
    connection.putheader("Host", host or f"127.0.0.1:{server.server_port}")
    connection.endheaders()
    answer = connection.getresponse()
    body = answer.read().decode()
    connection.close()
    return answer.status, body, dict(answer.getheaders())


def test_page_and_files(server: OverviewServer) -> None:
    """The page lists the result, and its links lead to the data and the report."""
    status, text, _ = ask(server, "/")
    assert status == 200
    assert 'href="./files/a%20b/design.json"' in text
    status, text, headers = ask(server, "/files/a%20b/design.json")
    assert (status, headers["Content-Type"]) == (200, "application/json; charset=utf-8")
    assert "robot-oed design" in text
    status, text, headers = ask(server, "/files/a%20b/report.html")
    assert (status, text) == (200, "<html>report</html>")
    assert headers["Content-Security-Policy"].startswith("sandbox")
    assert ask(server, "/", method="HEAD")[:2] == (200, "")


@pytest.mark.parametrize(
    "path",
    [
        "/files/../secret.json",
        "/../secret.json",
        "/files/%2e%2e/secret.json",
        "/files/..%2fsecret.json",
        "/files/%2e%2e%2fresults-old%2fdesign.json",
        "/files/..%5csecret.json",
        "/files//etc/hostname",
        "/files/a%20b/../../secret.json",
        "/files/link.json",
        "/files/up/secret.json",
        "/files/.git/config.json",
        "/files/key.pem",
        "/files/a%20b",
        "/files/",
        "/files/a%20b/design.json%00.html",
        "/files/none.json",
        "/secret.json",
        "http://127.0.0.1/files/../secret.json",
    ],
)
def test_nothing_else_is_served(server: OverviewServer, path: str) -> None:
    """Ways out of the folder, links out of it, hidden files, folders and other kinds of files are not found."""
    status, text, _ = ask(server, path)
    assert status == 404
    assert SECRET not in text


def test_reading_only(server: OverviewServer) -> None:
    """Other methods are refused, and so are other names for this address, by which a web site could read the page."""
    assert [ask(server, "/", method=method)[0] for method in ("POST", "PUT", "DELETE")] == [501] * 3
    assert ask(server, "/", host="evil.example")[0] == 403
    assert ask(server, "/", host=f"localhost:{server.server_port}")[0] == 200


def test_this_machine_only(server: OverviewServer) -> None:
    """The server listens on the loopback address."""
    assert server.server_address[0] == "127.0.0.1"


def test_ports_in_use(tmp_path: Path) -> None:
    """A port that another program has is named, with the option to change."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(InputError, match=f"port {taken.getsockname()[1]} cannot be used"):
            OverviewServer(tmp_path, taken.getsockname()[1])
