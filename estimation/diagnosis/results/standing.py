"""What the figures of a diagnosis allow to conclude: one rule for summary, report and overview."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimation.diagnosis.calibration import LARGE_HELD_OUT_ERROR
from estimation.diagnosis.experiment_plans.detection_limits import Limit

Standing = Literal["sound", "unconfirmed", "inaccurate"]


def standing_of(verdict: str, before: ArrayLike, after: ArrayLike, every: ArrayLike | None = None) -> Standing:
    """Judges a diagnosis by its errors on unseen data.

    Args:
        verdict: ``none``, ``named``, ``ambiguous`` or ``unexplained``.
        before: NRMSE of the base model per joint (n,) on held-out data.
        after: NRMSE of the extended model per joint (n,) on held-out data.
        every: NRMSE of the extended model per joint (n,) on all held-out rows; NaN or None where unknown.

    Returns:
        ``unconfirmed`` where effects are named that do not reduce the error of unseen rows: they are no order to act.
        ``inaccurate`` where nothing is left to name but a joint's error is large. Else ``sound``.
    """
    if verdict == "named" and not _pooled(after) < _pooled(before):
        return "unconfirmed"
    return "inaccurate" if verdict in ("none", "named") and len(inaccurate_joints(after, every)) else "sound"


def inaccurate_joints(after: ArrayLike, every: ArrayLike | None = None) -> NDArray[np.int_]:
    """Joints, counted from 1, whose error on unseen data is large; arguments as in `standing_of`."""
    return np.flatnonzero(_worst(after, every) > LARGE_HELD_OUT_ERROR) + 1


def standing_text(
    verdict: str, before: ArrayLike, after: ArrayLike, every: ArrayLike | None = None, limits: Sequence[Limit] = ()
) -> str:
    """States the figures that forbid a conclusion, in one or two sentences; empty where they forbid nothing.

    Args:
        verdict: see `standing_of`.
        before: see `standing_of`.
        after: see `standing_of`.
        every: see `standing_of`.
        limits: detection limits of the logs.
    """
    standing = standing_of(verdict, before, after, every)
    if standing == "unconfirmed":
        return (
            f"The effects found do not reduce the error on unseen data: {100 * _pooled(before):.3g} -> "
            f"{100 * _pooled(after):.3g} % of the torque."
        )
    if standing == "sound":
        return ""
    worst = _worst(after, every)
    names = ", ".join(f"{100 * worst[joint - 1]:.0f} % on joint {joint}" for joint in inaccurate_joints(after, every))
    text = f"The error on unseen data, of the torque, is {names}."
    sizes = [limit.detectable for limit in limits if np.isfinite(limit.detectable)]
    if verdict == "none" and limits and _blind(limits):
        shows = (
            f"half of the effects only from {100 * np.median(sizes):.0f} % of the torque on" if sizes else "no effect"
        )
        text = f"These logs can show {shows}. {text}"
    return text


def standing_verdict(
    verdict: str, before: ArrayLike, after: ArrayLike, every: ArrayLike | None = None, limits: Sequence[Limit] = ()
) -> str:
    """Says in one sentence what the figures forbid; empty where they forbid nothing. Arguments: see `standing_text`."""
    standing = standing_of(verdict, before, after, every)
    if standing == "sound":
        return ""
    if standing == "unconfirmed":
        return "Record other motions before you act on what was found: unseen data do not confirm it."
    largest = 100 * np.nanmax(_worst(after, every))
    why = ", and these logs can show little" if verdict == "none" and limits and _blind(limits) else ""
    return f"Do not use the model as it is: it errs by up to {largest:.0f} % of the torque on unseen data{why}."


def _blind(limits: Sequence[Limit]) -> bool:
    """Whether half of the effects would show only above a large share of the torque."""
    sizes = [limit.detectable for limit in limits if np.isfinite(limit.detectable)]
    return not sizes or float(np.median(sizes)) > LARGE_HELD_OUT_ERROR


def _worst(after: ArrayLike, every: ArrayLike | None) -> NDArray[np.float64]:
    known = np.asarray(after, dtype=np.float64)
    return known if every is None else np.fmax(known, np.asarray(every, dtype=np.float64))


def _pooled(errors: ArrayLike) -> float:
    """Root mean square over the joints whose error is known; NaN without any."""
    known = np.asarray(errors, dtype=np.float64)
    known = known[np.isfinite(known)]
    return float(np.sqrt(np.mean(known**2))) if known.size else float("nan")
