"""Exceptions inside a solver's callbacks: CasADi would print them, and IPOPT carry on as if nothing had happened."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

Result = TypeVar("Result")


class Trap:
    """Catches the first exception in a solver's callbacks, Ctrl-C above all, and holds it until the solver is out.

    Attributes:
        caught: the exception, if there was one.
    """

    def __init__(self) -> None:
        self.caught: BaseException | None = None

    def call(self, function: Callable[[], Result], otherwise: Result) -> Result:
        """Calls a function; when it raises, and ever after, answers `otherwise`."""
        if self.caught is None:
            try:
                return function()
            except BaseException as error:
                self.caught = error
        return otherwise

    def release(self) -> None:
        """Raises what was caught, if anything."""
        if self.caught is not None:
            raise self.caught
