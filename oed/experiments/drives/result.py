"""A designed motion for drives: commands, and the standard errors that they will bring."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from oed.exports.trajectory_checks import UNKNOWN_COLLISIONS
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.files import existing_file
from robots.common.records import Finding, Result, axes_for, findings_of, read_json
from robots.common.tables.table_files import write_table

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


COMMANDS = "commands.csv"


@dataclass(frozen=True, kw_only=True)
class ExpectedError:
    """Standard error that a motion will bring.

    Attributes:
        parameter: such as ``armature``.
        group: the joint, or ``all``.
        unit: its unit.
        standard_error: of the designed motion.
        of_chirp: of a chirp of the same time and limits; NaN without one.
    """

    parameter: str
    group: str
    unit: str
    standard_error: float
    of_chirp: float

    @property
    def ratio(self) -> float:
        """Standard error over that of a chirp."""
        return self.standard_error / self.of_chirp


@dataclass(frozen=True, kw_only=True, eq=False)
class DriveDesign(Result, format="robot-oed drive design"):
    """A motion for drives.

    Attributes:
        robot: its name.
        joints: names of the joints.
        t: times (N,) [s].
        command: commanded positions (N, n) [rad or m].
        segments: kinds of the segments, in order.
        expected: standard errors.
        noise: of measured positions [rad or m], for which they hold.
        collisions: what was checked for collisions, and how near the motion comes.
    """

    FILE = "design.json"
    ENTRIES = ("robot", "joints", "segments", "expected", "noise", "collisions")

    robot: str
    joints: tuple[str, ...]
    t: Array
    command: Array
    segments: tuple[str, ...]
    expected: tuple[ExpectedError, ...]
    noise: float
    collisions: str = UNKNOWN_COLLISIONS

    @property
    def collides(self) -> bool:
        """Whether the check found a collision."""
        return self.collisions.startswith("COLLIDES")

    @property
    def success(self) -> bool:
        """Whether the motion is better than a chirp in most parameters, and does not collide."""
        return bool(self.ratio < 1) and not self.collides

    @property
    def ratio(self) -> float:
        """Median over the parameters of the standard error over that of a chirp."""
        return float(np.nanmedian([item.ratio for item in self.expected]))

    @property
    def conclusion(self) -> str:
        """Whether to play the motion, and what it is worth beside a chirp."""
        if self.collides:
            return f"Do not play this motion. {self.collisions}"
        return f"Standard errors will be {self.ratio:.2g} times those of a chirp of the same time and limits."

    @property
    def remarks(self) -> tuple[Finding, ...]:
        """What was checked for collisions."""
        return findings_of("experiment.note", [self.collisions])

    def summary(self) -> str:
        """Lists segments and expected standard errors, beside those of a chirp."""
        lines = [
            f"{self.robot}: {self.t[-1] - self.t[0]:.3g} s of commands for {len(self.joints)} joints: "
            f"{', '.join(self.segments)}",
            f"  expected standard errors are {self.ratio:.2g} times those of a chirp of the same time and limits "
            f"(median; {min(item.ratio for item in self.expected):.2g} to "
            f"{max(item.ratio for item in self.expected):.2g})",
            "  parameter                          standard error     chirp's   (measured positions of "
            f"{1e3 * self.noise:.2g} mrad noise)",
        ]
        for item in self.expected:
            name = f"{item.parameter} {item.group}"
            lines.append(f"  {name:34} {item.standard_error:12.2g} {item.of_chirp:12.2g} {item.unit}")
        return "\n".join([*lines, f"  {self.collisions}"])

    def to_frame(self) -> pd.DataFrame:
        """Gives a row per parameter."""
        import pandas as pd

        return pd.DataFrame([asdict(item) | {"ratio": item.ratio} for item in self.expected])

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws the commands over time.

        Args:
            ax: where to draw; a new figure by default.
        """
        axes = axes_for(ax, (8, 4))
        for j, name in enumerate(self.joints):
            axes.plot(self.t, self.command[:, j], label=name)
        axes.set_xlabel("time [s]")
        axes.set_ylabel("command [rad or m]")
        axes.legend(fontsize="small")
        return axes

    def _save_beside(self, folder: Path, *, force: bool) -> None:
        """Writes `commands.csv` (``t,qref1..qrefn``)."""
        columns = {"t": self.t} | {f"qref{j + 1}": self.command[:, j] for j in range(len(self.joints))}
        metadata = {"robot": self.robot, "joints": list(self.joints), "collisions": self.collisions}
        write_table(folder / COMMANDS, columns, metadata, force=force)

    @classmethod
    def load(cls, folder: str | Path) -> DriveDesign:
        """Reads what `save` wrote.

        Args:
            folder: with both files.

        Raises:
            InputError: a missing or damaged file.
        """
        import pandas as pd

        place, remedy = Path(folder), "give the folder written by `oed design --for actuators`"
        data = read_json(place / cls.FILE, cls.FORMAT, cls.FORMAT_VERSION, remedy=remedy)
        table = pd.read_csv(existing_file(place / COMMANDS), comment="#")
        names = ["t", *(f"qref{j + 1}" for j in range(len(data.get("joints", ()))))]
        lacking = [name for name in names if name not in table]
        if lacking:
            raise InputError("is missing", file=place / COMMANDS, column=lacking[0], remedy=remedy)
        t, *command = (table[name].to_numpy(dtype=float) for name in names)
        return cls.from_dict(data, file=place / cls.FILE, remedy=remedy, t=t, command=np.column_stack(command))
