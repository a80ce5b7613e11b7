"""The usual fit beside which ours is measured: finite differences or CMA-ES over MuJoCo rollouts."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

Array = NDArray[np.float64]

STEP = 1e-3
CLASSES = ("hip", "thigh", "calf")
KP, KD = 20.0, 1.5


class Rollouts:
    """The Go2 on its stand in MuJoCo, with PD drives.

    Args:
        file: the MJCF; its base is held.
    """

    def __init__(self, file: Path) -> None:
        root = ElementTree.parse(file).getroot()
        for body in root.iter("body"):
            for free in body.findall("freejoint"):
                body.remove(free)
        for section in root.findall("keyframe"):
            root.remove(section)
        option = root.find("option")
        assert option is not None
        option.set("timestep", repr(STEP))
        option.set("integrator", "implicitfast")
        ElementTree.SubElement(option, "flag", contact="disable", limit="disable")
        for actuator in root.findall("actuator"):
            for motor in actuator:
                motor.tag = "position"
                motor.attrib.pop("class")
                limit = "45.43" if "calf" in motor.get("name", "") else "23.7"
                motor.attrib.update(kp=repr(KP), kv=repr(KD), ctrllimited="false", forcerange=f"-{limit} {limit}")
        self.model = mujoco.MjModel.from_xml_string(ElementTree.tostring(root, encoding="unicode"))
        self.data = mujoco.MjData(self.model)
        names = [self.model.joint(j).name for j in range(self.model.njnt)]
        self.kinds = np.array([next(k for k, part in enumerate(CLASSES) if f"_{part}_" in name) for name in names])
        self.count = 0

    def play(self, theta: Array, t: Array, command: Array, q: Array) -> Array:
        """Simulates a run with armature, damping and friction of three classes, a delay, and twelve encoder zeros."""
        model, data, zero = self.model, self.data, theta[10:]
        model.dof_armature[:] = np.maximum(theta[:3][self.kinds], 0)
        model.dof_damping[:] = np.maximum(theta[3:6][self.kinds], 0)
        model.dof_frictionloss[:] = np.maximum(theta[6:9][self.kinds], 0)
        mujoco.mj_resetData(model, data)
        data.qpos[:] = q[0] - zero
        data.qvel[:] = (q[3] - q[0]) / (t[3] - t[0])
        found = np.empty_like(q)
        steps = round(float(np.median(np.diff(t))) / STEP)
        for k in range(len(t)):
            found[k] = data.qpos + zero
            for s in range(steps):
                at = np.clip(np.searchsorted(t, t[k] + s * STEP - theta[9], side="right") - 1, 0, None)
                data.ctrl[:] = command[at] - zero
                mujoco.mj_step(model, data)
        self.count += 1
        return found


NOMINAL = np.concatenate([np.full(3, 0.01), np.full(3, 0.6), np.full(3, 0.2), [0.002], np.zeros(12)])
SIZES = np.concatenate([np.full(3, 0.01), np.full(3, 0.1), np.full(3, 0.1), [0.005], np.full(12, 0.02)])


def by_differences(rollouts: Rollouts, t: Array, command: Array, q: Array) -> Array:
    """Fits by least squares with finite differences."""

    def residual(x: Array) -> Array:
        return (rollouts.play(NOMINAL + x * SIZES, t, command, q) - q).ravel()

    lower = np.concatenate([-NOMINAL[:10], np.full(12, -0.3)]) / SIZES
    found = least_squares(residual, np.zeros(22), bounds=(lower - 1e-9, np.inf), diff_step=1e-2, max_nfev=15)
    return NOMINAL + found.x * SIZES


def by_cma(cost: Callable[[Array], float], size: int, evaluations: int, seed: int) -> Array:
    """Minimises by a plain CMA-ES (Hansen 2016, rank-mu and rank-one updates), from zero with unit deviation."""
    rng = np.random.default_rng(seed)
    many = 4 + int(3 * np.log(size))
    half = many // 2
    weights = np.log(half + 0.5) - np.log(np.arange(1, half + 1))
    weights /= weights.sum()
    effective = 1 / (weights**2).sum()
    sigma_rate, damping = (effective + 2) / (size + effective + 5), 0.0
    damping = 1 + 2 * max(0.0, np.sqrt((effective - 1) / (size + 1)) - 1) + sigma_rate
    path_rate = (4 + effective / size) / (size + 4 + 2 * effective / size)
    one = 2 / ((size + 1.3) ** 2 + effective)
    mu = min(1 - one, 2 * (effective - 2 + 1 / effective) / ((size + 2) ** 2 + effective))
    expected = np.sqrt(size) * (1 - 1 / (4 * size) + 1 / (21 * size**2))
    mean, sigma, C = np.zeros(size), 1.0, np.eye(size)
    path_sigma, path = np.zeros(size), np.zeros(size)
    best: tuple[float, Array] = (np.inf, mean)
    done = 0
    while done < evaluations:
        values, vectors = np.linalg.eigh(C)
        root = vectors * np.sqrt(np.maximum(values, 1e-20))
        drawn = rng.standard_normal((many, size)) @ root.T
        costs = np.array([cost(mean + sigma * step) for step in drawn])
        done += many
        order = np.argsort(costs)[:half]
        if costs[order[0]] < best[0]:
            best = float(costs[order[0]]), mean + sigma * drawn[order[0]]
        step = weights @ drawn[order]
        mean = mean + sigma * step
        whitened = vectors @ ((vectors.T @ step) / np.sqrt(np.maximum(values, 1e-20)))
        path_sigma = (1 - sigma_rate) * path_sigma + np.sqrt(sigma_rate * (2 - sigma_rate) * effective) * whitened
        path = (1 - path_rate) * path + np.sqrt(path_rate * (2 - path_rate) * effective) * step
        C = (1 - one - mu) * C + one * np.outer(path, path) + mu * (drawn[order].T * weights) @ drawn[order]
        sigma *= np.exp(sigma_rate / damping * (np.linalg.norm(path_sigma) / expected - 1))
    return best[1]
