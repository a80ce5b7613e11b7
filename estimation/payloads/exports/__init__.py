"""Payloads as controllers and descriptions take them."""

from estimation.payloads.exports.forms import Franka, Kuka, PayloadExport, RosParameters, UrdfLink, UrScript
from robots.common.errors import InputError

EXPORTS: dict[str, PayloadExport] = {
    export.name: export for export in (UrScript(), Franka(), Kuka(), RosParameters(), UrdfLink())
}
"""All forms by their names."""


def payload_export(name: str) -> PayloadExport:
    """Gives the form of a name.

    Raises:
        InputError: an unknown form.
    """
    if name not in EXPORTS:
        raise InputError(f"--to {name}", allowed=", ".join(EXPORTS))
    return EXPORTS[name]


__all__ = ["EXPORTS", "PayloadExport", "payload_export"]
