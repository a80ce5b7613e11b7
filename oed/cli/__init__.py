"""The command line: each command calls the library function of its name."""

from __future__ import annotations

import sys


def main() -> None:
    """Runs ``oed``. Exit codes: 0 success, 1 no solution, 2 bad input, 130 interrupted."""
    from oed.cli.app import app
    from robots.common.errors import OedError

    try:
        app(prog_name="oed")
    except OedError as error:
        print(f"oed: {error}", file=sys.stderr)
        sys.exit(error.exit_code)
    except KeyboardInterrupt:
        print("oed: interrupted; nothing was written", file=sys.stderr)
        sys.exit(130)
