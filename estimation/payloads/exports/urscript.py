"""Universal Robots: a URScript program that sets the payload."""

from __future__ import annotations

from typing import ClassVar

from estimation.payloads.body import Body
from estimation.payloads.exports.base import PayloadExport, number


class UrScript(PayloadExport):
    """``set_target_payload(m, cog, inertia)``.

    Mass [kg]; centre of gravity ``[x, y, z]`` from the tool mount [m]; inertia ``[Ixx, Iyy, Izz, Ixy, Ixz, Iyz]``
    [kg m2] about the centre of gravity, its axes those of the tool flange (Universal Robots, script manual,
    https://www.universal-robots.com/manuals/EN/HTML/SW10_6/Content/prod-scriptmanual/G5/set_target_payload.htm).
    Controllers before that function take ``set_payload(m, cog)``, which stands in a comment.
    """

    name: ClassVar[str] = "urscript"
    file: ClassVar[str] = "payload.script"
    title: ClassVar[str] = "URScript of Universal Robots"

    def text(self, body: Body, title: str) -> str:
        """Writes the call."""
        centre, I = body.centre, body.inertia  # noqa: E741
        cog = ", ".join(map(number, centre))
        inertia = ", ".join(map(number, (I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2])))
        mass = number(body.mass)
        return (
            f"# {title}\n"
            "# Mass [kg]; centre of gravity [m] in the flange frame; inertia about it [kg m2]: xx yy zz xy xz yz.\n"
            f"# Older controllers: set_payload({mass}, [{cog}])\n"
            f"set_target_payload({mass}, [{cog}], [{inertia}])\n"
        )
