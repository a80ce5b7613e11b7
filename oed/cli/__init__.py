"""The command line: each command calls the library function of its name."""

from __future__ import annotations

import os
import sys


def main() -> None:
    """Runs ``oed``. Exit codes: 0 success, 1 no solution, 2 bad input, 130 interrupted."""
    from oed.cli.app import app
    from oed.cli.usage_errors import CommandLineError, usage_message, with_nearest
    from robots.common.errors import OedError

    try:
        sys.exit(app(prog_name="oed", standalone_mode=False) or 0)
    except OedError as error:
        # Lines after the first are to be copied.
        first, *more = with_nearest(error.problem, error.allowed, str(error)).split("\n")
        print("\n".join([f"oed: {first}{f' ({error.code})' if error.code else ''}", *more]), file=sys.stderr)
        sys.exit(error.exit_code)
    except CommandLineError as error:
        if len(sys.argv) == 1:  # Help was asked for by asking for nothing.
            error.show()  # type: ignore[attr-defined]
        else:
            print(f"oed: {usage_message(error)}", file=sys.stderr)
        sys.exit(2)
    except BrokenPipeError:
        # Whoever read the output has stopped; the interpreter would complain when it flushes.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except KeyboardInterrupt:
        print("oed: interrupted; nothing was written", file=sys.stderr)
        sys.exit(130)
