"""Lists the effects of the catalogue and the experiments that separate them, or explains one of them.

The names are those of `oed diagnose` and of plant files.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from oed.cli.verbs import Printed, Verb
from robots.common.options import Option
from robots.common.progress import Progress


@dataclass(frozen=True, kw_only=True)
class Effects(Verb):
    """``oed effects``.

    Attributes:
        name: an effect such as ``spring``; all by default.
    """

    examples = ("oed effects", "oed effects spring", "oed effects --json")

    name: Annotated[str, Option(argument=True, choices="robots.terms.effects:EFFECTS")] = ""

    def run(self, progress: Progress) -> Printed:
        """Explains one effect, or lists all."""
        from robots.terms.effect_table import effect_rows, effect_text, explained_effect

        if self.name:
            row = explained_effect(self.name)
            return Printed(summary=row.pop("text"), data={"effects": [row]})
        rows = effect_rows()
        return Printed(summary=effect_text(rows), data={"effects": rows})
