"""Explains the code of a message: what it means, what causes it, and what to do.

Without a code it lists all of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from oed.cli.verbs import Printed, Verb
from robots.common.options import Option
from robots.common.progress import Progress


@dataclass(frozen=True, kw_only=True)
class Explain(Verb):
    """``oed explain``.

    Attributes:
        code: a code such as OED-L014, or the name behind it; all by default.
    """

    examples = ("oed explain OED-L014", "oed explain")

    code: Annotated[str, Option(argument=True)] = ""

    def run(self, progress: Progress) -> Printed:
        """Explains one code, or lists all."""
        from estimation.gate.explanations import EXPLANATIONS, explain
        from robots.common.errors import ERRORS
        from robots.common.records import plain

        found = (explain(self.code),) if self.code else (*EXPLANATIONS, *ERRORS)
        listed = [f"{item.code}  {item.name:22} {item.meaning}" for item in found]
        data = {"codes": [plain({name: getattr(item, name) for name in item.ENTRIES}) for item in found]}
        return Printed(found[0].text() if self.code else "\n".join(listed), data)
