"""Payloads on virtual robots: errors of mass and centre of mass, and how often the 95 % intervals hold the truth.

Run it with ``python benchmarks/payloads.py [SEEDS [WORKERS [OUT]]]``. The robots are those of `oed/benchmarks/truth`:
pinocchio models under position control, with 2.5 % coloured torque noise and quantised encoders. Their friction has a
Stribeck part, which no fitted model has. Each case has 60 s without payload, 60 s of the same path with it (way a: the
difference of the logs), and 60 s of another path with it (way b: a model of the log without payload). A body is a
random box; its centre lies up to 0.15 m in front of the flange.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import pinocchio as pin

sys.path.insert(0, str(Path(__file__).parents[1]))

from estimation import identify
from estimation.payloads import PayloadEstimate, identify_payload
from oed.benchmarks.truth.description import write_description
from oed.benchmarks.truth.dynamics import with_tool
from oed.benchmarks.truth.effects import Effect
from oed.benchmarks.truth.effects.friction import Stribeck
from oed.benchmarks.truth.machines import Machine, draw_machine
from oed.benchmarks.truth.noise import draw_noise
from oed.benchmarks.truth.plant import Record, play
from oed.benchmarks.truth.references import draw_aperiodic, draw_periodic
from robots import load_robot
from robots.common.errors import AssumedValueWarning, OedError
from robots.common.parallel import parallel_map
from robots.signals import Log

SEEDS = 20
KINDS = ("ur10", "panda")
MASSES = (0.5, 1.0, 3.0)
DURATION = 60.0
# Stribeck torque over Coulomb torque.
STRIBECK = (0.02, 0.15)
# What counts as good: within these, or the interval holds the truth.
MASS_SHARE, CENTRE = 0.03, 0.005


@dataclass(frozen=True)
class Outcome:
    """One payload, identified one way."""

    kind: str
    seed: int
    mass: float
    way: str
    error: tuple[float, ...]
    half: tuple[float, ...]
    held: tuple[bool, ...]
    method: str
    warnings: tuple[str, ...]
    problem: str = ""


def draw_tool(mass: float, rng: np.random.Generator) -> pin.Inertia:
    """Draws a box of usual density, its centre anywhere in front of the flange."""
    sides = rng.uniform(0.5, 2.0, 3)
    sides *= (mass / rng.uniform(300.0, 2000.0) / np.prod(sides)) ** (1 / 3)
    second = mass * sides**2 / 12
    turn = pin.SE3.Random().rotation if rng.random() < 0.5 else np.eye(3)
    inertia = turn @ np.diag(second.sum() - second) @ turn.T
    centre = np.array([*rng.uniform(-0.06, 0.06, 2), rng.uniform(0.02, 0.15)])
    return pin.Inertia(mass, centre, inertia)


def at_flange(tool: pin.Inertia, tip: np.ndarray) -> pin.Inertia:
    """Moves a body from the flange's frame to that of the last link."""
    return pin.SE3(tip[:3, :3], tip[:3, 3]).act(tool)


def friction_beyond(machine: Machine, rng: np.random.Generator) -> list[Effect]:
    """Draws a Stribeck torque for each joint."""
    effects = []
    for joint in range(1, machine.n + 1):
        drawn = Stribeck.draw(machine, rng, joint, DURATION)
        effects.append(drawn.of(float(machine.friction[joint - 1, 0] * rng.uniform(*STRIBECK))))
    return effects


def run(case: tuple[str, int]) -> list[Outcome]:
    """Plays and identifies all payloads of one robot."""
    warnings.simplefilter("ignore", AssumedValueWarning)
    kind, seed = case
    rng = np.random.default_rng([seed, KINDS.index(kind)])
    pin.seed(seed)
    machine = draw_machine(kind, rng)
    effects, noise = friction_beyond(machine, rng), draw_noise(machine.n, machine.gear, rng)
    draw = draw_periodic if rng.random() < 0.5 else draw_aperiodic
    path, other = draw(machine, rng), draw(machine, rng)
    with tempfile.TemporaryDirectory() as folder:
        robot = load_robot(write_description(machine, Path(folder)))
    free = log_of(play(machine, [path], effects, noise, rng)[0])
    estimate = identify(robot, free)
    outcomes = []
    for mass in MASSES:
        tool = draw_tool(mass, rng)
        carrying = replace(machine, model=with_tool(machine.model, at_flange(tool, robot.chain.tip)))
        same, new = (log_of(play(carrying, [motion], effects, noise, rng)[0]) for motion in (path, other))
        for way, log, options in (
            ("difference", same, {"robot": robot, "without": free, "model": estimate}),
            ("model", new, {"model": estimate.model}),
        ):
            try:
                outcomes.append(judge(kind, seed, mass, way, tool, identify_payload(log, **options)))
            except OedError as error:
                outcomes.append(Outcome(kind, seed, mass, way, (), (), (), "", (), str(error)))
    return outcomes


def log_of(record: Record) -> Log:
    """Gives what a user has."""
    return Log(t=record.t, q=record.q, tau=record.tau)


def judge(kind: str, seed: int, mass: float, way: str, tool: pin.Inertia, found: PayloadEstimate) -> Outcome:
    """Compares a result with the truth: mass, centre, and inertia about the centre."""
    truth = np.array([tool.mass, *tool.lever, *tool.inertia[np.triu_indices(3)]])
    items = found.quantities
    return Outcome(
        kind,
        seed,
        mass,
        way,
        tuple(float(item.value - value) for item, value in zip(items, truth, strict=True)),
        tuple(float(item.half_width) for item in items),
        tuple(bool(item.lower <= value <= item.upper) for item, value in zip(items, truth, strict=True)),
        found.method,
        found.warnings,
    )


def main(words: Sequence[str]) -> None:
    """Runs all cases and prints the table."""
    seeds = int(words[0]) if words else SEEDS
    workers = int(words[1]) if len(words) > 1 else None
    start = time.perf_counter()
    cases = [(kind, seed) for seed in range(seeds) for kind in KINDS]
    outcomes = [one for some in parallel_map(run, cases, workers=workers) for one in some]
    if len(words) > 2:
        Path(words[2]).write_text("\n".join(json.dumps(asdict(one)) for one in outcomes) + "\n")
    print(table(outcomes))
    print(f"{len(outcomes)} payloads, {time.perf_counter() - start:.0f} s")


def table(outcomes: Iterable[Outcome]) -> str:
    """Lists median errors, the share within these bounds or intervals, and the coverage."""
    everything = list(outcomes)
    head = "| robot | way | mass | error of mass, median (worst) | error of centre, median (worst) "
    head += "| half-width: mass, centre | good | coverage: mass and centre | inertia |"
    lines = [head, "|---|---|---|---|---|---|---|---|---|"]
    groups = [(kind, way, mass) for kind in KINDS for way in ("difference", "model") for mass in MASSES]
    for kind, way, mass in [*groups, ("", "difference", 0.0), ("", "model", 0.0), ("", "", 0.0)]:
        chosen = [
            one
            for one in everything
            if not one.problem and one.kind.startswith(kind) and one.way.startswith(way) and mass in (0.0, one.mass)
        ]
        if not chosen:
            continue
        share = 100 * np.array([abs(one.error[0]) / one.mass for one in chosen])
        centre = 1000 * np.array([np.abs(one.error[1:4]).max() for one in chosen])
        widths = np.array([(100 * one.half[0] / one.mass, 1000 * max(one.half[1:4])) for one in chosen])
        held = np.array([one.held for one in chosen])
        errors = np.array([one.error[:4] for one in chosen])
        bounds = np.array([[MASS_SHARE * one.mass, CENTRE, CENTRE, CENTRE] for one in chosen])
        good = ((np.abs(errors) <= bounds) | held[:, :4]).all(axis=1)
        name = [kind or "all", way or "both", f"{mass:g} kg" if mass else "all"]
        lines.append(
            f"| {' | '.join(name)} | {np.median(share):.2f} % ({share.max():.2f} %) "
            f"| {np.median(centre):.2f} mm ({centre.max():.2f} mm) "
            f"| {np.median(widths[:, 0]):.2f} %, {np.median(widths[:, 1]):.2f} mm | {good.sum()} of {len(good)} "
            f"| {100 * held[:, :4].mean():.1f} % | {100 * held[:, 4:].mean():.1f} % |"
        )
    for one in everything:
        if one.problem or one.warnings or (one.way == "difference" and one.method != "difference"):
            lines.append(
                f"{one.kind} seed {one.seed}, {one.mass:g} kg, {one.way}: {one.problem or one.warnings or one.method}"
            )
    return "\n".join(lines)


if __name__ == "__main__":
    main(sys.argv[1:])
