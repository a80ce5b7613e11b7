"""Random cases: a robot, its motions, and effects hidden in its logs with a given visible size.

The visible size of an effect is the RMS of its torque that the base model cannot fit, over the joint's torque RMS.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from oed.benchmarks.truth.dynamics import Projection, base_regressor
from oed.benchmarks.truth.effects import KNOWN, UNLISTED, Effect
from oed.benchmarks.truth.kinds import KINDS
from oed.benchmarks.truth.machines import Machine, draw_machine
from oed.benchmarks.truth.noise import Noise, draw_noise
from oed.benchmarks.truth.plant import Record, open_loop, parts_links, play, projection_of
from oed.benchmarks.truth.references import Reference, draw_aperiodic, draw_moves, draw_periodic

SEARCH_STEP = 0.008  # sample period [s] of the open-loop rides in the search for an effect's amount
PROJECTION_STRIDE = 2  # step between the rows that projections use
MOTION = ("q_true", "v_true", "a_true", "sign")


class Hidden(Exception):
    """Raised if an effect cannot reach the wanted visible size with plausible values."""


@dataclass(frozen=True, kw_only=True)
class Case:
    """One case: the robot, its true effects, and its logs.

    ``training`` is the number of logs to diagnose, and ``size`` the visible size that was asked for.
    """

    seed: int
    machine: Machine
    noise: Noise
    references: tuple[Reference, ...]
    training: int
    effects: tuple[Effect, ...]
    size: float
    records: tuple[Record, ...]

    @property
    def logs(self) -> tuple[Record, ...]:
        """The logs to diagnose."""
        return self.records[: self.training]

    @property
    def unseen(self) -> tuple[Record, ...]:
        """Held-out logs of other motions."""
        return self.records[self.training :]

    def visible(self) -> list[float]:
        """Computes the visible size of each effect in the logs to diagnose, on the joint where it is largest."""
        level = self.level()
        stack = [np.concatenate([getattr(r, key)[::PROJECTION_STRIDE] for r in self.logs]) for key in MOTION]
        projection = Projection(base_regressor(self.machine.known, *stack), level)
        parts = [np.concatenate([r.parts[k][::PROJECTION_STRIDE] for r in self.logs]) for k in range(len(self.effects))]
        return [float(projection.visible(part).max()) for part in parts]

    def level(self) -> np.ndarray:
        """Computes each joint's torque RMS without noise (n,) [N m]."""
        return np.sqrt(np.concatenate([r.clean for r in self.logs]).__pow__(2).mean(axis=0))


def draw_case(
    seed: int,
    *,
    hide: Sequence[type[Effect]] | int | str = 0,
    size: float = 0.01,
    kind: str | None = None,
    joint: int | None = None,
    periodic: bool | None = None,
    duration: float = 60.0,
    unseen: float = 30.0,
    noise_level: float = 0.025,
    noise_memory: tuple[float, float] = (0.7, 0.95),
    stream: int = 0,
    moves: bool = False,
) -> Case:
    """Draws a case.

    Args:
        seed: seed of all random numbers.
        hide: classes of effects to hide, or the number of catalogue effects to draw, or "stranger" for one effect
            outside the catalogue.
        size: visible size of each effect, as a fraction of its joint's torque RMS.
        kind: name of the robot; drawn if None.
        joint: joint of the (first) effect, from 1; drawn if None.
        periodic: whether the motion is periodic; drawn if None.
        duration: length of the log to diagnose [s].
        unseen: length of the held-out log of another motion [s]; 0 for none.
        noise_level: torque noise, as a fraction of the torque RMS.
        noise_memory: range of the correlation between consecutive samples of the coloured half of the noise.
        stream: number of the case among those of the same seed.
        moves: whether the motion consists of moves with pauses between them.

    Returns:
        The case.

    Raises:
        Hidden: an effect cannot reach the size, or the position loop is unstable with it.
    """
    rng = np.random.default_rng([seed, stream] if stream else seed)
    machine = draw_machine(kind or KINDS[int(rng.integers(len(KINDS)))], rng)
    periodic = bool(rng.random() < 0.5) if periodic is None else periodic
    references = [_reference(machine, rng, periodic, length, moves) for length in (duration, unseen) if length > 0]
    base = open_loop(machine, references[:1], [], step=SEARCH_STEP)
    level = np.sqrt((base.base_torque() ** 2).mean(axis=0))
    projection = projection_of(base, level)

    def sized(choice: type[Effect], where: int | None, tries: int) -> Effect | None:
        for _ in range(tries):
            joints = choice.joints(machine)
            place = where if where is not None else joints[int(rng.integers(len(joints)))]
            drawn = choice.draw(machine, rng, place, duration)
            amount = _amount(machine, references[:1], drawn, size, level, projection)
            if amount is not None:
                return drawn.of(amount)
        return None

    effects: list[Effect] = []
    if isinstance(hide, (int, str)):
        pool = UNLISTED if hide == "stranger" else KNOWN
        for _ in range(60):
            if len(effects) == (1 if hide == "stranger" else hide):
                break
            found = sized(pool[int(rng.integers(len(pool)))], joint, 1)
            if found is not None and all((e.name, e.joint) != (found.name, found.joint) for e in effects):
                effects.append(found)
    else:
        for choice in hide:
            found = sized(choice, joint if not effects else None, 12)
            if found is None:
                raise Hidden(f"{choice.__name__} cannot reach {size}")
            effects.append(found)
    noise = draw_noise(machine.n, machine.gear, rng, level=noise_level, memory=noise_memory)
    # Largest number of closed-loop corrections.
    for _ in range(5):
        case = Case(
            seed=seed,
            machine=machine,
            noise=noise,
            references=tuple(references),
            training=1,
            effects=tuple(effects),
            size=size,
            records=tuple(play(machine, references, effects, noise, np.random.default_rng([seed, 1]))),
        )
        if any(_runs_away(machine, record) for record in case.records):
            raise Hidden("the loop runs away from its reference")
        # The closed loop accelerates more than its reference, so some effects show more than in open loop.
        shares = case.visible()
        if any(share <= 0 for share in shares):
            raise Hidden("nothing of it shows once the loop is closed")
        ratios = [size / share for share in shares]
        # Relative error of the visible size that is accepted in the closed loop.
        if all(abs(ratio - 1) < 0.1 for ratio in ratios):
            return case
        effects = [
            effect.of(float(np.clip(effect.amount * ratio ** (1 / effect.power), effect.smallest, effect.largest)))
            for effect, ratio in zip(effects, ratios, strict=True)
        ]
    # A case whose wanted size is 1.4 times the visible one is refused.
    if max(ratios) > 1.4:
        raise Hidden(f"{effects[int(np.argmax(ratios))].name} shows {size / max(ratios):.2g} at most")
    return case


def _runs_away(machine: Machine, record: Record) -> bool:
    """Returns whether a joint leaves its range by more than a quarter of it, because the position loop is unstable."""
    reach = 0.25 * (machine.upper - machine.lower)
    return bool(np.any((record.q < machine.lower - reach) | (record.q > machine.upper + reach)))


def write_log(record: Record, path: Path) -> None:
    """Writes t, q and tau as CSV, which is all that a user has."""
    n = record.q.shape[1]
    header = ",".join(["t", *(f"q{j + 1}" for j in range(n)), *(f"tau{j + 1}" for j in range(n))])
    table = np.column_stack([record.t, record.q, record.tau])
    np.savetxt(path, table, delimiter=",", header=header, comments="", fmt="%.9g")


def _reference(machine: Machine, rng: np.random.Generator, periodic: bool, duration: float, moves: bool) -> Reference:
    if moves:
        return draw_moves(machine, rng, duration=duration)
    if not periodic:
        return draw_aperiodic(machine, rng, duration=duration)
    period = 10.0 if duration >= 20.0 else duration / 2
    return draw_periodic(machine, rng, period=period, cycles=max(round(duration / period), 1))


def _amount(
    machine: Machine,
    references: Sequence[Reference],
    effect: Effect,
    size: float,
    level: np.ndarray,
    projection: Projection,
) -> float | None:
    """Finds the amount with the wanted visible size by the secant method in logarithms; None if none is plausible."""
    row = level[effect.joint - 1] if effect.joint else level.max()
    amount = 0.02 * row if np.isinf(effect.largest) else 0.01 * effect.largest
    tried: list[tuple[float, float]] = []
    # Largest number of steps of the search for an effect's amount, ...
    for _ in range(12):
        ride = open_loop(machine, references, [effect.of(amount)], step=SEARCH_STEP)
        shown = projection.visible(ride.parts[0])
        share = float(shown.max())
        # ... which ends at this relative error of the visible size.
        if abs(share / size - 1) < 0.02:
            return amount
        if share <= 0 or (share < size and amount >= effect.largest):
            # The closed loop accelerates more, so an elastic or loose gear shows more there.
            return amount if parts_links(effect) and share > size / 5 else None
        tried.append((np.log(amount), np.log(share)))
        power = effect.power
        for (x0, y0), (x1, y1) in pairwise(tried[-2:]):
            power = float(np.clip((y1 - y0) / (x1 - x0), 0.3, 3.0)) if x1 != x0 else power
        if share > size and amount <= effect.smallest:
            return None
        step = float(np.clip((size / share) ** (1 / power), 0.02, 50.0))
        amount = float(np.clip(amount * step, effect.smallest, effect.largest))
    return None
