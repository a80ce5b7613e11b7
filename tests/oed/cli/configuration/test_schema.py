"""The schema of the configuration file."""

import json

from oed.cli.app import VERBS
from oed.cli.configuration.schema import configuration_schema


def test_the_schema_is_json() -> None:
    """Editors read it: infinite defaults are left out, which JSON does not know."""
    schema = configuration_schema(VERBS)
    assert json.loads(json.dumps(schema, allow_nan=False)) == schema
    assert "default" not in schema["definitions"]["design"]["properties"].get("jerk", {})
    assert any("default" in option for option in schema["definitions"]["design"]["properties"].values())
