"""Lists the robots of the catalogue."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

from oed.cli.verbs import Printed, Verb
from robots.common.errors import AssumedValueWarning
from robots.common.progress import Progress


@dataclass(frozen=True, kw_only=True)
class Robots(Verb):
    """``oed robots``."""

    examples = ("oed robots",)

    def run(self, progress: Progress) -> Printed:
        """Lists the robots."""
        from robots.loading import catalogue, load_robot
        from robots.robot_summary import reach

        with warnings.catch_warnings():
            warnings.simplefilter("ignore", AssumedValueWarning)
            found = [load_robot(name) for name in catalogue()]
        rows = [
            {
                "name": known.name,
                "title": known.title,
                "joints": known.n,
                "payload": known.payload,
                "reach": round(reach(known), 3),
                "assumed": list(known.assumed),
            }
            for known in found
        ]
        lines = [f"{'name':8} {'robot':40} {'joints':>6} {'payload':>8} {'reach':>7}"]
        for row in rows:
            payload = "-" if row["payload"] is None else f"{row['payload']:g} kg"
            lines.append(f"{row['name']:8} {row['title']:40} {row['joints']:6} {payload:>8} {row['reach']:5.2f} m")
        lines.append(
            "details: oed robot show NAME; --robot takes these names, and the path of a URDF, xacro or robot YAML"
        )
        return Printed(summary="\n".join(lines), data={"robots": rows})
