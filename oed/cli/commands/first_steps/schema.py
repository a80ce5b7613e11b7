"""Prints the JSON schema of oed.toml, with which editors complete and check the file."""

from __future__ import annotations

import json
from dataclasses import dataclass

from oed.cli.verbs import Printed, Verb
from robots.common.progress import Progress


@dataclass(frozen=True, kw_only=True)
class Schema(Verb):
    """``oed schema``."""

    examples = ("oed schema", "oed schema --json")

    def run(self, progress: Progress) -> Printed:
        """Makes the schema."""
        from oed.cli.app import VERBS
        from oed.cli.configuration.schema import configuration_schema

        schema = configuration_schema(VERBS)
        return Printed(json.dumps(schema, indent=2, allow_nan=False), schema)
