"""Options of heat, of commands that predict torques."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from oed.cli.declarations.declared import INPUT


@dataclass(frozen=True, kw_only=True)
class Warmth:
    """What the robot did before, and how warm its surroundings are.

    Attributes:
        before: thermal model: a log, or a folder of logs, of the robot's motion before this log. Repeatable.
        ambient: thermal model: ambient temperature of logs that do not state it [degC].
    """

    section = INPUT

    before: tuple[Path, ...] = ()
    ambient: float | None = None
