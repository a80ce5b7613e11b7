"""Delay of the torque behind the position, which a fit takes for damping and friction."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimation.gate.context import Context
from estimation.gate.finding import Finding
from estimation.gate.quick_fits.delays import Delay, usual_delay

# Standard errors from which a delay is significant, and share of a sample from which it is reported.
SIGNIFICANT, LEAST_SAMPLES = 4.0, 0.5
# Share of the unexplained torque that a delay must explain. A delay longer than usual must explain more: friction with
# memory or an elastic joint may look like one.
LEAST_EXPLAINED, LEAST_EXPLAINED_LONG = 0.15, 0.5
# The delays of two joints agree within this share of a sample, this share of the delay, or so many standard errors.
AGREE_SAMPLES, AGREE_SHARE, AGREE_ERRORS = 0.5, 0.2, 3.0
# A joint contradicts a long delay of another if its own differs by more than this share, with a smaller error.
CONTRADICTS = 0.25


def delays(context: Context) -> list[Finding]:
    """Finds torques that are logged later or earlier than their motion."""
    return findings_of(context.fitted.delays, context.cleaned.timing.period)


def findings_of(delays: Sequence[Delay | None], period: float) -> list[Finding]:
    """Judges the delays of all joints.

    Args:
        delays: (n,), None of joints without a fit.
        period: of the samples [s].
    """
    common = _common_delay(delays, period)
    if common is not None:
        return [common]
    return [
        _finding(delay.value, delay.error, joint, period, 1)
        for joint, delay in enumerate(delays, start=1)
        if delay is not None and _is_significant(delay, delays, period)
    ]


def _common_delay(delays: Sequence[Delay | None], period: float) -> Finding | None:
    """Gives the mean delay of joints that agree: it can be shorter than one of a single joint."""
    known = [
        delay
        for delay in delays
        if delay is not None and delay.error < max(0.5 * period, AGREE_SHARE * abs(delay.value))
    ]
    if len(known) < 2 or 2 * len(known) < len(delays):
        return None
    weights = np.array([1.0 / max(delay.error, 1e-3 * period) ** 2 for delay in known])
    mean = float(weights @ [delay.value for delay in known] / weights.sum())
    error = float(1 / np.sqrt(weights.sum()))
    agree = all(
        abs(delay.value - mean) < max(AGREE_ERRORS * delay.error, AGREE_SAMPLES * period, AGREE_SHARE * abs(mean))
        for delay in known
    )
    sticks = float(np.median([delay.sticks for delay in known]))
    if not agree or abs(mean) <= sticks + max(LEAST_SAMPLES * period, SIGNIFICANT * error):
        return None
    return _finding(mean, error, None, period, len(known))


def _is_significant(delay: Delay, delays: Sequence[Delay | None], period: float) -> bool:
    if not np.isfinite(delay.error) or abs(delay.value) <= delay.sticks + max(
        SIGNIFICANT * delay.error, LEAST_SAMPLES * period
    ):
        return False
    if abs(delay.value) <= usual_delay(period):
        return delay.saved > LEAST_EXPLAINED
    # A long delay comes from the logger: no other joint is without it.
    others = [other for other in delays if other is not None and other.error < CONTRADICTS * abs(delay.value)]
    return delay.saved > LEAST_EXPLAINED_LONG and all(
        abs(other.value - delay.value) < CONTRADICTS * abs(delay.value) for other in others
    )


def _finding(value: float, error: float, joint: int | None, period: float, joints: int) -> Finding:
    who = f"the torques of {joints} joints" if joint is None else "the torque"
    verb = ("lag" if value > 0 else "lead") + ("" if joint is None else "s")
    return Finding(
        name="delay",
        severity="warning" if abs(value) > period else "info",
        text=f"{who} {verb} the position by {1e3 * abs(value):.3g} ms ({abs(value) / period:.2g} samples, "
        f"standard error {1e3 * error:.2g} ms)",
        action="a delay distorts friction and damping: log position and torque on one clock, or shift the torque",
        value=value,
        unit="s",
        joint=joint,
    )
