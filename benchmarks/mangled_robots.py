"""Mangled URDF files: each ends in one clear message, or in what pinocchio reads, and nothing is dropped in silence.

An arm of three joints is spoilt by one or two of the ways below. Result of a case:

- ``message``: one of our errors, and nothing else;
- ``right``: chain, bodies, limits and friction are those that pinocchio reads of the same file;
- ``named``: they are, or they are those of the file before, and a further note names what is not as it should be;
- ``silent``: anything else that is accepted, above all a misspelt or unknown part without a note;
- ``traceback``: any other exception.

    python benchmarks/mangled_robots.py --cases 1000 --seed 0 --out mangled_robots.jsonl
"""

from __future__ import annotations

import argparse
import json
import re
import sys
import tempfile
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pinocchio as pin

from robots.common.errors import OedError
from robots.loading import load_robot
from robots.robot import Robot

BODY = """<inertial><origin xyz="0.02 0.01 0.15" rpy="0.1 0.2 0.3"/><mass value="{mass}"/>
<inertia ixx="0.02" ixy="0.001" ixz="0.0" iyy="0.02" iyz="0.0" izz="0.01"/></inertial>
<collision><origin xyz="0 0 0.1" rpy="0 0 0"/><geometry><cylinder radius="0.05" length="0.3"/></geometry></collision>"""
JOINT = """<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>
<origin xyz="0.1 0 0.3" rpy="{rpy}"/><axis xyz="{axis}"/>
<limit lower="-1.5" upper="1.2" velocity="{velocity}" effort="50"/><dynamics damping="0.5" friction="0.25"/></joint>"""
TO_OURS = [0, 1, 2, 3, 4, 5, 7, 6, 8, 9]
# Ways after which a note or a message must name what is wrong; the defaults of the specification hold for the others.
MISSPELT = ("typo_attribute", "typo_element", "unknown_attribute", "unknown_element", "foreign", "degrees", "no_body")


def arm() -> str:
    """The file before it is spoilt."""
    links = "".join(f'<link name="l{i}">{BODY.format(mass=5 - i)}</link>\n' for i in (1, 2, 3))
    joints = (
        ("j1", "revolute", "base", "l1", "0 0 0.2", "0 0 1", 3),
        ("j2", "revolute", "l1", "l2", "1.57 0 0", "0 1 0", 4),
    )
    joints += (("j3", "prismatic", "l2", "l3", "0 0.3 0", "0 0 1", 1),)
    keys = ("name", "kind", "parent", "child", "rpy", "axis", "velocity")
    text = "".join(JOINT.format(**dict(zip(keys, row, strict=True))) + "\n" for row in joints)
    tool = '<link name="tool"/><joint name="f" type="fixed"><parent link="l3"/><child link="tool"/></joint>'
    return f'<?xml version="1.0"?>\n<robot name="arm"><link name="base"/>\n{links}{text}{tool}\n</robot>\n'


def _replace(text: str, pattern: str, rng: np.random.Generator, change: Callable[[re.Match[str]], str]) -> str:
    """Changes one random place that a pattern finds."""
    found = list(re.finditer(pattern, text))
    if not found:
        return text
    match = found[int(rng.integers(len(found)))]
    return text[: match.start()] + change(match) + text[match.end() :]


ATTRIBUTE = r' ([a-z]+)="([^"]*)"'
NUMBER = r'(?<=")-?\d+(?:\.\d+)?(?=[" ])'
EMPTY = r"<[a-z]+ [^<>]*/>"


def _typo(word: str, rng: np.random.Generator) -> str:
    place = int(rng.integers(len(word)))
    return word[:place] + "xz"[word[place] == "x"] + word[place + 1 :]


def _quaternion(match: re.Match[str]) -> str:
    roll, pitch, yaw = (float(word) for word in match[1].split())
    quat = pin.Quaternion(pin.rpy.rpyToMatrix(roll, pitch, yaw)).coeffs()
    return f'quat_xyzw="{" ".join(repr(float(value)) for value in quat)}"'


def _quaternions(text: str, rng: np.random.Generator) -> str:
    text = text.replace('<robot name="arm">', '<robot name="arm" version="1.1">')
    return _replace(text, r'rpy="([^"]+)"', rng, _quaternion)


ENDS = r'lower="-1.5" upper="1.2"'
FOREIGN = "<d:joint xmlns:d='http://drake.mit.edu' name='x' type='ball'/>"
SOFT = '<safety_controller k_velocity="1" soft_lower_limit="-1" soft_upper_limit="1"/>'
MORE = ' acceleration="2" deceleration="2" jerk="9"'
NUMBERS = ["abc", "1,5", "nan", "inf", "", "1e999", "--1"]
KINDS = ["fixed", "continuous", "planar", "ball", "prismatic"]
OPEN = ["", 'upper="1"', 'lower="0" upper="0"']

WAYS: dict[str, Callable[[str, np.random.Generator], str]] = {
    "drop_attribute": lambda t, r: _replace(t, ATTRIBUTE, r, lambda m: ""),
    "typo_attribute": lambda t, r: _replace(t, ATTRIBUTE, r, lambda m: f' {_typo(m[1], r)}="{m[2]}"'),
    "drop_element": lambda t, r: _replace(t, EMPTY, r, lambda m: ""),
    "twice": lambda t, r: _replace(t, EMPTY, r, lambda m: 2 * m[0]),
    "typo_element": lambda t, r: _replace(t, r"<([a-z]+)( [^<>]*/>)", r, lambda m: f"<{_typo(m[1], r)}{m[2]}"),
    "no_number": lambda t, r: _replace(t, NUMBER, r, lambda m: str(r.choice(NUMBERS))),
    "negative": lambda t, r: _replace(t, NUMBER, r, lambda m: f"-{m[0].removeprefix('-')}"),
    "one_number_more": lambda t, r: _replace(t, NUMBER, r, lambda m: f"{m[0]} 0"),
    "unknown_attribute": lambda t, r: _replace(t, r"/>", r, lambda m: ' armature="0.1"/>'),
    "unknown_element": lambda t, r: _replace(t, r"</(joint|link)>", r, lambda m: f"<spring stiffness='3'/>{m[0]}"),
    "foreign": lambda t, r: _replace(t, r"</(joint|link|robot)>", r, lambda m: f"{FOREIGN}{m[0]}"),
    "cut": lambda t, r: t[: int(r.integers(20, len(t) - 5))],
    "noise": lambda t, r: _replace(t, r"[a-z]", r, lambda m: chr(int(r.integers(33, 127)))),
    "degrees": lambda t, r: _replace(t, ENDS, r, lambda m: 'lower="-150" upper="120"'),
    "no_body": lambda t, r: _replace(t, r'ixx="0.02"', r, lambda m: f'ixx="{r.choice([0.2, 2.0])}"'),
    "ends": lambda t, r: _replace(t, ENDS, r, lambda m: str(r.choice(OPEN))),
    "link_name": lambda t, r: _replace(t, r'link="[a-z0-9]+"', r, lambda m: f'link="{r.choice(["l1", "l2", "l9"])}"'),
    "kind": lambda t, r: _replace(t, r'type="[a-z]+"', r, lambda m: f'type="{r.choice(KINDS)}"'),
    "quaternion": _quaternions,
    "limits_1_2": lambda t, r: _replace(t, r'effort="50"', r, lambda m: m[0] + MORE),
    "soft": lambda t, r: _replace(t, r"</joint>", r, lambda m: SOFT + m[0]),
}


def judge(path: Path, before: Robot, ways: tuple[str, ...]) -> tuple[str, str]:
    """Reads a file; says what came of it."""
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            robot = load_robot(path)
    except OedError as error:
        text = str(error)
        return ("message", text[:300]) if "\n" not in text else ("traceback", f"unclear: {text!r}")
    except Exception:
        return "traceback", traceback.format_exc()[-1500:]
    foreign = [str(warning.message) for warning in caught if not issubclass(warning.category, UserWarning)]
    if foreign:
        return "traceback", f"warning: {foreign[0]}"
    known = {note for note in before.notes if not note.startswith("assumed")}
    notes = [note for note in robot.notes if note not in known and not note.startswith("assumed")]
    difference = _difference(robot, path)
    if difference is None or (notes and not _unlike(robot, before)):
        if notes:
            return "named", "; ".join(notes)[:300]
        changed = _unlike(robot, before) or path.read_bytes() != arm().encode()
        return ("silent", "no note") if changed and set(ways) & set(MISSPELT) else ("right", "")
    return ("named", f"{difference}; {notes}") if notes else ("silent", difference)


def _difference(robot: Robot, path: Path) -> str | None:
    """What pinocchio reads otherwise of the same file."""
    try:
        model = pin.buildModelFromUrdf(str(path))
    except Exception as error:
        return f"pinocchio refuses the file: {str(error)[:100]}"
    names = [name for name in robot.joint_names if model.existJointName(name)]
    if len(names) < robot.n:
        return "other joints"
    locked = [i for i in range(1, model.njoints) if model.names[i] not in names]
    model = pin.buildReducedModel(model, locked, pin.neutral(model))
    data = model.createData()
    q = np.linspace(0.3, 0.7, robot.n)
    configuration = pin.neutral(model)
    for name, value in zip(names, q, strict=True):
        joint = model.joints[model.getJointId(name)]
        entry = [value] if joint.nq == 1 else [np.cos(value), np.sin(value)]
        configuration[joint.idx_q : joint.idx_q + joint.nq] = entry
    pin.forwardKinematics(model, data, configuration)
    for i, name in enumerate(names):
        number = model.getJointId(name)
        pose, body, v = data.oMi[number].homogeneous, model.inertias[number], model.joints[number].idx_v
        pairs = (
            ("pose", robot.chain.transforms(q)[i], pose),
            ("body", robot.inertia[i], body.toDynamicParameters()[TO_OURS]),
            ("velocity", robot.limits.velocity[i], model.velocityLimit[v]),
            ("torque", robot.limits.torque[i], model.effortLimit[v]),
            ("friction", robot.friction[i, :2], [model.friction[v], model.damping[v]]),
        )
        for what, ours, theirs in pairs:
            if not np.allclose(ours, theirs, rtol=1e-9, atol=1e-9):
                return f"{what} of {name}: {np.round(ours, 4).tolist()} for {np.round(theirs, 4).tolist()}"
    return None


def _unlike(robot: Robot, before: Robot) -> bool:
    same = robot.joint_names == before.joint_names and np.allclose(robot.inertia, before.inertia)
    zero = np.zeros(before.n)
    return not (same and np.allclose(robot.chain.transforms(zero), before.chain.transforms(zero)))


def run_case(number: int, seed: int, folder: Path, before: Robot) -> dict[str, object]:
    """Spoils the file by one or two ways, and judges it."""
    rng = np.random.default_rng([seed, number])
    ways = tuple(rng.choice(list(WAYS), size=int(rng.integers(1, 3)), replace=False))
    text = arm()
    for way in ways:
        text = WAYS[way](text, rng)
    path = folder / f"case{number}.urdf"
    path.write_text(text, encoding="utf-8")
    result, detail = judge(path, before, ways)
    if result not in ("silent", "traceback"):
        path.unlink()
    return {"number": number, "ways": list(ways), "result": result, "detail": detail}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=None, help="one JSON object a case")
    options = parser.parse_args()
    done = []
    with tempfile.TemporaryDirectory() as folder, options.out.open("w") if options.out else nullcontext() as out:
        whole = Path(folder) / "whole.urdf"
        whole.write_text(arm(), encoding="utf-8")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            before = load_robot(whole)
        for number in range(options.cases):
            done.append(run_case(number, options.seed, Path(folder), before))
            if out is not None:
                print(json.dumps(done[-1]), file=out, flush=True)
    tally = Counter(case["result"] for case in done)
    print(f"{len(done)} cases: {dict(tally)}")
    for case in done:
        if case["result"] in ("silent", "traceback"):
            print(f"case {case['number']} ({', '.join(map(str, case['ways']))}): {case['result']}: {case['detail']}")
    return int(bool(tally["silent"] + tally["traceback"]))


if __name__ == "__main__":
    sys.exit(main())
