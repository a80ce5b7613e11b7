"""What can be chosen of a form of a trajectory."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from robots.common.errors import InputError
from robots.common.options import Option


@dataclass(frozen=True, kw_only=True)
class ExportOptions:
    """Choices that several forms share.

    Attributes:
        start_tolerance: tolerance of the start pose in programs and ros-goal [rad or m].
        name: name of the program or module. Default: that of the file for kuka and abb, else trajectory.
        remark: a line for the people who open the file, where the form has comments.

    Raises:
        InputError: a tolerance that is not positive, or a name that is no identifier.
    """

    start_tolerance: float = 0.01
    name: str = ""
    remark: Annotated[str, Option(hidden=True)] = ""

    def __post_init__(self) -> None:
        if not self.start_tolerance > 0:
            raise InputError(f"a start tolerance of {self.start_tolerance}", allowed="above 0 [rad or m]")
        if self.name and not (self.name.isascii() and self.name.isidentifier()):
            raise InputError(f"the name {self.name!r}", allowed="ASCII letters, digits and _, not a digit first")
