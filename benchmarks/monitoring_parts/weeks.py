"""What happens in a week of the monitoring study, and how well a finding states its size."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.monitoring_parts.virtual_robot import DAY, Cause
from estimation.monitoring import Finding


def draw_causes(rng: np.random.Generator, begin: float, n: int, cycle: float) -> tuple[str, float, list[Cause]]:
    """Draws a cause, or two, or none, and their moment.

    Args:
        rng: random numbers.
        begin: of the week [s].
        n: number of joints.
        cycle: length of a cycle [s]; six of them are a day's work.

    Returns:
        The names of the kinds with a plus between them, the moment [s], and the causes.
    """
    kinds = (
        ("nothing", 0.2),
        ("damage", 0.25),
        ("payload", 0.15),
        ("contact", 0.15),
        ("damage+payload", 0.1),
        ("damage+contact", 0.05),
        ("damage+damage", 0.1),
    )
    kind = str(rng.choice([name for name, _ in kinds], p=[share for _, share in kinds]))
    # From the second day on, anywhere in a cycle; a contact within a log, for it is not seen elsewhere.
    day, place = int(rng.integers(1, 4)), int(rng.integers(0, 6))
    offset = float(rng.uniform(0.0, cycle if "contact" not in kind else 45.0)) + (10.0 if "contact" in kind else 0.0)
    moment = begin + day * DAY + place * cycle + offset
    joints = rng.permutation(n)[:2] + 1
    causes: list[Cause] = []
    for part in kind.split("+"):
        if part == "damage":
            joint = int(joints[sum(cause.kind == "damage" for cause in causes)])
            causes.append(Cause(kind=part, time=moment, joint=joint, amount=float(rng.uniform(0.1, 0.4))))
        elif part == "payload":
            centre = (float(rng.uniform(-0.05, 0.05)), float(rng.uniform(-0.05, 0.05)), float(rng.uniform(0.05, 0.15)))
            causes.append(Cause(kind=part, time=moment, amount=float(rng.uniform(0.5, 2.5)), centre=centre))
        elif part == "contact":
            direction = rng.normal(size=3)
            direction /= np.linalg.norm(direction)
            causes.append(
                Cause(
                    kind=part,
                    time=moment,
                    amount=float(rng.uniform(30.0, 80.0)),
                    seconds=float(rng.uniform(0.3, 1.0)),
                    direction=tuple(direction.tolist()),
                )
            )
    return kind, moment, causes


def size_of(f: Finding, causes: Sequence[Cause]) -> list[float] | None:
    """Found and true size with the interval, of a finding with a cause."""
    for cause in causes:
        if f.kind == cause.kind == "damage" and f.joint == cause.joint:
            return [f.size, 100 * cause.amount, f.low, f.high]
        if f.kind == cause.kind == "payload":
            return [f.size, cause.amount, f.low, f.high]
    return None
