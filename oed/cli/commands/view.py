"""``oed view``: all results of a folder on one page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from oed.cli.console import Console
from oed.cli.options import ForceOption, JsonOption, QuietOption


def view(
    folder: Annotated[Path, typer.Argument(help="A folder with results, also in sub-folders.", show_default=False)],
    port: Annotated[int, typer.Option("--port", min=0, max=65535, help="Port of the page. 0: a free one.")] = 0,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")] = True,
    out: Annotated[
        Path | None,
        typer.Option("--out", help="Write the page to this HTML file instead, and end.", show_default=False),
    ] = None,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Shows all results in a folder on one page: sortable, with reports, side by side.

    The page is served on this machine only, until Ctrl-C. With --json the results are listed, and no page is served.
    """
    console = Console(json=json, quiet=quiet)
    with console.working("the page is no longer served"):
        from dataclasses import asdict

        from oed.overviews import OverviewServer, find_results, overview_html
        from robots.common.files import open_atomic

        if out is not None:
            with open_atomic(out, force=force) as stream:
                entries = find_results(folder)
                stream.write(overview_html(entries, folder=folder.resolve().name, links=_links(folder, out)).encode())
        elif json:
            entries = find_results(folder)
        else:
            import webbrowser

            with OverviewServer(folder, port) as server:
                console.result(f"{folder.resolve()} at {server.address} until Ctrl-C", {})
                if browser:
                    webbrowser.open(server.address)
                server.serve_forever()
            return
    where = {} if out is None else {"file": str(out)}
    data = {"folder": str(folder), **where, "results": [asdict(entry) for entry in entries]}
    console.result(f"{len(entries)} results{'' if out is None else f', written to {out}'}", data)


def _links(folder: Path, out: Path) -> str:
    """The way from the page's folder to the results, for their links."""
    import os
    from urllib.parse import quote

    way = Path(os.path.relpath(folder.resolve(), out.resolve().parent)).as_posix()
    return "" if way == "." else f"{quote(way)}/"
