"""Drives without a torque signal: measured and virtual robots, hidden effects, designs, and rivals.

python benchmarks/actuators.py go2 --data LOGS          the measured Go2 beside fits over MuJoCo rollouts
python benchmarks/actuators.py virtual [--cases 60]     virtual plants: errors and coverage of intervals
python benchmarks/actuators.py effects [--cases 8]      one hidden effect of eleven kinds, and none
python benchmarks/actuators.py design                   designed motions beside chirps, checked by refits
python benchmarks/actuators.py sysid --python PYTHON    beside mujoco[sysid], in an environment of its own
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
import warnings
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np  # noqa: E402

from benchmarks.actuators_parts.plants import (  # noqa: E402
    MACHINES,
    TWO_MASSES,
    Machine,
    Truth,
    mjcf,
    multisine,
    play,
    random_truth,
)
from benchmarks.actuators_parts.rollouts import NOMINAL, SIZES, Rollouts, by_cma, by_differences  # noqa: E402
from estimation.actuators import ActuatorOptions, Actuators, identify_actuators  # noqa: E402
from estimation.logs import read_log  # noqa: E402
from oed.experiments.drives import DriveDesignOptions, design_drive_motion  # noqa: E402
from robots.drives import described_drives  # noqa: E402
from robots.drives.branches import load_branches  # noqa: E402
from robots.signals import Log  # noqa: E402


class Stopwatch:
    """Wall time and processor time [s] from its making to `stop`."""

    def __init__(self) -> None:
        self.wall, self.cpu = time.perf_counter(), time.process_time()

    def stop(self) -> None:
        """Ends the measurement."""
        self.wall, self.cpu = time.perf_counter() - self.wall, time.process_time() - self.cpu

    def __str__(self) -> str:
        return f"{self.wall:.1f} s ({self.cpu:.1f} s of processor time)"


TRAINED = 9.0
"""Seconds of the Go2's log that are fitted."""


def go2(options: argparse.Namespace) -> None:
    """Fits the first 9 s of the measured log, by us and over rollouts, and simulates the rest."""
    folder = options.data / "go2_dls"
    file = folder / "go2_no_meshes.xml"
    log = read_log(folder / "run_first60.parquet", 12, torque=False)
    cut = int(np.searchsorted(log.t, TRAINED))
    first, rest = log.rows(slice(0, cut)), log.rows(slice(cut, None))
    with tempfile.TemporaryDirectory() as place:
        gains = Path(place) / "gains.yaml"
        gains.write_text("law: pd\nkp: 20\nkd: 1.5\n")
        # Compiled functions are kept on disk; only the first run ever compiles them.
        legs = load_branches(file)
        identify_actuators(legs, first.rows(slice(0, 200)), described_drives(legs, gains).drives)
        ours = Stopwatch()
        result = identify_actuators(legs, first, described_drives(legs, gains).drives, held_out=rest)
        ours.stop()
        shared = identify_actuators(
            legs,
            first,
            described_drives(legs, gains).drives,
            held_out=rest,
            options=ActuatorOptions(share=("hip", "thigh", "calf"), effects=False),
        )
    print(f"as described                {1e3 * result.described_error:6.2f} mrad held out")
    print(f"ours, classes, no effects   {1e3 * shared.held_out_error:6.2f} mrad held out")
    print(f"ours                        {1e3 * result.held_out_error:6.2f} mrad held out, {ours}")
    for finding in result.findings:
        print(f"  {finding.name}: {finding.title}, {1e3 * finding.before:.2f} -> {1e3 * finding.after:.2f} mrad")
    assert first.command is not None
    assert rest.command is not None
    rollouts = Rollouts(file)

    def held_out(theta: np.ndarray) -> float:
        error = (rollouts.play(theta, rest.t, rest.command, rest.q) - rest.q)[rest.t > rest.t[0] + 0.2]
        return float(np.mean(np.sqrt(np.mean(error**2, axis=0))))

    watch = Stopwatch()
    theta = by_differences(rollouts, first.t, first.command, first.q)
    watch.stop()
    print(f"least squares, differences  {1e3 * held_out(theta):6.2f} mrad held out, {watch}, {rollouts.count} rollouts")
    print(
        f"  ours takes {ours.wall / watch.wall:.2f} of its wall time, {ours.cpu / watch.cpu:.2f} of its processor time"
    )
    if options.cma:

        def cost(x: np.ndarray) -> float:
            theta = NOMINAL + x * SIZES
            penalty = float((np.minimum(theta[:10], 0) ** 2 / SIZES[:10] ** 2).sum())
            return float(((rollouts.play(theta, first.t, first.command, first.q) - first.q) ** 2).mean()) + penalty

        watch, before = Stopwatch(), rollouts.count
        theta = NOMINAL + by_cma(cost, 22, options.cma, 0) * SIZES
        watch.stop()
        count = rollouts.count - before
        print(f"CMA-ES                      {1e3 * held_out(theta):6.2f} mrad held out, {watch}, {count} rollouts")


def identified(machine: Machine, log: Log, effects: bool, held_out: Log | None = None) -> Actuators:
    """Identifies a virtual robot from its described MJCF."""
    with tempfile.TemporaryDirectory() as place:
        file = Path(place) / f"{machine.name}.xml"
        file.write_text(mjcf(machine))
        chains = load_branches(file)
        drives = described_drives(chains).drives
    outside = () if held_out is None else held_out
    return identify_actuators(chains, log, drives, held_out=outside, options=ActuatorOptions(effects=effects))


def virtual(options: argparse.Namespace) -> None:
    """Identifies random plants of three kinds, and counts what the intervals hold."""
    for name, make in MACHINES.items():
        if name not in options.machine:
            continue
        held: dict[str, list[bool]] = defaultdict(list)
        errors: dict[str, list[float]] = defaultdict(list)
        times: list[float] = []
        for seed in range(options.first, options.first + options.cases // len(options.machine)):
            rng, machine = np.random.default_rng(seed), make()
            truth = random_truth(machine, rng)
            t, command = multisine(machine, options.seconds, rng)
            log = Log(t=t, q=play(machine, truth, t, command), command=command, name=f"{name}{seed}")
            began = time.perf_counter()
            result = identified(machine, log, effects=False)
            times.append(time.perf_counter() - began)
            for value in result.parameters:
                j = result.joints.index(value.joints[0])
                true = true_value(truth, value.parameter, j)
                held[value.parameter].append(value.lower <= true <= value.upper)
                errors[value.parameter].append(abs(value.value - true) / (true if true else 1.0))
        every = [hit for hits in held.values() for hit in hits]
        print(f"{name}: intervals hold {np.mean(every):.1%} of {len(every)}; {np.median(times):.1f} s a case")
        for parameter, hits in held.items():
            found = errors[parameter]
            unit = "absolute" if parameter == "torque_offset" else "relative"
            print(
                f"  {parameter:14} held {np.mean(hits):6.1%}   {unit} error: median {np.median(found):.2g}, "
                f"largest {max(found):.2g}",
                flush=True,
            )


def true_value(truth: Truth, parameter: str, joint: int) -> float:
    """The plant's value."""
    if parameter == "delay":
        return truth.delay
    if parameter == "torque_offset":
        return 0.0
    return float(getattr(truth, parameter)[joint])


EFFECTS = (
    "stribeck",
    "position_dependent_friction",
    "load_dependent_friction",
    "current_clipping",
    "dead_band",
    "time_delay",
    "encoder_offset",
    "payload_change",
    "joint_limit",
    "backlash",
    "joint_elasticity",
)


def sized(machine: Machine, truth: Truth, effect: str, joint: int, rng: np.random.Generator, seconds: float) -> Truth:
    """Adds an effect of a size that moves the joint by some milliradians."""
    if effect == "current_clipping":
        t, command = multisine(machine, seconds, np.random.default_rng(99), 2e-3)
        q = play(machine, truth, t, command)
        asked = machine.kp[joint] * (command - q) - machine.kd[joint] * np.gradient(q, t, axis=0)
        size = float(np.quantile(np.abs(asked[:, joint]), 0.99)) * rng.uniform(0.5, 0.7)
        return replace(truth, effect=effect, joint=joint, size=min(size, 0.7 * machine.limit[joint]))
    if effect in TWO_MASSES:
        return two_masses(machine, truth, effect, joint, rng)
    lag = truth.coulomb[joint] + 0.01 * machine.kp[joint]
    sizes = {
        "stribeck": rng.uniform(0.5, 1.0) * lag,
        "position_dependent_friction": rng.uniform(0.5, 0.9) * truth.coulomb[joint],
        "load_dependent_friction": rng.uniform(0.15, 0.35),
        "dead_band": rng.uniform(0.01, 0.03),
        "time_delay": rng.uniform(0.006, 0.015),
        "encoder_offset": rng.choice([-1.0, 1.0]) * rng.uniform(0.08, 0.15),
        "payload_change": rng.uniform(1.4, 1.9),
        "joint_limit": rng.uniform(0.4, 0.7),
    }
    return replace(truth, effect=effect, joint=joint, size=float(sizes[effect]))


def two_masses(machine: Machine, truth: Truth, effect: str, joint: int, rng: np.random.Generator) -> Truth:
    """Adds an elastic gear that the law feels, or a gap that is wider than the encoder's steps."""
    stiff = machine.kp[joint] * (rng.uniform(2, 4) if effect == "joint_elasticity" else 20.0)
    damping = 0.1 * float(np.sqrt(stiff * truth.armature[joint]))
    size = stiff if effect == "joint_elasticity" else float(rng.uniform(0.01, 0.03))
    return replace(truth, effect=effect, joint=joint, size=size, notes={"gear_damping": damping, "stiffness": stiff})


def effects(options: argparse.Namespace) -> None:
    """Hides one effect in each plant, or none, and counts right names and false ones."""
    kinds = list(MACHINES)
    named: dict[str, list[bool]] = defaultdict(list)
    for effect in options.effect or (*EFFECTS, ""):
        count = options.cases if effect else 4 * options.cases
        for seed in range(options.first, options.first + count):
            machine = MACHINES[kinds[seed % len(kinds)]]()
            rng = np.random.default_rng(1000 + seed)
            truth = random_truth(machine, rng)
            loaded = effect in ("load_dependent_friction", "encoder_offset", "payload_change", *TWO_MASSES)
            joint = int(rng.integers(1, 3)) if loaded else int(rng.integers(0, machine.n))
            if effect:
                truth = sized(machine, truth, effect, joint, rng, options.seconds)
            logs = []
            for name in ("run", "held out"):
                t, command = multisine(machine, options.seconds, rng, 2e-3)
                logs.append(Log(t=t, q=play(machine, truth, t, command), command=command, name=name))
            result = identified(machine, logs[0], True, logs[1])
            first = result.findings[0] if result.findings else None
            right = (
                first is None
                if not effect
                else first is not None and (first.effect, first.joint) == (effect, joint + 1)
            )
            named[effect or "none"].append(right)
            if not right:
                found = "nothing" if first is None else f"{first.effect} of joint {first.joint}"
                print(f"    {machine.name} {seed}: {effect or 'none'} of joint {joint + 1}, found {found}", flush=True)
        if not named[effect or "none"]:
            continue
        print(
            f"{effect or 'none':28} right {sum(named[effect or 'none'])} of {len(named[effect or 'none'])}", flush=True
        )
    with_effect = [hit for effect in EFFECTS for hit in named[effect]]
    if with_effect:
        print(f"named right {np.mean(with_effect):.1%} of {len(with_effect)}")
    if named["none"]:
        print(f"false {1 - np.mean(named['none']):.1%} of {len(named['none'])}")


def design(options: argparse.Namespace) -> None:
    """Designs a motion for each machine, and compares its errors with a chirp's: promised, and those of refits."""
    for name in options.machine:
        machine = MACHINES[name]()
        with tempfile.TemporaryDirectory() as place:
            file = Path(place) / f"{name}.xml"
            file.write_text(mjcf(machine))
            chains = load_branches(file)
            drives = described_drives(chains).drives
        settings = DriveDesignOptions(duration=options.seconds, home=machine.home, fastest=machine.fastest)
        found = design_drive_motion(chains, drives, options=settings)
        ratios = {
            p: [e.ratio for e in found.expected if e.parameter == p]
            for p in dict.fromkeys(e.parameter for e in found.expected)
        }
        least = min(map(min, ratios.values()))
        print(f"{name}: standard errors {found.ratio:.2f} of a chirp's (median), {least:.2f} at best")
        for parameter, own in ratios.items():
            print(f"  {parameter:14} {min(own):.2f} to {max(own):.2f}", flush=True)
        if not options.refits:
            continue
        rng = np.random.default_rng(0)
        truth = Truth(
            armature=np.array(machine.armature),
            viscous=np.array(machine.viscous),
            coulomb=np.array(machine.coulomb),
            delay=0.0,
        )
        clean = play(replace(machine, encoder=1e-12), truth, found.t, found.command)
        scatter: dict[tuple[str, str], list[float]] = defaultdict(list)
        for _ in range(options.refits):
            q = clean + settings.noise * rng.standard_normal(clean.shape)
            log = Log(t=found.t, q=q, command=found.command, name="refit")
            result = identify_actuators(chains, log, drives, held_out=log, options=ActuatorOptions(effects=False))
            for value in result.parameters:
                scatter[value.parameter, value.group].append(value.value)
        promised = {(e.parameter, e.group): e.standard_error for e in found.expected}
        shares = [float(np.std(values, ddof=1)) / promised[key] for key, values in scatter.items()]
        ends = f"median {np.median(shares):.2f}, {min(shares):.2f} to {max(shares):.2f}"
        print(f"  scatter of {options.refits} refits over what was promised: {ends}")


def sysid(options: argparse.Namespace) -> None:
    """Fits legs without delay by us and by `mujoco[sysid]`, which another environment has, from the same logs."""
    script = Path(__file__).parent / "actuators_parts" / "sysid_rival.py"
    rows: list[tuple[float, float, bool, bool]] = []
    for seed in range(options.cases):
        rng, machine = np.random.default_rng(seed), MACHINES["leg"]()
        truth = replace(random_truth(machine, rng), delay=0.0)
        t, command = multisine(machine, 4.0, rng)
        q = play(machine, truth, t, command)
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            # A user's model: the step of the log, and dry friction as stiff as it allows.
            text = mjcf(machine, step=1e-3).replace("RK4", "implicitfast")
            (folder / "leg.xml").write_text(text.replace('solreffriction="0.0002 1"', 'solreffriction="0.002 1"'))
            np.savez(folder / "log.npz", t=t, q=q, command=command)
            files = [str(folder / name) for name in ("leg.xml", "log.npz", "result.json")]
            subprocess.run([options.python, str(script), *files], check=True, capture_output=True)
            other = json.loads((folder / "result.json").read_text())
        began = time.process_time()
        result = identified(machine, Log(t=t, q=q, command=command, name="run"), effects=False)
        print(f"case {seed}: CPU {time.process_time() - began:.2f} s, mujoco.sysid {other['cpu']:.2f} s", flush=True)
        for key in ("armature", "viscous", "coulomb"):
            for j, name in enumerate(result.joints):
                true, own = true_value(truth, key, j), result.value(key, name)
                theirs, half = other["values"][f"{key} {name}"], other["half_widths"][f"{key} {name}"]
                within = own.lower <= true <= own.upper, abs(theirs - true) <= half
                rows.append((abs(own.value / true - 1), abs(theirs / true - 1), *within))
    errors, others, held, held_by_other = (np.array(column, dtype=float) for column in zip(*rows, strict=True))
    for who, error, hits in (("ours", errors, held), ("mujoco.sysid", others, held_by_other)):
        print(
            f"{who:13} error median {np.median(error):.2g}, largest {error.max():.2g}; intervals hold {hits.mean():.0%}"
        )


def main() -> None:
    """Runs a part."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parts = parser.add_subparsers(required=True)
    part = parts.add_parser("go2")
    part.add_argument("--data", type=Path, required=True, help="folder of the measured logs")
    part.add_argument("--cma", type=int, default=0, help="evaluations of CMA-ES; 0 for none")
    part.set_defaults(run=go2)
    part = parts.add_parser("virtual")
    part.add_argument("--cases", type=int, default=60)
    part.add_argument("--seconds", type=float, default=10.0)
    part.add_argument("--first", type=int, default=0, help="seed of the first case")
    part.add_argument("--machine", nargs="*", default=list(MACHINES), choices=list(MACHINES))
    part.set_defaults(run=virtual)
    part = parts.add_parser("effects")
    part.add_argument("--cases", type=int, default=8)
    part.add_argument("--seconds", type=float, default=8.0)
    part.add_argument("--first", type=int, default=0, help="seed of the first case")
    part.add_argument("--effect", nargs="*", help="effects to hide; an empty one for none")
    part.set_defaults(run=effects)
    part = parts.add_parser("design")
    part.add_argument("--machine", nargs="*", default=list(MACHINES), choices=list(MACHINES))
    part.add_argument("--seconds", type=float, default=20.0)
    part.add_argument("--refits", type=int, default=0, help="noisy simulations in MuJoCo to refit")
    part.set_defaults(run=design)
    part = parts.add_parser("sysid")
    part.add_argument("--python", required=True, help="of an environment with mujoco[sysid]")
    part.add_argument("--cases", type=int, default=4)
    part.set_defaults(run=sysid)
    options = parser.parse_args()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        options.run(options)


if __name__ == "__main__":
    main()
