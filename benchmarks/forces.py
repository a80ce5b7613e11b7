"""Pushes of 10 N on a virtual robot: how many `oed force` detects, its false alarms, and the errors of the force.

Run ``python benchmarks/forces.py [SEEDS [OUT]]``, with ``--data FOLDER`` also on the measured log of a UR10. A run that
was stopped goes on where it was. Each seed draws an er3a whose masses, lengths and frictions differ from the
description by 10 %, with Stribeck friction that no fitted model has, friction that falls as the joints warm up, and 2 %
torque noise, half of it coloured. A model is identified from the first minute of a cold robot; its thermal models are
10 % wrong. The threshold comes from five other minutes. Then the robot makes another motion for ten minutes, with a
push of 0.2 s every eight seconds, in a random direction at the flange, and ten minutes without. The Jacobian of the
pushes is pinocchio's.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
import warnings
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

sys.path.insert(0, str(Path(__file__).parents[1]))

from estimation import identify, read_log
from estimation.external_forces import ForceEstimate, estimate_forces
from estimation.external_forces.force_estimation import Predictor
from estimation.models.model import Model
from estimation.predictions.prediction import predict
from estimation.thermal import ThermalTorqueModel, start_temperatures
from estimation.uncertainty.quantiles import NORMAL_95, count_interval, share_interval
from robots import Log, Motion, Robot, load_robot, nominal_plant, simulate
from robots.common.errors import AssumedValueWarning, OedError
from robots.plants import Plant, PlantEffect
from robots.plants.heat import plant_heat, reference_friction
from robots.thermal import ThermalModel

FORCE, LENGTH, EVERY = 10.0, 0.2, 8.0
IDENTIFIED, HEALTHY, TESTED, PAUSE = 60.0, 300.0, 600.0, 30.0
SPREAD, WRONG = 0.1, 0.1
# Stribeck torque over Coulomb friction, and share of the friction that is lost when the joints are warm.
STRIBECK, FALL = 0.1, 0.6
WITHIN = 0.2


def motion_of(robot: Robot, rng: np.random.Generator, start: float, duration: float) -> Motion:
    """Draws a motion of twelve sinusoids per joint that does not repeat; derivatives in closed form."""
    t = robot.period * np.arange(round(duration / robot.period))
    q, dq, ddq = np.zeros((3, len(t), robot.n))
    for j in range(robot.n):
        w, phase = 2 * np.pi * rng.uniform(0.03, 0.5, 12), rng.uniform(0, 2 * np.pi, 12)
        size = rng.normal(size=12) / w
        q[:, j] = np.sin(np.outer(t, w) + phase) @ size
        dq[:, j] = np.cos(np.outer(t, w) + phase) @ (size * w)
        ddq[:, j] = -np.sin(np.outer(t, w) + phase) @ (size * w**2)
    lower, upper = np.maximum(robot.limits.lower, -np.pi), np.minimum(robot.limits.upper, np.pi)
    scale = np.minimum(0.8 * (upper - lower) / np.ptp(q, axis=0), 0.6 * robot.limits.velocity / np.abs(dq).max(axis=0))
    middle = (lower + upper) / 2 - scale * (q.max(axis=0) + q.min(axis=0)) / 2
    return Motion(t + start, scale * q + middle, scale * dq, scale * ddq)


def plant_of(robot: Robot, seed: int) -> Plant:
    """Draws the true robot."""
    coulomb = np.asarray(robot.friction)[:, 0]
    effects = tuple(
        PlantEffect(effect="stribeck", joint=j + 1, coefficients=(STRIBECK * coulomb[j],), shape=(0.05, 1.0))
        for j in range(robot.n)
    )
    return nominal_plant(robot, spread=SPREAD, seed=seed, effects=effects)


def heated(plant: Plant, motion: Motion) -> Plant:
    """Adds heat by which each joint's friction falls by `FALL` in the long run, with the published time constants."""
    heat = plant_heat(plant.robot, known=True)
    power = np.mean(reference_friction(plant.model, plant.parameters, motion) * motion.dq, axis=0)
    models = []
    for model, own in zip(heat.models, power, strict=True):
        reached = model.temperatures([own], [1e7], start=[20.0, 20.0], ambient=20.0)[-1, 0] - 20.0
        # Friction falls as it heats: with the factor f the balance is f = 1 + slope f.
        slope = model.alpha * reached / model.friction_factor(20.0 + reached)
        wanted = -FALL / (1 - FALL)
        size = wanted / slope
        changed = {name: getattr(model, name) / size for name in ("K1", "K2", "C1", "C2")}
        models.append(replace(model, **changed))
    return replace(plant, heat=replace(heat, models=tuple(models)))


def flange_jacobians(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Evaluates the flange's linear Jacobian (N, 3, n) in the base frame by pinocchio."""
    model = pin.Model()
    parent = 0
    for joint in robot.chain.joints:
        place = pin.SE3(np.asarray(joint.rotation), np.asarray(joint.translation))
        axis = pin.JointModelRevoluteUnaligned(np.asarray(joint.axis))
        parent = model.addJoint(parent, axis, place, joint.name)
    tip = np.asarray(robot.chain.tip)
    place = pin.SE3(tip[:3, :3], tip[:3, 3])
    frame = model.addFrame(pin.Frame("flange", parent, 0, place, pin.FrameType.OP_FRAME))
    data = model.createData()
    return np.array([pin.computeFrameJacobian(model, data, x, frame, pin.LOCAL_WORLD_ALIGNED)[:3] for x in q])


def pushed(robot: Robot, log: Log, rng: np.random.Generator) -> tuple[Log, list[dict[str, Any]]]:
    """Adds pushes at the flange: the drives bear less torque by J' F."""
    tau, pushes = np.array(log.tau), []
    for begin in np.arange(log.t[0] + 4.0, log.t[-1] - 4.0, EVERY):
        at = float(begin + rng.uniform(0, EVERY / 2))
        direction = rng.normal(size=3)
        force = FORCE * direction / np.linalg.norm(direction)
        rows = np.flatnonzero((log.t >= at) & (log.t < at + LENGTH))
        tau[rows] -= np.einsum("tkn,k->tn", flange_jacobians(robot, log.q[rows]), force)
        pushes.append({"at": at, "force": force.tolist()})
    return replace(log, tau=tau), pushes


def thermal_of(model: Model, plant: Plant, log: Log, rng: np.random.Generator) -> ThermalTorqueModel:
    """Gives the identified model thermal models that are wrong, and hold friction at the temperature of its log."""
    assert plant.heat is not None
    models: list[ThermalModel | None] = []
    for true in plant.heat.models:
        names = ("alpha", "K1", "K2", "C1", "C2")
        factors = {name: getattr(true, name) * rng.uniform(1 - WRONG, 1 + WRONG) for name in names}
        models.append(None if true is None else replace(true, **factors))
    cold = ThermalTorqueModel(model=model, thermal=tuple(models))
    motion = predict(model, log).motion
    _, paths = cold.simulate(motion)
    warm = [path.temperatures[:, 0].mean() for path in paths if path is not None]
    return replace(cold, thermal=tuple(replace(m, reference=float(T)) for m, T in zip(models, warm, strict=True) if m))


def predictor_of(thermal: ThermalTorqueModel | None, before: list[Log]) -> Predictor:
    """Predicts with heat, from what the robot did before a log."""
    if thermal is None:
        return predict

    def run(model: Model, log: Log) -> Any:
        earlier = [own for own in before if own.t[-1] < log.t[0]]
        return predict(model, log, thermal=thermal, start=start_temperatures(thermal, earlier, float(log.t[0])))

    return run


def run_seed(seed: int) -> dict[str, Any]:
    """Runs one virtual robot."""
    started = time.process_time()
    robot, rng = load_robot("er3a"), np.random.default_rng([seed, 1])
    plant, logs, clock = plant_of(robot, seed), [], 0.0
    motions = []
    for duration in (IDENTIFIED, HEALTHY, TESTED, TESTED):
        motions.append(motion_of(robot, rng, clock, duration))
        clock += duration + PAUSE
    whole = Motion.concatenate(motions)
    plant = heated(plant, motions[0])
    warmth = plant.warmth(whole)
    for k, motion in enumerate(motions):
        logs.append(replace(simulate(plant, motion, seed=1000 * seed + k, warmth=warmth), name=f"part {k}"))
    first, healthy, test, free = logs
    factor = warmth.factor(whole.t[[0, -1]]) if warmth is not None else np.ones((2, robot.n))
    touched, pushes = pushed(robot, test, rng)
    model = identify(robot, first).model
    row: dict[str, Any] = {"seed": seed, "friction_left": float(np.mean(factor[1] / factor[0]))}
    for name, thermal in (("heat", thermal_of(model, plant, first, rng)), ("none", None)):
        predictor = predictor_of(thermal, [first, healthy, test])
        try:
            found = estimate_forces(model, touched, healthy=[healthy], predictor=predictor)
            alone = estimate_forces(model, free, calibration=found.calibration, predictor=predictor)
        except OedError as error:
            row[name] = {"refused": str(error), "pushes": [], "alarms": 0, "hours": 0.0}
            continue
        row[name] = judged(found, alone, pushes)
    return {**row, "seconds": time.process_time() - started}


def judged(found: ForceEstimate, alone: ForceEstimate, pushes: list[dict[str, Any]]) -> dict[str, Any]:
    """Compares contacts with the pushes."""
    rows, used = [], set()
    for push in pushes:
        at, force = push["at"], np.array(push["force"])
        hits = [k for k, c in enumerate(found.contacts) if c.start < at + LENGTH and c.end > at]
        used.update(hits)
        best = max((found.contacts[k] for k in hits), key=lambda c: c.peak, default=None)
        rows.append(
            {
                "at": at,
                "detected": best is not None,
                "delay": None if best is None else best.detected - at,
                "magnitude": None if best is None else best.magnitude,
                "deviation": None if best is None else best.magnitude_deviation,
                "error": None if best is None else float(np.linalg.norm(best.force - force)),
                "tool": None if best is None else best.place.tool,
            }
        )
    return {
        "pushes": rows,
        "alarms": len(found.contacts) - len(used) + len(alone.contacts),
        "alarms_without_pushes": len(alone.contacts),
        "hours": (found.duration + alone.duration - len(pushes) * LENGTH) / 3600.0,
        "threshold": found.calibration.threshold.value,
        "peaks": found.calibration.threshold.peaks,
    }


def table(rows: list[dict[str, Any]]) -> str:
    """Says detections, false alarms and errors with and without thermal models."""
    lines = []
    for name, words in (("heat", "thermal models 10 % wrong"), ("none", "no thermal model")):
        pushes = [push for row in rows for push in row[name]["pushes"]]
        hits = [push for push in pushes if push["detected"]]
        close = sum(abs(push["magnitude"] - FORCE) <= WITHIN * FORCE for push in hits)
        inside = sum(abs(push["magnitude"] - FORCE) <= NORMAL_95 * push["deviation"] for push in hits)
        tool = sum(bool(push["tool"]) for push in hits)
        alarms, hours = sum(row[name]["alarms"] for row in rows), sum(row[name]["hours"] for row in rows)
        low, high = (end / hours for end in count_interval(alarms))
        refused = sum("refused" in row[name] for row in rows)
        lines += [
            f"{words}: {len(rows)} robots, {refused} of them refused, {len(pushes)} pushes of {FORCE:g} N for "
            f"{LENGTH:g} s",
            f"  detected {len(hits)} ({_share(len(hits), len(pushes))})",
            f"  false alarms {alarms} in {hours:.2f} h: {alarms / hours:.2f} per hour ({low:.2f} to {high:.2f})",
        ]
        if hits:
            errors = np.array([push["error"] for push in hits])
            delay = np.median([push["delay"] for push in hits])
            lines += [
                f"  magnitude within 20 %: {close} ({_share(close, len(hits))})",
                f"  magnitude within its own 95 % interval: {inside} ({_share(inside, len(hits))})",
                f"  error of the force vector: median {np.median(errors):.2f} N, 95 % below "
                f"{np.quantile(errors, 0.95):.2f} N",
                f"  a force at the tool is accepted: {tool} ({_share(tool, len(hits))})",
                f"  median delay {1e3 * delay:.0f} ms",
            ]
    left = np.mean([row["friction_left"] for row in rows])
    return "\n".join([*lines, f"friction at the end over that at the start: {left:.2f}"])


def _share(count: int, total: int) -> str:
    """Share in per cent with its exact 95 % interval (Clopper and Pearson)."""
    low, high = share_interval(count, total)
    return f"{100 * count / total:.1f} %, {100 * low:.1f} to {100 * high:.1f} %"


def measured(folder: Path) -> str:
    """Counts contacts on the UR10's log, each half and third by models of the other parts: it was never touched."""
    robot = load_robot(folder / "ur10_unisa" / "ur10_robot.urdf", unlimited=True)
    log = read_log(folder / "ur10_unisa" / "exciting.parquet", n=robot.n)
    lines = ["UR10, no contact in the log: contacts found, largest statistic over the threshold"]
    for parts in (2, 3):
        edges = np.linspace(0, len(log), parts + 1).astype(int)
        pieces = [log.rows(slice(a, b)) for a, b in pairwise(edges.tolist())]
        models = [identify(robot, piece).model for piece in pieces]
        for i, model in enumerate(models):
            for k, piece in enumerate(pieces):
                if k == i:
                    continue
                for words, healthy in (("the log itself", []), ("the fitted log", [pieces[i]])):
                    found = estimate_forces(model, piece, healthy=healthy)
                    lines.append(
                        f"  part {i + 1} of {parts} fitted, part {k + 1} seen, threshold by {words}: "
                        f"{len(found.contacts)}, {found.statistic.max():.2f}"
                    )
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seeds", nargs="?", type=int, default=8)
    parser.add_argument("out", nargs="?", type=Path, default=Path("forces.jsonl"), help="rows; continued if there")
    parser.add_argument("--data", type=Path, help="folder of the measured logs")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    options = parser.parse_args()
    warnings.simplefilter("ignore", AssumedValueWarning)
    if options.data is not None:
        print(measured(options.data))
    rows = [json.loads(line) for line in options.out.read_text().splitlines()] if options.out.exists() else []
    known = {row["seed"] for row in rows}
    for seed in range(options.first, options.first + options.seeds):
        if seed not in known:
            rows.append(run_seed(seed))
            with options.out.open("a") as stream:
                stream.write(json.dumps(rows[-1]) + "\n")
    if rows:
        print(table(rows))


if __name__ == "__main__":
    main()
