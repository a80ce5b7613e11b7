"""The verdict of a diagnosis as one line of text."""

from __future__ import annotations

from collections.abc import Sequence

from estimation.diagnosis.findings import Finding
from estimation.diagnosis.hypothesis_tests.evidence import is_close_rival
from robots.common.plain import several
from robots.terms.effects import EFFECTS


def state_verdict(verdict: str, findings: Sequence[Finding]) -> str:
    """States the verdict in one line, with the known causes and their joints.

    Args:
        verdict: ``none``, ``named``, ``ambiguous`` or ``unexplained``.
        findings: all findings of the diagnosis.

    Returns:
        One line of text.
    """
    joints: dict[str, list[int]] = {}
    for finding in findings:
        if finding.effect != "unexplained":
            joints.setdefault(finding.effect, []).extend([finding.joint] if finding.joint else [])
    known = ", ".join(name + _at_joints(sorted(places)) for name, places in sorted(joints.items()))
    count = f"{several(len(joints), 'known cause')} found: {known}" if known else ""
    if verdict == "named" and known:
        return count
    return _VERDICTS[verdict] + (f"; {count}" if known else "")


def _at_joints(joints: Sequence[int]) -> str:
    if not joints:
        return " (whole robot)"
    return f" (joint{'s' if len(joints) > 1 else ''} {', '.join(map(str, joints))})"


_VERDICTS = {
    "none": "no significant effect found; base model and noise explain the residual",
    "named": "a known cause was found",
    "ambiguous": "several known causes explain the residual about equally well",
    "unexplained": "part of the residual is significant, and no effect of the catalogue explains it",
}


def format_p_value(value: float) -> str:
    """Formats a p-value with three decimals, or as ``< 0.001``."""
    return f"{value:.3f}" if value >= 0.001 else "< 0.001"


def close_rivals(finding: Finding) -> list[str]:
    """Lists the causes that fit about as well as a finding, each with the difference in BIC."""
    close = []
    for name, worse in finding.rivals:
        effect = EFFECTS.get(name.split(" of joint ")[0])
        if is_close_rival(effect is not None and effect.rare, worse):
            close.append(f"{name} ({worse:.0f})")
    return close
