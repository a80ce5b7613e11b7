"""Interface of payload exports: a body as the text that a controller or a description takes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np

from estimation.payloads.body import Body


class PayloadExport(ABC):
    """A form in which controllers or descriptions take a payload.

    Attributes:
        name: as the command line spells it.
        file: name of the file.
        title: what it is, for people.
    """

    name: ClassVar[str]
    file: ClassVar[str]
    title: ClassVar[str]

    @abstractmethod
    def text(self, body: Body, title: str) -> str:
        """Writes a body.

        Args:
            body: that can exist, in the frame of the controller's flange.
            title: one line about where it comes from.

        Returns:
            The file's text.
        """


def number(value: float) -> str:
    """Writes a number with nine digits, a point, and without an exponent, which controllers may not read."""
    return np.format_float_positional(float(value), precision=9, unique=False, fractional=False, trim="0")
