"""Where a log lies on a model's clock, and the logs that warmed the robot up before it."""

from __future__ import annotations

from collections.abc import Sequence

from estimation.logs.clocks import clock_shift_between, earlier_logs_on_clock
from estimation.models.model import Model
from robots.common.errors import InputError
from robots.signals import Log
from robots.terms.effect_bases.capabilities import Persistence

COLD = "thermal friction: the robot is assumed cold at the start; give earlier logs with --before if it was warm"


def clock_shift(model: Model, log: Log) -> tuple[float, str]:
    """Time shift [s] of a log for a model that changes with time, and a note on it.

    Time-dependent effects refer to the clock of the logs of the model's fit (`clock_shift_between`).
    """
    if not any(extension.source.persistence is not Persistence.STATE for extension in model.extensions):
        return 0.0, ""
    return clock_shift_between(model.provenance.get("logs", ()), log)


def warmed(model: Model, before: Sequence[Log], log: Log, later: float) -> tuple[list[Log], str]:
    """Puts earlier logs that warmed the robot up on a model's clock, and gives a note on the assumption.

    A model without thermal effects needs no note.

    Args:
        model: with the effects.
        before: the logs, in the order in which they were recorded where their clocks each began anew.
        log: the motion.
        later: how much later [s] than its own clock says that counts (`clock_shift`).

    Raises:
        InputError: logs that come after the motion; any, of a model that keeps no heat.
    """
    if not model.keeps_heat:
        if before:
            remedy = "use a model of oed thermal, or remove the earlier logs (--before)"
            raise InputError("the model has no thermal part", remedy=remedy)
        return [], ""
    if not before:
        return [], COLD
    shifts = [clock_shift(model, own)[0] for own in before]
    placed, anew = earlier_logs_on_clock(before, log, float(log.t[0]) + later, shifts)
    count = "one log" if len(before) == 1 else f"{len(before)} logs"
    assumed = f"thermal friction: initial temperatures from {count} before; the first is assumed to start cold"
    return placed, f"{assumed}; {anew}" if anew else assumed
