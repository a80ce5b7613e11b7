"""Plays a campaign on the virtual robot, cycle by cycle, on one clock."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from os import PathLike

import numpy as np

from estimation.logs import write_log
from oed.campaigns.result import Campaign
from robots.common.errors import InputError
from robots.common.files import ResultFolder
from robots.common.progress import SILENT, Progress
from robots.plants import Plant, nominal_plant, simulate
from robots.plants.heat import Warmth, heat_piece, reference_friction
from robots.signals import Log, Motion


def play(campaign: Campaign, plant: Plant | None = None, seed: int = 0) -> Iterator[Log]:
    """Plays a campaign; only one cycle is in memory at a time.

    Args:
        campaign: what to play.
        plant: the virtual robot; by default that of the robot's own description.
        seed: of the noise, which differs from cycle to cycle.

    Yields:
        A log for each cycle in which something is played: t on the campaign's clock, q, tau, cycle, and segment,
        which is the number of the stage in `Campaign.stages`, counted from 1. Of a plant with heat also temperatures;
        its joints go on warming up and cooling down from cycle to cycle.

    Raises:
        InputError: a plant of another robot.
    """
    virtual = plant or nominal_plant(campaign.robot)
    if virtual.robot.n != campaign.robot.n:
        raise InputError(f"the plant has {virtual.robot.n} joints", allowed=f"{campaign.robot.n}, as in the campaign")
    numbers = {stage.name: number for number, stage in enumerate(campaign.stages, start=1)}
    stages = campaign.stages_by_name
    warmth = _warmth(campaign, virtual)
    for cycle, slots in groupby(campaign.slots, key=lambda slot: slot.cycle):
        played = [(slot, stages[slot.stage]) for slot in slots if slot.stage is not None]
        if not played:
            continue
        motion = Motion(
            t=np.concatenate([slot.start + stage.motion.t for slot, stage in played]),
            q=np.concatenate([stage.motion.q for _, stage in played]),
            dq=np.concatenate([stage.motion.dq for _, stage in played]),
            ddq=np.concatenate([stage.motion.ddq for _, stage in played]),
        )
        noise = int(np.random.SeedSequence([seed, cycle]).generate_state(1)[0])
        log = simulate(virtual, motion, seed=noise, warmth=warmth)
        first = played[0][0]
        yield Log(
            t=log.t,
            q=log.q,
            tau=log.tau,
            temperature=log.temperature,
            ambient=log.ambient,
            segment=np.concatenate([np.full(len(stage.motion), float(numbers[stage.name])) for _, stage in played]),
            cycle=np.full(len(log), float(cycle)),
            name=f"cycle {cycle}",
            metadata={
                **log.metadata,
                "robot": campaign.robot.name,
                "phase": first.phase,
                "run": first.run,
                "duty": first.duty,
                "stages": {str(numbers[stage.name]): stage.name for _, stage in played},
            },
        )


def _warmth(campaign: Campaign, plant: Plant) -> Warmth | None:
    """Follows the joints of a plant with heat through the whole timetable, rests too."""
    if plant.heat is None:
        return None
    pieces = {
        name: heat_piece(stage.motion, reference_friction(plant.model, plant.parameters, stage.motion))
        for name, stage in campaign.stages_by_name.items()
    }
    played = [slot for slot in campaign.slots if slot.stage is not None]
    return plant.heat.follow([pieces[slot.stage].shifted(slot.start) for slot in played if slot.stage is not None])


def record(
    campaign: Campaign,
    folder: str | PathLike[str],
    *,
    plant: Plant | None = None,
    seed: int = 0,
    force: bool = False,
    progress: Progress | None = None,
) -> tuple[str, ...]:
    """Plays a campaign and writes a Parquet log for each cycle, all or none.

    Args:
        campaign: what to play.
        folder: where the logs go, as ``cycle_001.parquet`` and so on.
        plant: the virtual robot; by default that of the robot's own description.
        seed: of the noise.
        force: whether existing logs may be replaced.
        progress: receives the progress.

    Returns:
        The names of the files.

    Raises:
        InputError: existing files without force, a folder that cannot be written to, or a plant of another robot.
    """
    cycles = sorted({slot.cycle for slot in campaign.slots if slot.stage is not None})
    names = tuple(f"cycle_{cycle:03d}.parquet" for cycle in cycles)
    listener = progress or SILENT
    with ResultFolder(folder, force, names=names) as out:
        listener.start(f"playing on a virtual {campaign.robot.name}", len(names))
        try:
            for done, (name, log) in enumerate(zip(names, play(campaign, plant, seed), strict=True), start=1):
                write_log(out.path(name), log, kinds=campaign.robot.chain.kinds)
                listener.update(done, name)
        finally:
            listener.finish()
    return names
