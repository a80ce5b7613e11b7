"""Result of a fleet: rows, worst first."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from estimation.monitoring.fleets.robot_row import LIGHTS, RobotRow
from robots.common.files import write_atomic
from robots.common.records import Finding, Result, axes_for, read_json

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

RESULT, TABLE = "fleet.json", "fleet.csv"
LISTED_ROBOTS = 20


@dataclass(frozen=True, kw_only=True)
class FleetResult(Result, format="robot-oed fleet"):
    """All robots of a fleet.

    Attributes:
        rows: worst first.
        resumed: robots that an earlier run had done.
        single: robots that are a log directly in the folder.
    """

    FILE = RESULT
    ENTRIES = ("light", "verdict", "counts", "resumed", "robots=rows")

    rows: tuple[RobotRow, ...]
    resumed: int = 0
    single: int = 0

    def count(self, light: str) -> int:
        """Number of robots with a light."""
        return sum(row.light == light for row in self.rows)

    @property
    def counts(self) -> dict[str, int]:
        """Number of robots with each light."""
        return {light: self.count(light) for light in LIGHTS}

    @property
    def light(self) -> str:
        """The worst light."""
        return self.rows[0].light

    @property
    def conclusion(self) -> str:
        """How many robots need what, and with which one to begin."""
        worst = self.rows[0]
        return f"{self.verdict()} Begin with {worst.name}. {worst.advice}" if worst.advice else self.verdict()

    @property
    def remarks(self) -> tuple[Finding, ...]:
        """One of each robot."""
        return tuple(
            Finding(code=f"fleet.{row.light}", subject=f"{row.name}:", text=row.text, action=row.advice)
            for row in self.rows
        )

    def verdict(self) -> str:
        """Says in one sentence how many robots need what."""
        red, amber, grey = (self.count(light) for light in ("red", "amber", "grey"))
        robots = f"{len(self.rows)} robots" if len(self.rows) != 1 else "1 robot"
        if not (red or amber or grey):
            return f"{robots}: no change beyond what temperature explains."
        parts = [f"{red} need action"] if red else []
        parts += [f"{amber} to be watched"] if amber else []
        parts += [f"{grey} without a usable log"] if grey else []
        return f"{robots}: {', '.join(parts)}, {self.count('green')} without a finding."

    def summary(self) -> str:
        """Gives the verdict and the worst robots."""
        lines = [self.verdict()]
        shown = [row for row in self.rows if row.light != "green"]
        for row in shown[:LISTED_ROBOTS]:
            lines.append(f"  {row.light:5}  {row.name}: {row.text}")
        if len(shown) > LISTED_ROBOTS:
            lines.append(f"  and {len(shown) - LISTED_ROBOTS} more")
        count, left_out = sum(len(row.logs) for row in self.rows), sum(row.left_out for row in self.rows)
        lines.append(f"  {count} logs, {left_out} left out; {self.resumed} robots were done before")
        if self.single > 1:
            lines.append(
                f"  {self.single} logs lie directly in the folder. Each was taken as a robot of its own. For the logs "
                "of one robot use oed monitor --log-dir."
            )
        return "\n".join(lines)

    def to_frame(self) -> pd.DataFrame:
        """Gives a row per robot, worst first."""
        import pandas as pd

        return pd.DataFrame(
            [
                {
                    "robot": row.name,
                    "light": row.light,
                    "finding": row.text,
                    "since": row.since,
                    "logs": len(row.logs),
                    "left_out": row.left_out,
                    "hours": row.hours,
                    "heat_low_percent": row.heat[0],
                    "heat_high_percent": row.heat[1],
                }
                for row in self.rows
            ]
        )

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws how many robots have which light.

        Args:
            ax: where to draw; a new figure by default.
        """
        axes, shown = axes_for(ax, (5, 4)), [light for light in LIGHTS if self.count(light)]
        axes.bar(shown, [self.count(light) for light in shown], color=shown)
        axes.set_ylabel("robots")
        return axes

    @classmethod
    def load(cls, folder: str | Path) -> FleetResult:
        """Reads the file of `save`; the rows have no trends.

        Args:
            folder: with `fleet.json`.

        Raises:
            InputError: a missing or damaged file.
        """
        file, remedy = Path(folder) / RESULT, "give the folder written by `oed fleet`"
        data = read_json(file, cls.FORMAT, cls.FORMAT_VERSION, remedy=remedy)
        return cls.from_dict(data, file=file, remedy=remedy)

    def _save_beside(self, folder: Path, *, force: bool) -> None:
        """Writes `fleet.csv`."""
        write_atomic(folder / TABLE, self.to_frame().to_csv(index=False), force=force)
