"""``oed design --discriminate``: an experiment that distinguishes two possible causes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import typer

from robots.collision import Surroundings
from robots.common.errors import InputError
from robots.common.progress import Progress
from robots.robot import Robot

APPLY = {
    "robot",
    "discriminate",
    "friction",
    "home",
    "velocity_fraction",
    "collision",
    "floor",
    "no_floor",
    "keep_out",
    "noise",
    "seed",
    "out",
    "tip",
    "joints",
    "lock",
    "unlimited",
    "assume_masses",
    "png",
    "force",
    "json",
    "quiet",
}
"""Options of ``oed design`` that apply with ``--discriminate``."""


def refuse_others(context: typer.Context) -> None:
    """Refuses options that do not apply with ``--discriminate``.

    Raises:
        InputError: naming them.
    """
    sources = {name: context.get_parameter_source(name) for name in context.params}
    given = [
        f"--{name.replace('_', '-')}"
        for name, source in sources.items()
        if name not in APPLY and source is not None and source.name == "COMMANDLINE"
    ]
    if given:
        verb = "does" if len(given) == 1 else "do"
        raise InputError(
            (
                f"{', '.join(given)} {verb} not apply with --discriminate, which maximises the probability of the "
                f"right decision"
            ),
            remedy="remove these options, or remove --discriminate",
        )


def design_discriminating(
    robot: Robot,
    rivals: str,
    *,
    noise: list[float] | None,
    friction: str,
    home: list[float] | None,
    velocity_fraction: float | None,
    collision: bool,
    surroundings: Surroundings,
    seed: int,
    out: Path,
    png: bool,
    force: bool,
    progress: Progress,
) -> tuple[str, dict[str, Any]]:
    """Writes trajectory.csv, design.json and report.html; returns the summary and the data."""
    from oed.campaigns.discriminations.design import discriminate
    from oed.reports.pages.discrimination_report import save_discrimination_report
    from robots.common.files import ResultFolder

    with ResultFolder(out, force, names=["trajectory.csv", "design.json", "report.html"]) as folder:
        result = discriminate(
            robot,
            rivals,
            noise=noise,
            friction=friction,
            home=home,
            velocity_fraction=velocity_fraction,
            collision=collision,
            surroundings=surroundings,
            seed=seed,
            progress=progress,
        )
        result.save(folder.path("trajectory.csv").parent)
        save_discrimination_report(result, folder, png=png)
    data = result.to_dict()
    del data["segments"], data["quality"]
    return result.summary(), data
