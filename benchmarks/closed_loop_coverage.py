"""How often the 95 % intervals of a diagnosis hold the truth on robots that a physics engine integrates.

Run it with ``python benchmarks/closed_loop_coverage.py --seeds 1 200``. Each seed is one fresh UR10 of MuJoCo, whose
masses, rotors and friction differ from their description, under a position loop at 2 kHz with dry friction. One of
eight effects is hidden in it, of a random size at a random joint, and 0.5 to 2.5 % of torque noise are added. The log
of 45 s and the held-out one of 20 s have 250 Hz. Every determined parameter of the named effect counts, if the plant
has its true value. Rows are added as they come, and a run that was stopped goes on where it was. ``--figures`` prints
the table. A file of ``--logs`` keeps the motions, so a changed diagnosis reads them again.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import mujoco  # noqa: E402
import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402
from scipy.signal import lfilter  # noqa: E402

from benchmarks.closed_loop_parts.plants import (  # noqa: E402
    DAMPING,
    EVERY,
    FRICTION,
    GAINS,
    JOINTS,
    LEAD,
    RATES,
    STEP,
    Plant,
    model_of,
    reference,
)
from benchmarks.diagnosis import read_rows  # noqa: E402
from estimation.uncertainty.quantiles import share_interval  # noqa: E402

Array = NDArray[np.float64]

OWN, UNSEEN, PAUSE = 45.0, 20.0, 10.0  # [s]
COUNT, MEMORY = 2 * np.pi / 2**19, 0.9
FLANGE = "tool0"


@dataclass(frozen=True, kw_only=True)
class Hidden:
    """What a plant has beyond its description.

    Attributes:
        effect: its name in the catalogue.
        joint: from 1; None for the whole robot.
        truth: true values of the parameters of its finding.
        moment: time of a change [s]; 0 for none.
    """

    effect: str
    joint: int | None
    truth: dict[str, float]
    moment: float = 0.0


EFFECTS = (
    "spring",
    "torque_constant_error",
    "base_tilt",
    "payload_change",
    "friction_step",
    "encoder_offset",
    "time_delay",
    "joint_elasticity",
)


def drawn(seed: int) -> Hidden:
    """Draws the effect of a seed."""
    effect = EFFECTS[seed % len(EFFECTS)]
    rng = np.random.default_rng([seed, 11])
    sign, moment = float(rng.choice([-1.0, 1.0])), OWN * float(rng.uniform(0.3, 0.7))
    if effect == "spring":
        joint = int(rng.choice([1, 3, 5]))
        return Hidden(
            effect=effect, joint=joint, truth={"stiffness": float(rng.uniform(0.5, 1.2)) * (80, 0, 80, 0, 6)[joint - 1]}
        )
    if effect == "torque_constant_error":
        joint = int(rng.choice([2, 3, 4]))
        return Hidden(effect=effect, joint=joint, truth={"relative_error": sign * float(rng.uniform(0.06, 0.2))})
    if effect == "base_tilt":
        angle, heading = float(rng.uniform(0.008, 0.04)), float(rng.uniform(0, 2 * np.pi))
        return Hidden(
            effect=effect, joint=None, truth={"tilt_1": angle * np.cos(heading), "tilt_2": angle * np.sin(heading)}
        )
    if effect == "payload_change":
        mass, centre = float(rng.uniform(0.8, 4.0)), rng.uniform([-0.05, -0.05, -0.05], [0.12, 0.05, 0.05])
        return Hidden(
            effect=effect,
            joint=None,
            truth={
                "mass_change": mass,
                **{f"moment_change_{k}": mass * float(c) for k, c in zip("xyz", centre, strict=True)},
            },
            moment=moment,
        )
    joint = int(rng.integers(1, JOINTS + 1))
    if effect == "friction_step":
        truth = {
            "coulomb_step": FRICTION[joint - 1] * rng.uniform(0.2, 0.6),
            "viscous_step": DAMPING[joint - 1] * rng.uniform(0.1, 0.4),
        }
        return Hidden(effect=effect, joint=joint, truth={k: float(v) for k, v in truth.items()}, moment=moment)
    if effect == "encoder_offset":
        return Hidden(
            effect=effect, joint=int(rng.choice([2, 3, 4])), truth={"offset": sign * float(rng.uniform(0.01, 0.05))}
        )
    if effect == "time_delay":
        return Hidden(effect=effect, joint=None, truth={"delay": float(rng.uniform(0.003, 0.01))})
    return Hidden(
        effect=effect,
        joint=int(rng.choice([2, 3])),
        truth={"compliance": float(np.exp(rng.uniform(np.log(3e-5), np.log(1.5e-4))))},
    )


class _Loop:
    """A plant under its position loop."""

    def __init__(self, hidden: Hidden, seed: int) -> None:
        mechanical = hidden.effect in ("spring", "joint_elasticity")
        kind, amount = (hidden.effect, next(iter(hidden.truth.values()))) if mechanical else ("", 0.0)
        plant = Plant(kind=kind, place=hidden.joint or 1, amount=amount, seed=10_000 + seed)
        self.hidden = hidden
        self.model, self.motors, _ = model_of(plant)
        self.unloaded = self._bodies()
        if hidden.effect == "base_tilt":
            turn = [hidden.truth["tilt_1"], hidden.truth["tilt_2"], 0.0]
            # The base is turned by the angles, so gravity turns back in its frame.
            self.model.opt.gravity[:] = _rotation(-np.array(turn)) @ self.model.opt.gravity

    def _bodies(self) -> tuple[Array, Array, Array]:
        model = self.model
        return model.body_mass.copy(), model.body_inertia.copy(), model.body_ipos.copy()

    def change(self, on: bool) -> None:
        """Puts the robot into its state before or after the change."""
        hidden, model = self.hidden, self.model
        if hidden.effect == "friction_step" and on:
            dof = model.jnt_dofadr[model.actuator_trnid[(hidden.joint or 1) - 1, 0]]
            model.dof_frictionloss[dof] += hidden.truth["coulomb_step"]
            model.dof_damping[dof] += hidden.truth["viscous_step"]
        if hidden.effect == "payload_change" and on:
            body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, FLANGE)
            mass = hidden.truth["mass_change"]
            # The flange's own body has no mass in the description.
            assert model.body_mass[body] < 1e-6
            model.body_mass[body] = mass
            model.body_inertia[body] = 0.002 * mass * np.array([1.0, 1.3, 0.8])
            model.body_ipos[body] = [hidden.truth[f"moment_change_{k}"] / mass for k in "xyz"]
            model.body_iquat[body] = [1, 0, 0, 0]
            mujoco.mj_setConst(model, mujoco.MjData(model))

    def play(self, motion: tuple[Array, Array], moment: float) -> tuple[Array, Array, Array]:
        """Integrates the loop; t (N,), q and tau (N, 6) at 250 Hz."""
        model, motors = self.model, self.motors
        data = mujoco.MjData(model)
        dofs = [int(model.jnt_dofadr[model.actuator_trnid[i, 0]]) for i in range(JOINTS)]
        q, dq = motion
        data.qpos[motors] = q[0]
        mujoco.mj_forward(model, data)
        start = data.qfrc_bias[dofs] - data.qfrc_passive[dofs]
        switch = round((moment + LEAD) / STEP) if moment else -1
        rows = np.empty((len(q) // EVERY, 2, JOINTS))
        for k in range(len(rows) * EVERY):
            if k == switch:
                self.change(True)
            own = data.qpos[motors]
            tau = start + GAINS * (q[k] - own) + RATES * (dq[k] - data.qvel[dofs])
            data.ctrl[:] = tau
            if k % EVERY == 0:
                rows[k // EVERY] = own, tau
            mujoco.mj_step(model, data)
        first = round(LEAD / (STEP * EVERY))
        t = np.arange(len(rows) - first) * STEP * EVERY
        return t, rows[first:, 0], rows[first:, 1]


def _rotation(angles: Array) -> Array:
    quaternion, matrix = np.zeros(4), np.zeros(9)
    size = float(np.linalg.norm(angles))
    mujoco.mju_axisAngle2Quat(quaternion, angles / max(size, 1e-12), size)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)


def made(seed: int, folder: Path) -> tuple[Hidden, dict[str, Array]]:
    """Returns the effect of a seed and its logs, from the folder if they are there."""
    hidden, path = drawn(seed), folder / f"{seed}.npz"
    if not path.exists():
        loop, rng = _Loop(hidden, seed), np.random.default_rng([seed, 12])
        level = float(np.exp(rng.uniform(np.log(0.005), np.log(0.025))))
        stored: dict[str, Array] = {}
        for k, (name, duration) in enumerate((("own", OWN), ("unseen", UNSEEN))):
            t, q, tau = loop.play(reference(7919 * seed + k, duration), hidden.moment if k == 0 else 0.0)
            q, tau = _measured(hidden, q, tau, t)
            size = level * np.sqrt(np.mean(tau**2, axis=0)) * np.sqrt(0.5)
            white, driven = rng.normal(size=(2, *tau.shape))
            tau = tau + size * (white + lfilter([np.sqrt(1 - MEMORY**2)], [1, -MEMORY], driven, axis=0))
            stored |= {f"{name}_t": t + k * (OWN + PAUSE), f"{name}_q": np.round(q / COUNT) * COUNT, f"{name}_tau": tau}
        np.savez_compressed(path, **stored)  # type: ignore[arg-type]
    with np.load(path) as file:
        return hidden, dict(file)


def _measured(hidden: Hidden, q: Array, tau: Array, t: Array) -> tuple[Array, Array]:
    """What sensors with a fault show of positions and torques (N, 6)."""
    q, tau, i = q.copy(), tau.copy(), (hidden.joint or 1) - 1
    if hidden.effect == "torque_constant_error":
        tau[:, i] *= 1.0 + hidden.truth["relative_error"]
    if hidden.effect == "encoder_offset":
        q[:, i] -= hidden.truth["offset"]
    if hidden.effect == "time_delay":
        tau = np.column_stack([np.interp(t - hidden.truth["delay"], t, x) for x in tau.T])
    return q, tau


def run(seed: int, folder: Path) -> dict[str, Any]:
    """Diagnoses one plant, and compares the intervals of the right finding with the truth."""
    from estimation import diagnose
    from robots import load_robot
    from robots.signals import Log

    hidden, rows = made(seed, folder)
    own, unseen = (
        Log(t=rows[f"{name}_t"], q=rows[f"{name}_q"], tau=rows[f"{name}_tau"], name=name) for name in ("own", "unseen")
    )
    begun = time.process_time()
    said = diagnose(load_robot("ur10"), own, held_out=unseen).to_dict()
    truth = {**hidden.truth, **({"change_time": hidden.moment} if hidden.moment else {})}
    intervals = [
        {"name": p["name"], "truth": truth[p["name"]], "value": p["value"], "ci95": p["ci95"]}
        for finding in said["findings"]
        if (finding["effect"], finding["joint"]) == (hidden.effect, hidden.joint)
        for p in finding["parameters"]
        if p["name"] in truth and None not in p["ci95"]
    ]
    return {
        "key": str(seed),
        "seed": seed,
        "effect": hidden.effect,
        "joint": hidden.joint,
        "verdict": said["verdict"],
        "found": [(f["effect"], f["joint"]) for f in said["findings"]],
        "intervals": intervals,
        "cpu": time.process_time() - begun,
    }


def figures(rows: list[dict[str, Any]]) -> str:
    """Writes the table: per effect, plants, named, alone, intervals and those that hold the truth."""
    lines = ["effect                 plants  named  alone  intervals  hold the truth"]
    for name in (*EFFECTS, "all"):
        some = [row for row in rows if name in (row["effect"], "all")]
        named = [row for row in some if [row["effect"], row["joint"]] in [list(f) for f in row["found"]]]
        found = [p for row in some for p in row["intervals"]]
        held = sum(p["ci95"][0] <= p["truth"] <= p["ci95"][1] for p in found)
        share = ""
        if found:
            low, high = share_interval(held, len(found))
            share = f"{100 * held / len(found):.0f} % ({100 * low:.0f} to {100 * high:.0f})"
        lines.append(
            f"{name:22} {len(some):6} {len(named):6} {sum(len(row['found']) == 1 for row in named):6} {len(found):10}  "
            f"{held} {share}"
        )
    return "\n".join(lines)


def main() -> int:
    """Runs the seeds that are missing, and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seeds", type=int, nargs=2, default=(1, 200), help="first and last seed")
    parser.add_argument("--logs", type=Path, default=Path("closed_loop_coverage_logs"), help="folder of the logs")
    parser.add_argument("--out", type=Path, default=Path("closed_loop_coverage.jsonl"), help="rows; continued if there")
    parser.add_argument("--seconds", type=float, default=np.inf, help="no plant is begun after this time")
    parser.add_argument("--figures", action="store_true", help="print the table, run nothing")
    options = parser.parse_args()
    options.logs.mkdir(parents=True, exist_ok=True)
    known, begun = {row["key"] for row in read_rows(options.out)}, time.monotonic()
    for seed in () if options.figures else range(options.seeds[0], options.seeds[1] + 1):
        if str(seed) in known or time.monotonic() - begun > options.seconds:
            continue
        row = run(seed, options.logs)
        with options.out.open("a") as file:
            file.write(json.dumps(row, default=float) + "\n")
        held = ", ".join(
            f"{p['name']} {p['truth']:.4g} in {p['ci95'][0]:.4g} to {p['ci95'][1]:.4g}"
            + ("" if p["ci95"][0] <= p["truth"] <= p["ci95"][1] else " MISSED")
            for p in row["intervals"]
        )
        print(f"{seed} {row['effect']} {row['joint'] or ''}: {row['found']}, {held} ({row['cpu']:.0f} s)", flush=True)
    print(figures(read_rows(options.out)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
