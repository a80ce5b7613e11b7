"""What an identification asks of its reader."""

from __future__ import annotations

from itertools import chain, repeat

import numpy as np

from estimation.identifications.estimate import Estimate
from oed.reports.pages.diagnosis_actions import place_of
from oed.reports.rendering.page import Finding


def verdict_of(estimate: Estimate) -> str:
    """Says in one sentence what to do.

    Args:
        estimate: the identification.
    """
    lost = [joint.joint for joint in estimate.joints if not joint.identified]
    if lost:
        return f"Record more motion of {place_of(lost)} and identify again: these logs do not determine it."
    if estimate.choice.contradiction is not None:
        return "State the payload or base of each log, or run oed diagnose: the logs contradict each other."
    error = 100 * np.median([joint.nrmse for joint in estimate.joints])
    return f"Use model.json: it predicts held-out torque to {error:.1f} % of the torque RMS (median joint)."


def findings_in(estimate: Estimate) -> tuple[Finding, ...]:
    """Lists what the estimate warns of, and the findings in its logs.

    Args:
        estimate: the identification.
    """
    # `Estimate.warnings` begins with these three, as far as they apply, in this order.
    urgent = (
        ("joint.not_identified", not all(joint.identified for joint in estimate.joints)),
        ("logs.contradict", estimate.choice.contradiction is not None),
        ("parameters.undetermined", not estimate.model.determined.all()),
    )
    codes = chain((code for code, applies in urgent if applies), repeat("model.warning"))
    found = [Finding(code=code, text=text) for code, text in zip(codes, estimate.warnings, strict=False)]
    found += [
        Finding(code=f"log.{finding.severity}", subject=f"{gate.log}:", text=f"{finding}.")
        for gate in estimate.gates
        for finding in gate.findings
    ]
    return tuple(found)
