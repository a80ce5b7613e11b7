"""One case drawn by the independent plant: its logs, its robot as described, and its truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from oed.benchmarks.making.strata import PAIRED_SIZE, Task
from oed.benchmarks.taxonomy import known_parameters
from oed.benchmarks.truth.cases import Case, Hidden, draw_case
from oed.benchmarks.truth.machines import Machine
from robots.common.arrays import Array
from robots.common.errors import InfeasibleError

OUTSIDE = "outside"
"""The name of a hidden effect that no name of the taxonomy fits."""


@dataclass(frozen=True, kw_only=True)
class DrawnCase:
    """A case, without signals that nobody needs.

    Attributes:
        machine: the robot; only its description is for the public.
        motion: kind of the motion: periodic or aperiodic.
        log: t, q, tau (N, 1 + 2 n) of the log [s, rad, N m].
        unseen: the same of the unseen motion, whose torque is held back.
        truth: what is hidden, as plain data for the sealed answers.
    """

    machine: Machine
    motion: str
    log: Array
    unseen: Array
    truth: dict[str, Any]


def draw(task: Task, *, size: float, noise: float, duration: float, unseen: float) -> DrawnCase:
    """Draws a case.

    Args:
        task: what to draw.
        size: visible size of a single effect, as a fraction of the joint's torque RMS.
        noise: RMS of the torque noise, as a fraction of each joint's torque RMS.
        duration: of the log [s].
        unseen: duration of the unseen motion [s].

    Raises:
        InfeasibleError: no robot shows an effect of that size.
    """
    # Further seeds for a case that no robot and no effect of its stratum can show.
    for retry in range(5):
        for effect in task.effects or (None,):
            for robot in task.robots:
                try:
                    case = draw_case(
                        _seed(task.seed, retry),
                        hide=[effect] if effect else 2 if task.stratum == "two" else 0,
                        size=size * (PAIRED_SIZE if task.stratum == "two" else 1.0),
                        kind=robot,
                        duration=duration,
                        unseen=unseen,
                        noise_level=noise,
                    )
                except Hidden:
                    continue
                if task.stratum != "two" or len(case.effects) == 2:
                    return _drawn(case, task.stratum, noise)
    raise InfeasibleError(
        f"no robot shows an effect of the stratum {task.stratum!r} at the size {size:g}",
        remedy="choose another size or a longer log",
    )


def _seed(seed: int, retry: int) -> int:
    return int(np.random.SeedSequence([seed, retry]).generate_state(1, np.uint64)[0] >> np.uint64(1))


def _drawn(case: Case, stratum: str, noise: float) -> DrawnCase:
    (log,), (unseen,) = case.logs, case.unseen
    shown = case.visible() if case.effects else []
    return DrawnCase(
        machine=case.machine,
        motion=log_kind(case),
        log=np.column_stack([log.t, log.q, log.tau]),
        unseen=np.column_stack([unseen.t, unseen.q, unseen.tau]),
        truth={
            "stratum": stratum,
            "effects": [
                {
                    "effect": OUTSIDE if effect.name == "unexplained" else effect.name,
                    "formula": type(effect).__name__,
                    "joint": effect.joint,
                    "amount": float(effect.amount),
                    "visible": float(share),
                    "parameters": known_parameters(effect.name, effect.truths()),
                }
                for effect, share in zip(case.effects, shown, strict=True)
            ],
            "noise": np.sqrt(((unseen.tau - unseen.clean) ** 2).mean(axis=0)).tolist(),
            "noise_level": noise,
        },
    )


def log_kind(case: Case) -> str:
    """Returns the kind of a case's motion."""
    return case.references[0].kind
