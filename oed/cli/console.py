"""Output of the command line: progress on a terminal, a summary or JSON at the end, one message on an error."""

from __future__ import annotations

import json
import logging
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from oed.cli.verbs import Printed
from robots.common.errors import DescriptionWarning
from robots.common.progress import SILENT, Progress

OURS = ("oed", "estimation", "robots")
"""Packages whose warnings are notes for the reader."""


@dataclass(frozen=True, kw_only=True)
class Console:
    """Where a command writes: results to standard output, everything else to standard error.

    Attributes:
        json: results as one JSON object.
        quiet: no summary, no notes, no progress.
        introduces: whether the command is one with which work on a robot begins. It shows the notes on the robot's
            description in full; others say where they are listed.
    """

    json: bool = False
    quiet: bool = False
    introduces: bool = False

    @contextmanager
    def working(self, kept: Callable[[], str] = lambda: "nothing was written") -> Iterator[Progress]:
        """Shows a progress bar on a terminal, and a line every ten seconds in a pipe. Each note is printed once.

        Args:
            kept: says what an interrupted command has written so far.

        Raises:
            SystemExit: with code 130, on Ctrl-C.
        """
        with warnings.catch_warnings(record=False):
            warnings.simplefilter("default")
            warnings.showwarning = _Notes(self)
            try:
                if self.quiet or self.json:
                    yield SILENT
                elif not sys.stderr.isatty():
                    from oed.cli.progress_lines import ProgressLines

                    yield ProgressLines()
                else:
                    from oed.cli.progress import RichProgress

                    with RichProgress() as progress:
                        yield progress
            except KeyboardInterrupt:
                # Without this, typer would end without a message.
                print(f"oed: interrupted; {kept()}", file=sys.stderr)
                raise SystemExit(130) from None

    def result(self, printed: Printed) -> None:
        """Prints the summary, or the data as JSON.

        Raises:
            SystemExit: with the code of the result, if that is not 0.
        """
        if self.json:
            print(json.dumps(printed.data, indent=2, allow_nan=False))
        elif not self.quiet:
            print(printed.summary)
        if printed.note:
            print(printed.note, file=sys.stderr)
        if printed.code:
            raise SystemExit(printed.code)


class _Notes:
    """Prints warnings of ours as notes, and the notes on a robot's description once in short where they are known."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._listed: set[str] = set()

    def __call__(self, message: Warning | str, *_: object, **__: object) -> None:
        if type(message).__module__.split(".")[0] not in OURS:
            # A library's remark about its own numbers is of no use to a reader.
            logging.getLogger(__name__).debug("%s: %s", type(message).__name__, message)
            return
        text = str(message)
        if isinstance(message, DescriptionWarning) and message.origin and not self._console.introduces:
            if message.origin in self._listed:
                return
            self._listed.add(message.origin)
            name = text.partition(":")[0]
            text = (
                f"{name}: its description has assumed values or other notes; oed robot show {message.origin} lists them"
            )
        if not self._console.quiet:
            print(f"note: {text}", file=sys.stderr)
