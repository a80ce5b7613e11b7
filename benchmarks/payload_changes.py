"""How well the diagnosis sizes a payload that was picked up or put down, beside another effect.

Run it with ``python benchmarks/payload_changes.py --seeds 2``. Cases are drawn by ``oed/benchmarks/truth``: virtual
er3a, ur10 and panda, 60 s of motion with 2.5 % of coloured noise, a description whose masses, centres of mass and
second moments are up to 20 % off, and one other effect of 2 %. At some time a payload of .2, .5, 1 or 3 kg is picked
up or put down. The script prints how often the sign is right, how often the 95 % intervals of mass and first moments
hold the truth, and how many stated bodies are physical. Rows go to a JSON-lines file; a run that was stopped goes on
where it was.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import warnings
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402
import pinocchio as pin  # noqa: E402

from benchmarks.diagnosis_parts.running import described, logs_of  # noqa: E402
from estimation import diagnose  # noqa: E402
from oed.benchmarks.truth.cases import Case, Hidden, draw_case  # noqa: E402
from oed.benchmarks.truth.dynamics import with_tool  # noqa: E402
from oed.benchmarks.truth.effects import KNOWN  # noqa: E402
from oed.benchmarks.truth.effects.surroundings import Payload  # noqa: E402
from oed.benchmarks.truth.machines import perturbed  # noqa: E402
from oed.benchmarks.truth.plant import play  # noqa: E402
from oed.benchmarks.truth.ride import Ride  # noqa: E402
from robots.common.errors import AssumedValueWarning, OedError  # noqa: E402

ROBOTS = ("er3a", "ur10", "panda")
MASSES = (0.2, 0.5, 1.0, 3.0)
DESCRIPTION_ERROR = 0.2
DURATION, OTHER_SIZE = 60.0, 0.02


@dataclass(frozen=True, kw_only=True)
class PutDown(Payload):
    """A payload that the robot carries from the start and puts down at one time."""

    def torque(self, ride: Ride) -> np.ndarray:
        """Computes the torque (N, n) that is missing from that time on [N m]."""
        return -super().torque(ride)


def draw(robot: str, mass: float, seed: int) -> Case:
    """Draws a case: odd seeds put the payload down."""
    pool = [effect for effect in KNOWN if effect is not Payload]
    for attempt in range(20):
        rng = np.random.default_rng([seed, ROBOTS.index(robot), MASSES.index(mass), attempt])
        other = pool[int(rng.integers(len(pool)))]
        try:
            case = draw_case(int(rng.integers(2**31)), hide=[other], size=OTHER_SIZE, kind=robot, unseen=0.0)
        except Hidden:
            continue
        kind = PutDown if seed % 2 else Payload
        payload = kind.draw(case.machine, rng, None, DURATION).of(mass)
        machine = case.machine
        if seed % 2:
            body = pin.Inertia.FromBox(mass, *payload.size)
            body.lever = np.array(payload.centre)
            machine = replace(machine, model=with_tool(machine.model, body))
        machine = replace(machine, known=perturbed(machine.known, rng, DESCRIPTION_ERROR))
        effects = (payload, *case.effects)
        records = play(machine, case.references, effects, case.noise, np.random.default_rng([seed, 1]))
        return replace(case, machine=machine, effects=effects, records=tuple(records))
    raise Hidden(f"no effect reaches {OTHER_SIZE} on {robot}")


def run(robot: str, mass: float, seed: int) -> dict[str, Any]:
    """Diagnoses one case and compares the stated payload with the true one."""
    case = draw(robot, mass, seed)
    payload = case.effects[0]
    assert isinstance(payload, Payload)
    sign = -1.0 if isinstance(payload, PutDown) else 1.0
    truth = {"mass_change": sign * mass}
    truth |= {f"moment_change_{a}": sign * mass * c for a, c in zip("xyz", payload.centre, strict=True)}
    row: dict[str, Any] = {"robot": robot, "mass": mass, "seed": seed, "truth": truth, "time": payload.moment}
    row["other"] = [(effect.name, effect.joint) for effect in case.effects[1:]]
    with described(case) as known:
        try:
            diagnosis = diagnose(known, logs_of(case.logs))
        except OedError as error:
            return {**row, "status": "refused", "error": str(error)}
    row["found"] = [(finding.effect, finding.joint) for finding in diagnosis.findings]
    row["status"] = "missed"
    for finding in diagnosis.findings:
        if finding.effect == "payload_change":
            row["status"] = "found"
            row["parameters"] = {p.name: (p.value, *p.ci95) for p in finding.parameters}
    return row


def physical(parameters: dict[str, tuple[float, float, float]]) -> bool:
    """Whether the stated change is a body that could be picked up, or put down: a semidefinite pseudo-inertia."""
    value = {name: entry[0] for name, entry in parameters.items()}
    sign = np.sign(value["mass_change"])
    moments = np.array([value[f"moment_change_{axis}"] for axis in "xyz"])
    inertia = np.zeros((3, 3))
    for name, (a, b) in {"x": (0, 0), "y": (1, 1), "z": (2, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}.items():
        inertia[a, b] = inertia[b, a] = value.get(f"inertia_change_{name}", 0.0)
    pseudo = np.empty((4, 4))
    pseudo[:3, :3] = np.trace(inertia) / 2 * np.eye(3) - inertia
    pseudo[:3, 3] = pseudo[3, :3] = moments
    pseudo[3, 3] = value["mass_change"]
    eigenvalues = np.linalg.eigvalsh(sign * pseudo)
    return bool(eigenvalues[0] >= -1e-9 * eigenvalues[-1])


def holds(entry: tuple[float, float, float], true: float) -> bool:
    """Whether an interval (value, lower, upper) holds the truth; an infinite one does."""
    return entry[1] <= true <= entry[2]


def show(rows: list[dict[str, Any]]) -> None:
    """Prints the table."""
    print("robot | payload [kg] | cases | found | sign right | mass held | moments held | physical | median error")
    for robot in ROBOTS:
        for mass in MASSES:
            own = [row for row in rows if row["robot"] == robot and row["mass"] == mass]
            found = [row for row in own if row["status"] == "found"]
            if not own:
                continue
            sign = sum(row["parameters"]["mass_change"][0] * row["truth"]["mass_change"] > 0 for row in found)
            held = [[holds(row["parameters"][name], true) for name, true in row["truth"].items()] for row in found]
            bodies = sum(physical(row["parameters"]) for row in found)
            errors = [abs(row["parameters"]["mass_change"][0] / row["truth"]["mass_change"] - 1) for row in found]
            print(
                f"{robot} | {mass:g} | {len(own)} | {len(found)} | {sign} | {sum(h[0] for h in held)} | "
                f"{sum(sum(h[1:]) for h in held)} of {3 * len(found)} | {bodies} | {np.median(errors or [np.nan]):.1%}"
            )


def main() -> None:
    """Runs the cases that are not in the file yet."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seeds", type=int, default=20, help="cases of each robot and mass")
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("payload_changes.jsonl"), help="rows; continued if there")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore", AssumedValueWarning)
    rows = [json.loads(line) for line in arguments.out.read_text().splitlines()] if arguments.out.exists() else []
    done = {(row["robot"], row["mass"], row["seed"]) for row in rows}
    with arguments.out.open("a") as file:
        for seed in range(arguments.first_seed, arguments.first_seed + arguments.seeds):
            for robot in ROBOTS:
                for mass in MASSES:
                    if (robot, mass, seed) in done:
                        continue
                    row = run(robot, mass, seed)
                    rows.append(row)
                    file.write(json.dumps(row) + "\n")
                    file.flush()
                    print(f"{robot} {mass} {seed}: {row['other']} -> {row.get('found')}", flush=True)
    show(rows)


if __name__ == "__main__":
    main()
