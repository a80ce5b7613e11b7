"""A small server of the page on this machine: read-only, and for files of one folder."""

from __future__ import annotations

import posixpath
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import unquote, urlsplit

from oed.overviews.entries import find_results
from oed.overviews.overview_page import overview_html
from robots.common.errors import InputError

FILES = "files/"
TYPES = {
    ".html": "text/html",
    ".json": "application/json",
    ".state": "application/json",
    ".csv": "text/csv",
    ".yaml": "text/plain",
    ".yml": "text/plain",
    ".urdf": "text/plain",
    ".png": "image/png",
}
"""Files that are served, by how their names end; all others are refused."""

CHUNK = 1 << 20


class OverviewServer(ThreadingHTTPServer):
    """Serves the page of a folder's results on 127.0.0.1.

    Args:
        folder: where the results are.
        port: of the page; 0 for a free one.

    Raises:
        InputError: no such folder, or a port that is not free.
    """

    daemon_threads = True

    def __init__(self, folder: str | Path, port: int = 0) -> None:
        self.folder = Path(folder)
        find_results(self.folder)
        self.root = self.folder.resolve()
        try:
            super().__init__(("127.0.0.1", port), _Handler)
        except (OSError, OverflowError) as error:
            raise InputError(
                f"port {port} cannot be used ({error})",
                allowed="a free port up to 65535",
                remedy="choose another --port",
            ) from error

    @property
    def address(self) -> str:
        """Where the page is."""
        return f"http://127.0.0.1:{self.server_port}/"

    def file_at(self, path: str) -> Path | None:
        """Finds a file of the folder; None for anything else, such as a link that leads out of it.

        Args:
            path: below the folder, decoded.
        """
        parts = path.split("/")
        if "\0" in path or "\\" in path or any(part.startswith(".") or not part for part in parts):
            return None
        try:
            file = (self.root / path).resolve(strict=True)
        except (OSError, RuntimeError):
            return None
        inside = file.is_relative_to(self.root) and file.is_file() and file.suffix.lower() in TYPES
        return file if inside else None


class _Handler(BaseHTTPRequestHandler):
    server: OverviewServer
    server_version = "oed"
    sys_version = ""

    def do_GET(self) -> None:
        # A page of another site that reaches this address by a name of its own is refused.
        hosts = {f"{name}:{self.server.server_port}" for name in ("127.0.0.1", "localhost")}
        if self.headers.get("Host") not in hosts:
            self.send_error(HTTPStatus.FORBIDDEN)
            return
        path = unquote(urlsplit(self.path).path).removeprefix("/")
        if path == "":
            self._page()
        elif path.startswith(FILES) and posixpath.normpath(path) == path:
            self._file(path.removeprefix(FILES))
        else:
            self.send_error(HTTPStatus.NOT_FOUND)

    do_HEAD = do_GET

    def _page(self) -> None:
        try:
            entries = find_results(self.server.folder)
        except InputError:
            self.send_error(HTTPStatus.NOT_FOUND, "The folder is gone")
            return
        text = overview_html(entries, folder=self.server.root.name, links=FILES).encode()
        self._head("text/html", len(text))
        if self.command == "GET":
            self.wfile.write(text)

    def _file(self, path: str) -> None:
        file = self.server.file_at(path)
        if file is None:
            self.send_error(HTTPStatus.NOT_FOUND)
            return
        try:
            with file.open("rb") as stream:
                kind = TYPES[file.suffix.lower()]
                # A report runs its own scripts, but sees nothing of this address.
                self._head(kind, file.stat().st_size, "sandbox allow-scripts allow-downloads")
                while self.command == "GET" and (part := stream.read(CHUNK)):
                    self.wfile.write(part)
        except OSError:
            self.close_connection = True

    def _head(self, kind: str, size: int, policy: str = "") -> None:
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", f"{kind}; charset=utf-8" if not kind.startswith("image/") else kind)
        self.send_header("Content-Length", str(size))
        self.send_header("Cache-Control", "no-store")
        self.send_header("X-Content-Type-Options", "nosniff")
        if policy:
            self.send_header("Content-Security-Policy", policy)
        self.end_headers()

    def log_message(self, format: str, *args: object) -> None:
        """Writes nothing: only the command line writes."""
