"""From a log made in MuJoCo to a corrected MuJoCo model that follows the log.

Run it with ``python benchmarks/mujoco_loop.py [SEEDS]``. The original model is the catalogue's UR10 as MuJoCo imports
its URDF, with motors, armature, damping and frictionloss. The real robot is another MuJoCo model: its masses, armature
and friction differ by up to 20 %, and it has a spring on the elbow, or a payload that is picked up between two logs.
A position loop at 2 kHz plays random motions on it and records logs at 250 Hz, with noise. ``oed diagnose`` gets the
original model and the logs, and writes the corrected model. Both models then run in MuJoCo under the same loop and a
reference that the diagnosis has not seen. Their errors against the recorded log are compared.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Element = ElementTree.Element

URDF = Path(__file__).parents[1] / "robots" / "catalog" / "ur10.urdf"
STEP, EVERY = 0.0005, 8  # [s], steps per row of a log
DURATION, MOTIONS, HARMONICS, BASE_FREQUENCY = 30.0, 4, 5, 0.1
ARMATURE = (0.6, 0.6, 0.3, 0.05, 0.05, 0.05)  # [kg m2]
DAMPING = (12.0, 15.0, 9.0, 2.0, 2.0, 1.5)  # [N m s/rad]
FRICTION = (9.0, 10.0, 6.0, 1.5, 1.2, 1.0)  # [N m]
GAINS = np.array([8000.0, 8000.0, 5000.0, 800.0, 800.0, 500.0])  # [N m/rad]
RATES = np.array([400.0, 400.0, 200.0, 25.0, 25.0, 15.0])  # [N m s/rad]
SPREAD = 0.2
SPRING, REST = 40.0, 0.4  # [N m/rad], [rad]
PAYLOAD = 3.0  # [kg]
ENCODER, TORQUE = 2e-5, 0.01  # noise [rad], and as a share of each joint's torque


def imported() -> Element:
    """MuJoCo's MJCF of the URDF, with drives. Fixed links stay, because fusing them rotates their inertias wrongly."""
    urdf = ElementTree.fromstring(URDF.read_bytes())
    for link in urdf.findall("link"):
        for tag in ("visual", "collision"):
            for element in link.findall(tag):
                link.remove(element)
    settings = ElementTree.SubElement(urdf, "mujoco")
    ElementTree.SubElement(settings, "compiler", fusestatic="false", discardvisual="true")
    spec = mujoco.MjSpec.from_string(ElementTree.tostring(urdf, encoding="unicode"))
    spec.compile()
    root = ElementTree.fromstring(spec.to_xml())
    option = root.find("option")
    option = ElementTree.SubElement(root, "option") if option is None else option
    option.set("timestep", repr(STEP))
    option.set("integrator", "implicitfast")
    actuators = ElementTree.SubElement(root, "actuator")
    for i, joint in enumerate(root.iter("joint")):
        joint.attrib.pop("actuatorfrcrange", None)
        joint.set("armature", repr(ARMATURE[i]))
        joint.set("damping", repr(DAMPING[i]))
        joint.set("frictionloss", repr(FRICTION[i]))
        # Otherwise dry friction would fade below .1 rad/s.
        joint.set("solreffriction", f"{2 * STEP!r} 1")
        ElementTree.SubElement(actuators, "motor", joint=str(joint.get("name")))
    return root


def real(original: Element, seed: int, spring: bool) -> Element:
    """The robot that makes the log."""
    rng = np.random.default_rng(seed)
    root = ElementTree.fromstring(ElementTree.tostring(original))

    def vary(element: Element, *keys: str) -> None:
        factor = 1.0 + rng.uniform(-SPREAD, SPREAD)
        for key in keys:
            if key in element.attrib:
                scaled = [factor * float(x) for x in element.get(key, "").split()]
                element.set(key, " ".join(map(repr, scaled)))

    for inertial in root.iter("inertial"):
        vary(inertial, "mass", "diaginertia", "fullinertia")
    for joint in (joint for body in root.iter("body") for joint in body.findall("joint")):
        for key in ("armature", "damping", "frictionloss"):
            vary(joint, key)
    if spring:
        elbow = [joint for body in root.iter("body") for joint in body.findall("joint")][2]
        elbow.set("stiffness", repr(SPRING))
        in_degrees = all(compiler.get("angle") != "radian" for compiler in root.findall("compiler"))
        elbow.set("springref", repr(float(np.rad2deg(REST)) if in_degrees else REST))
    return root


def carrying(root: Element) -> Element:
    """The same robot with a payload on its flange."""
    loaded = ElementTree.fromstring(ElementTree.tostring(root))
    last = [body for body in loaded.iter("body") if body.find("joint") is not None][-1]
    load = ElementTree.SubElement(last, "body", name="load", pos="0 0.12 0.03")
    ElementTree.SubElement(load, "inertial", pos="0 0 0", mass=repr(PAYLOAD), diaginertia="0.01 0.012 0.008")
    return loaded


def reference(seed: int) -> tuple[Array, Array]:
    """Positions and velocities (N, 6) of a random Fourier motion from rest to rest."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(DURATION / STEP)) * STEP
    centre = np.array([0.0, -1.2, 1.0, -0.8, 0.3, 0.0])
    size = np.array([1.2, 0.6, 0.8, 1.2, 1.2, 1.5])
    harmonics = np.arange(1, HARMONICS + 1)
    a, b = rng.normal(size=(2, HARMONICS, 6)) / harmonics[:, None]
    angle = 2 * np.pi * BASE_FREQUENCY * t[:, None] * harmonics
    waves = np.sin(angle) @ a + np.cos(angle) @ b
    waves *= size / np.abs(waves).max(axis=0)
    # The amplitude grows and falls within 2 s.
    x = np.clip(np.minimum(t, t[-1] - t) / 2.0, 0.0, 1.0)[:, None]
    q = centre + waves * (10 * x**3 - 15 * x**4 + 6 * x**5)
    return q, np.gradient(q, STEP, axis=0)


def play(root: Element, path: Path, motion: tuple[Array, Array]) -> tuple[Array, Array]:
    """Runs the position loop in MuJoCo; positions and torques (M, 6) of every eighth step."""
    path.write_text(ElementTree.tostring(root, encoding="unicode"))
    return play_file(path, motion)


def play_file(path: Path, motion: tuple[Array, Array]) -> tuple[Array, Array]:
    """The same for a file."""
    model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT
    data = mujoco.MjData(model)
    q, dq = motion
    data.qpos[:], data.qvel[:] = q[0], dq[0]
    mujoco.mj_forward(model, data)
    start = data.qfrc_bias - data.qfrc_passive
    rows = []
    for k in range(len(q)):
        tau = start + GAINS * (q[k] - data.qpos) + RATES * (dq[k] - data.qvel)
        data.ctrl[:] = tau
        if k % EVERY == 0:
            rows.append((data.qpos.copy(), tau))
        mujoco.mj_step(model, data)
    positions, torques = zip(*rows, strict=True)
    return np.array(positions), np.array(torques)


def write_log(path: Path, recorded: tuple[Array, Array], start: float, rng: np.random.Generator) -> None:
    """Writes a log with noise."""
    q, tau = recorded
    t = start + np.arange(len(q)) * STEP * EVERY
    noisy = q + rng.normal(scale=ENCODER, size=q.shape)
    torque = tau + rng.normal(size=tau.shape) * TORQUE * tau.std(axis=0)
    names = ["t", *(f"{word}{i}" for word in ("q", "tau") for i in range(1, 7))]
    np.savetxt(path, np.column_stack([t, noisy, torque]), delimiter=",", header=",".join(names), comments="")


def errors(one: tuple[Array, Array], other: tuple[Array, Array]) -> tuple[Array, Array]:
    """Root mean square differences (6,) of positions and torques."""
    position, torque = (np.sqrt(np.mean((a - b) ** 2, axis=0)) for a, b in zip(one, other, strict=True))
    return position, torque


def trial(seed: int, hidden: str, folder: Path) -> dict[str, Any]:
    """One robot: logs, diagnosis, and the errors of both models."""
    original = imported()
    robot = real(original, seed, hidden == "spring")
    loaded = carrying(robot) if hidden == "payload" else robot
    rng = np.random.default_rng(1000 + seed)
    (folder / "original.xml").write_text(ElementTree.tostring(original, encoding="unicode"))
    logs = []
    for number in range(MOTIONS):
        # A payload is picked up in the middle of the campaign.
        now = loaded if number >= MOTIONS // 2 else robot
        recorded = play(now, folder / "real.xml", reference(100 * seed + number))
        logs.append(folder / f"log_{number}.csv")
        write_log(logs[-1], recorded, number * (DURATION + 10.0), rng)
    command = [sys.executable, "-m", "oed", "diagnose", "--robot", str(folder / "original.xml"), "--force", "--json"]
    command += [word for log in logs for word in ("--log", str(log))]
    command += ["--out", str(folder / "diagnosed"), "--mjcf", str(folder / "corrected.xml")]
    begun = time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(done.stderr)
    result = json.loads(done.stdout)
    unseen = reference(100 * seed + 99)
    truth = play(loaded, folder / "real.xml", unseen)
    before, after = (errors(play_file(folder / f"{n}.xml", unseen), truth) for n in ("original", "corrected"))
    return {
        "seed": seed,
        "hidden": hidden,
        "found": [(f["effect"], f["joint"]) for f in result["findings"]],
        "mjcf": result["mjcf"],
        "position": [float(np.linalg.norm(e[0])) for e in (before, after)],
        "torque": [float(np.linalg.norm(e[1])) for e in (before, after)],
        "seconds": time.perf_counter() - begun,
    }


def main(seeds: int = 2) -> None:
    """Prints a row per trial."""
    print("hidden   seed   position error [mrad]      torque error [N m]        found")
    print("                original corrected ratio   original corrected ratio")
    for hidden in ("spring", "payload"):
        for seed in range(seeds):
            with tempfile.TemporaryDirectory() as folder:
                row = trial(seed, hidden, Path(folder))
            (p0, p1), (t0, t1) = row["position"], row["torque"]
            found = ", ".join(f"{effect}" + (f" {joint}" if joint else "") for effect, joint in row["found"])
            print(
                f"{hidden:8} {seed:4}   {1e3 * p0:8.3f} {1e3 * p1:9.3f} {p1 / p0:5.3f}   "
                f"{t0:8.3f} {t1:9.3f} {t1 / t0:5.3f}   {found}  ({row['seconds']:.0f} s)",
                flush=True,
            )
            for remark in row["mjcf"]["remarks"]:
                print(f"           {remark}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
