"""Pinocchio as an independent oracle of chains taken from URDF files, and random URDF files to ask it about."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

# pinocchio lists Iyy before Ixz; we list the upper triangle row by row
TO_OURS = [0, 1, 2, 3, 4, 5, 7, 6, 8, 9]


@dataclass
class Oracle:
    """A URDF in pinocchio, every joint but the named ones locked."""

    pin: ModuleType
    model: object
    names: Sequence[str]

    def transforms(self, q):
        """Poses (n, 4, 4) of the joint frames."""
        model = self.model
        data = model.createData()
        configuration = self.pin.neutral(model)
        for name, value in zip(self.names, q, strict=True):
            _set(model, configuration, name, value)
        self.pin.forwardKinematics(model, data, configuration)
        return np.array([data.oMi[model.getJointId(name)].homogeneous for name in self.names])

    def inertia(self):
        """Inertial parameters (n, 10) about the joint frames, in our order."""
        model = self.model
        rows = [model.inertias[model.getJointId(name)].toDynamicParameters() for name in self.names]
        return np.array(rows)[:, TO_OURS]


def _set(model, configuration, name, value):
    joint = model.joints[model.getJointId(name)]
    # pinocchio holds a continuous joint as the cosine and sine of its angle
    entry = [np.cos(value), np.sin(value)] if joint.nq == 2 else [value]
    configuration[joint.idx_q : joint.idx_q + joint.nq] = entry


@pytest.fixture
def oracle() -> Callable[..., Oracle]:
    pin = pytest.importorskip("pinocchio", reason="pinocchio is the oracle of these tests")

    def build(path: Path, names: Sequence[str], locked: Mapping[str, float] | None = None) -> Oracle:
        model = pin.buildModelFromUrdf(str(path))
        reference = pin.neutral(model)
        for name, value in (locked or {}).items():
            _set(model, reference, name, value)
        ids = [i for i in range(1, model.njoints) if model.names[i] not in names]
        return Oracle(pin, pin.buildReducedModel(model, ids, reference), names)

    return build


def _numbers(values) -> str:
    return " ".join(repr(float(value)) for value in values)


def _inertial(random: np.random.Generator) -> str:
    # A cloud of points has a physically consistent inertia whatever their places.
    points, mass = random.normal(scale=0.1, size=(8, 3)), random.uniform(0.2, 5.0)
    centred = points - points.mean(axis=0)
    second = mass * centred.T @ centred / len(points)
    inertia = np.trace(second) * np.eye(3) - second
    keys = [("ixx", 0, 0), ("ixy", 0, 1), ("ixz", 0, 2), ("iyy", 1, 1), ("iyz", 1, 2), ("izz", 2, 2)]
    entries = " ".join(f'{key}="{float(inertia[i, j])!r}"' for key, i, j in keys)
    pose = f'xyz="{_numbers(random.normal(scale=0.2, size=3))}" rpy="{_numbers(random.uniform(-3, 3, size=3))}"'
    return f'<inertial><origin {pose}/><mass value="{float(mass)!r}"/><inertia {entries}/></inertial>'


@pytest.fixture
def random_urdf(tmp_path: Path) -> Callable[[int], Path]:
    """Write a random tree of links: oblique axes, every kind of joint, branches, links without inertia."""

    def write(seed: int) -> Path:
        random = np.random.default_rng(seed)
        count = int(random.integers(6, 16))
        parts = [f'<robot name="random{seed}"><link name="l0">{_inertial(random)}</link>']
        for i in range(1, count):
            kind = str(random.choice(["revolute", "continuous", "prismatic", "fixed"]))
            parent = i - 1 if random.random() < 0.7 else int(random.integers(0, i))
            # The body behind a moving joint needs a mass; a link that is merged into another one does not.
            body = _inertial(random) if kind != "fixed" or random.random() < 0.6 else ""
            xyz, rpy = random.normal(scale=0.4, size=3), random.uniform(-np.pi, np.pi, size=3)
            parts.append(
                f'<link name="l{i}">{body}</link><joint name="j{i}" type="{kind}">'
                f'<parent link="l{parent}"/><child link="l{i}"/>'
                f'<origin xyz="{_numbers(xyz)}" rpy="{_numbers(rpy)}"/><axis xyz="{_numbers(random.normal(size=3))}"/>'
                '<limit lower="-2" upper="2" velocity="3" effort="50"/></joint>'
            )
        path = tmp_path / f"random{seed}.urdf"
        path.write_text("".join([*parts, "</robot>"]))
        return path

    return write


@pytest.fixture
def write_urdf(tmp_path: Path) -> Callable[[str], Path]:
    """Write a URDF with the given elements inside <robot>."""

    def write(body: str) -> Path:
        path = tmp_path / "test.urdf"
        path.write_text(f'<?xml version="1.0"?>\n<robot name="test">\n{body}\n</robot>\n')
        return path

    return write
