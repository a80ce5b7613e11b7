"""From an alarm to findings: which quantities changed, when, by how much, and what that is called."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimation.monitoring.control_charts.change_fit import StepFit
from estimation.monitoring.control_charts.quantities import Quantity, start_limit
from estimation.monitoring.findings import Finding, Kind, relative
from estimation.monitoring.windows.baseline import PAYLOAD
from estimation.uncertainty.quantiles import NORMAL_95, chi2_limit


@dataclass(frozen=True, kw_only=True, eq=False)
class Change:
    """A quantity that changed.

    Attributes:
        quantity: it.
        size: of the step, in its unit.
        error: standard error of the size.
        gain: twice the gain of the log likelihood.
        earliest: of the date [s].
        latest: of the date [s].
        first: whether the step begins with the first of all windows.
        window: index of the first changed window among the quantity's samples.
        begins: whether a recording begins with this window.
    """

    quantity: Quantity
    size: float
    error: float
    gain: float
    earliest: float
    latest: float
    first: bool
    window: int
    begins: bool

    @property
    def sigmas(self) -> float:
        """Size over its standard error."""
        return self.size / self.error


def changes_at(quantities: Sequence[Quantity], sources: Sequence[Quantity], begin: float) -> list[Change]:
    """Finds the quantities that changed.

    Args:
        quantities: all of them.
        sources: those with an alarm.
        begin: start of the first of all windows [s].

    Returns:
        The changes; none where the alarm is not confirmed.
    """
    fits = [(q, q.steps()) for q in quantities if len(q.samples) > 1]
    # Probability that any quantity without an alarm of its own is named beside one that has changed.
    critical, limit = chi2_limit(0.01, tests=max(len(fits), 1)), start_limit(len(quantities))

    def changed(q: Quantity, fit: StepFit, k: int) -> bool:
        if k == 0 and q.is_whole(begin):
            return q.starts_beyond(fit, limit)
        return bool(fit.exceeding(q.margin)[k] > critical)

    own = [(q, fit, _first_window(q, fit, begin)) for q, fit in fits if any(q is s for s in sources)]
    own = [(q, fit, k) for q, fit, k in own if changed(q, fit, k)]
    if not own:
        return []
    quantity, _, k = max(own, key=lambda item: float(item[1].gains[item[2]]))
    date = quantity.samples[k].start
    carried = any(q.group == "payload" for q, _, _ in own)
    found = []
    # A step within so many windows of the first one has the same date.
    near = 2
    for q, fit in fits:
        alarmed = next((k for other, _, k in own if other is q), None)
        starts = np.array([s.start for s in q.samples])
        if alarmed is None:
            place = int(np.searchsorted(starts, date - 1e-6))
            if place >= len(starts):
                continue
            alarmed = fit.best(max(place - near, 0), min(place + near, len(starts) - 1))
        # A body has mass and moments together: those of a mass that changed count, however small.
        if (carried and q.group == "payload") or changed(q, fit, alarmed):
            found.append(_change(q, fit, alarmed, begin))
    return found


def _first_window(q: Quantity, fit: StepFit, begin: float) -> int:
    """The window with which a step begins; the first of all where the step may begin there."""
    return 0 if q.is_whole(begin) and fit.interval()[0] == 0 else int(np.argmax(fit.gains))


def _change(q: Quantity, fit: StepFit, k: int, begin: float) -> Change:
    first, last = fit.interval()
    first, last = min(first, k), max(last, k)
    # A change within a window makes it a mixture: the window before the first changed one may hold the change.
    earliest = q.samples[first - 1].start if first else q.samples[0].start
    return Change(
        quantity=q,
        size=float(fit.sizes[k]),
        error=float(fit.errors[k]),
        gain=float(fit.gains[k]),
        earliest=earliest,
        latest=q.samples[last].end,
        first=k == 0 and q.is_whole(begin),
        window=k,
        begins=k == 0 or k in q.after_pauses(),
    )


def name_changes(
    changes: Sequence[Change], *, joints: int, units: Sequence[str], common_unit: str, detected: float, log: str
) -> list[Finding]:
    """Gives changes their names.

    A payload explains offsets. A residual that grows beside a named change belongs to it. One that grows in most joints
    does not: then the named change does not explain the torques.

    Args:
        changes: of one event.
        joints: number of joints.
        units: of the offsets (n,).
        common_unit: of what all joints share.
        detected: time of the alarm [s].
        log: name of the log.
    """
    by_group = {
        group: [c for c in changes if c.quantity.group == group]
        for group in ("friction", "offset", "payload", "common", "residual")
    }
    # One cause damages one joint or two; what all joints share is taken out before.
    # A log of another robot differs from its first window on, a push does not.
    grown = [c for c in by_group["residual"] if c.size > 0 and c.begins]
    if max(len(by_group["friction"]), len(grown)) >= max(3, joints / 2):
        worst = max(changes, key=lambda c: c.gain)
        text = f": {len(changes)} quantities differ from the model at once"
        return [_finding(worst, "misfit", None, (0.0, 0.0, 0.0), "", detected, log, text)]
    found = []
    for c in by_group["friction"]:
        kind: Kind = "damage" if c.size > 0 else "friction_decrease"
        found.append(_finding(c, kind, c.quantity.index + 1, relative(c.size, _with_margin(c)), "%", detected, log))
    payload = by_group["payload"]
    if payload:
        found.append(_payload(payload, detected, log))
    else:
        for c in by_group["offset"]:
            j = c.quantity.index
            found.append(_finding(c, "offset", j + 1, _interval(c), units[j], detected, log))
    for c in by_group["common"]:
        values = relative(c.size, c.error) if common_unit == "%" else _interval(c)
        found.append(_finding(c, "heat", None, values, common_unit, detected, log))
    if not found:
        # A residual that falls needs no attention.
        for c in (c for c in by_group["residual"] if c.size > 0):
            share = relative(c.size, c.error)[0]
            text = f" (RMS {share:+.0f} %)"
            found.append(
                _finding(c, "unknown", c.quantity.index + 1, relative(c.size, c.error), "%", detected, log, text)
            )
    return found


def _payload(changes: Sequence[Change], detected: float, log: str) -> Finding:
    main = max(changes, key=lambda c: c.gain)
    mass = next((c for c in changes if PAYLOAD[c.quantity.index] == PAYLOAD[0]), None)
    if mass is None or abs(mass.sigmas) < NORMAL_95:
        return _finding(main, "unknown", None, (0.0, 0.0, 0.0), "", detected, log, ": a moment at the flange changed")
    moments = {PAYLOAD[c.quantity.index][-1]: c for c in changes if c is not mass}
    text = f", centre {', '.join(_centre(mass, axis, moments.get(axis)) for axis in 'xyz')} in the flange frame"
    return _finding(main, "payload", None, _interval(mass), "kg", detected, log, text)


def _centre(mass: Change, axis: str, moment: Change | None) -> str:
    """One coordinate of the centre with its 95 % interval; mass and moment are taken as independent."""
    if moment is None:
        return f"{axis} not seen"
    centre = moment.size / mass.size
    error = np.hypot(moment.error, centre * mass.error) / abs(mass.size)
    return f"{axis} {centre:.3f} ({centre - NORMAL_95 * error:.3f} to {centre + NORMAL_95 * error:.3f}) m"


def _with_margin(c: Change) -> float:
    """Standard error of a step in friction: what the model gets wrong is as large as the smallest finding."""
    return float(np.hypot(c.error, c.quantity.margin / NORMAL_95))


def _interval(c: Change) -> tuple[float, float, float]:
    return c.size, c.size - NORMAL_95 * c.error, c.size + NORMAL_95 * c.error


def _finding(
    c: Change,
    kind: Kind,
    joint: int | None,
    values: tuple[float, float, float],
    unit: str,
    detected: float,
    log: str,
    text: str = "",
) -> Finding:
    size, low, high = values
    return Finding(
        kind=kind,
        joint=joint,
        size=size,
        low=low,
        high=high,
        unit=unit,
        earliest=c.earliest,
        latest=c.latest,
        detected=detected,
        sigmas=abs(c.sigmas),
        from_start=c.first,
        log=log,
        text=text,
    )
