"""Lists the effects of the catalogue and the experiments that separate them.

The names are those of `oed diagnose` and of plant files.
"""

from __future__ import annotations

from dataclasses import dataclass

from oed.cli.verbs import Printed, Verb
from robots.common.progress import Progress


@dataclass(frozen=True, kw_only=True)
class Effects(Verb):
    """``oed effects``."""

    examples = ("oed effects", "oed effects --json")

    def run(self, progress: Progress) -> Printed:
        """Lists the effects."""
        from robots.terms.effect_table import effect_rows, effect_text

        rows = effect_rows()
        return Printed(summary=effect_text(rows), data={"effects": rows})
