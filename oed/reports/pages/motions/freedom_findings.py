"""Findings on the collisions of a motion that someone will play."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from oed.experiments.safety_checks.freedom import collides, freedom_text, is_free
from oed.reports.rendering.page import Finding, findings_of


def freedom_findings(freedom: Mapping[str, Any] | None) -> tuple[Finding, ...]:
    """Says what is not known of a motion's collisions, or what it collides with.

    Args:
        freedom: as `collision_data` writes it; None for a motion that was not checked.
    """
    text = freedom_text(freedom)
    if freedom is None:
        return (Finding(code="collision.unchecked", text=text, action="Leave out --no-collision."),)
    if collides(freedom):
        return (Finding(code="collision.found", text=text, action="Do not play it."),)
    return () if is_free(freedom) else findings_of("collision.sampled", [text])
