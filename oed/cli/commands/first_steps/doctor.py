"""Checks the installation: libraries, extras and what they bring, compiler, configuration file.

Exit code 1 if a required library is missing or too old, or if the configuration file is wrong.
"""

from __future__ import annotations

from dataclasses import dataclass

from oed.cli.verbs import Printed, Verb
from robots.common.progress import Progress


@dataclass(frozen=True, kw_only=True)
class Doctor(Verb):
    """``oed doctor``."""

    examples = ("oed doctor",)

    def run(self, progress: Progress) -> Printed:
        """Describes the installation."""
        from oed.cli.configuration.defaults import configuration_state
        from oed.installation import installation, installation_text, with_configuration

        found = with_configuration(installation(), configuration_state())
        return Printed(summary=installation_text(found), data=found, code=1 if found["problems"] else 0)
