"""The checks of a log, a file for each thing that they look at.

`Check.stage` and `Check.order` give their sequence. A new check is a new class here.
"""

from __future__ import annotations

import sys

from estimation.gate.check import Check
from robots.common.registry import Registry, members_of, subclass_check

CHECKS: Registry[type[Check]] = Registry(
    "check of a log",
    "robot_oed.checks",
    members_of(sys.modules[__name__], Check),  # type: ignore[type-abstract]
    check=subclass_check(Check),
)


def checks_in_order() -> list[type[Check]]:
    """Lists the checks as they run: by stage, and by order within a stage."""
    return sorted(CHECKS.values(), key=lambda check: (check.stage, check.order, check.name))


__all__ = ["CHECKS", "checks_in_order"]
