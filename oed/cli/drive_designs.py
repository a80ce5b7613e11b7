"""``oed design --for actuators``: commands that determine drives."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import typer

from oed.cli.links import is_given
from robots.common.errors import InputError
from robots.common.progress import Progress

MEANINGLESS = (
    *("criterion", "friction", "offset", "family", "harmonics", "base_frequency", "periods", "strokes"),
    *("payload", "tool_box", "singularity", "essential", "scaling", "noise", "after", "task", "payload_only"),
    *("discriminate", "effort", "time_limit", "workers", "cluster", "tip", "torque_margin", "velocity_fraction"),
    *("floor", "no_floor", "keep_out", "clearance", "torque", "assume_masses"),
)
"""Options of other designs."""


def refuse_beside_drives(context: typer.Context) -> None:
    """Refuses options that do not apply with ``--for actuators``.

    Raises:
        InputError: naming them.
    """
    given = [f"--{name.replace('_', '-')}" for name in MEANINGLESS if is_given(context, name)]
    if given:
        verb = "does" if len(given) == 1 else "do"
        raise InputError(f"{', '.join(given)} {verb} not apply with --for actuators", remedy="remove these options")


def design_for_drives(
    robot: str,
    gains: Path | None,
    *,
    lock: Sequence[str] | None,
    joints: str | None,
    home: Sequence[float] | None,
    duration: float,
    seed: int,
    out: Path,
    force: bool,
    progress: Progress,
) -> tuple[str, dict[str, Any]]:
    """Designs the commands and writes commands.csv, design.json and report.html.

    Raises:
        InputError: see `load_branches`, `described_drives` and `design_drive_motion`.
        InfeasibleError: no motion stays within the limits.
    """
    from oed.cli.commands.actuators import named, positions
    from oed.experiments.drives import DriveDesignOptions, design_drive_motion
    from oed.reports import save_drive_design_report
    from robots.common.files import ResultFolder
    from robots.drives import described_drives, load_branches

    with ResultFolder(out, force, names=["commands.csv", "design.json", "report.html"]) as folder:
        chains = load_branches(robot, joints=named(joints), locked=positions(lock))
        known = described_drives(chains, gains)
        options = DriveDesignOptions(duration=duration, seed=seed, home=None if home is None else tuple(home))
        result = design_drive_motion(chains, known.drives, options=options, progress=progress)
        result.save(folder.path("commands.csv").parent)
        save_drive_design_report(result, folder)
    return result.summary(), result.to_dict()
