"""Shows all results in a folder on one page: sortable, with reports, side by side.

The page is served on this machine only, until Ctrl-C. With --json the results are listed, and no page is served.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

from oed.cli.options.results import Overwriting
from oed.cli.verbs import Printed, Verb
from robots.common.options import Option
from robots.common.progress import Progress


@dataclass(frozen=True, kw_only=True)
class Page(Overwriting):
    """The page as a file.

    Attributes:
        out: write the page to this HTML file instead, and end.
    """

    out: Path | None = None


@dataclass(frozen=True, kw_only=True)
class View(Verb):
    """``oed view``.

    Attributes:
        folder: a folder with results, also in sub-folders.
        port: port of the page. 0: a free one.
        browser: open the page in the browser.
    """

    function = "oed.overviews.find_results"
    examples = ("oed view results", "oed view results --out results.html")

    folder: Annotated[Path, Option(argument=True)]
    port: Annotated[int, Option(least=0, most=65535)] = 0
    browser: bool = True
    page: Page = Page()

    def kept(self) -> str:
        """Says that the page is gone."""
        return "the page is no longer served"

    def run(self, progress: Progress) -> Printed | None:
        """Serves the page, writes it, or lists the results."""
        from oed.overviews import find_results, overview_html
        from robots.common.files import open_atomic

        out, folder = self.page.out, self.folder
        if out is None and not self.json:
            self._serve()
            return None
        if out is not None:
            with open_atomic(out, force=self.page.force) as stream:
                entries = find_results(folder)
                page = overview_html(entries, folder=folder.resolve().name, links=_links(folder, out))
                stream.write(page.encode())
        else:
            entries = find_results(folder)
        where = {} if out is None else {"file": str(out)}
        return Printed(
            summary=f"{len(entries)} results{'' if out is None else f', written to {out}'}",
            data={"folder": str(folder), **where, "results": [asdict(entry) for entry in entries]},
        )

    def _serve(self) -> None:
        import webbrowser

        from oed.cli.console import Console
        from oed.overviews import OverviewServer

        with OverviewServer(self.folder, self.port) as server:
            address = f"{self.folder.resolve()} at {server.address} until Ctrl-C"
            Console(quiet=self.quiet).result(Printed(summary=address, data={}))
            if self.browser:
                webbrowser.open(server.address)
            server.serve_forever()


def _links(folder: Path, out: Path) -> str:
    """The way from the page's folder to the results, for their links."""
    import os
    from urllib.parse import quote

    way = Path(os.path.relpath(folder.resolve(), out.resolve().parent)).as_posix()
    return "" if way == "." else f"{quote(way)}/"
