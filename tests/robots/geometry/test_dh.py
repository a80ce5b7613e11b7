"""Chains from Denavit-Hartenberg tables."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robots.common.errors import InputError
from robots.geometry.chain import homogeneous
from robots.geometry.dh import DhRow, chain_from_dh, dh_frames


def elementary(axis, angle=0.0, shift=0.0):
    vector = np.eye(3)["xyz".index(axis)]
    return homogeneous(Rotation.from_rotvec(angle * vector).as_matrix(), shift * vector)


def textbook(rows, convention, q):
    """Frames i of the table straight from the definition."""
    frames, pose = [], np.eye(4)
    for row, value in zip(rows, q, strict=True):
        angle, slide = (value, 0.0) if row.kind == "revolute" else (0.0, value)
        about_z = elementary("z", row.offset + angle) @ elementary("z", shift=row.d + slide)
        about_x = elementary("x", row.alpha) @ elementary("x", shift=row.a)
        pose = pose @ (about_x @ about_z if convention == "modified" else about_z @ about_x)
        frames.append(pose)
    return np.array(frames)


def random_rows(seed):
    random = np.random.default_rng(seed)
    kinds = ["revolute", "prismatic", "revolute", "prismatic", "revolute"]
    return [
        DhRow(kind=kind, **dict(zip(("alpha", "a", "d", "offset"), random.normal(size=4), strict=True)))
        for kind in kinds
    ]


@pytest.mark.parametrize("convention", ["modified", "standard"])
@pytest.mark.parametrize("seed", range(5))
def test_the_frames_are_those_of_the_table(convention, seed):
    """Link frames, followed by the pose of frame i on link i, are the table's frames; so is the flange."""
    rows = random_rows(seed)
    q = np.random.default_rng(100 + seed).normal(size=5)
    chain = chain_from_dh(rows, convention)
    expected = textbook(rows, convention, q)
    # 1e-14: five products of matrices with entries up to some 5
    np.testing.assert_allclose(chain.transforms(q) @ dh_frames(rows, convention), expected, atol=1e-14)
    np.testing.assert_allclose(chain.flange(q), expected[-1], atol=1e-14)


@pytest.mark.parametrize("convention", ["modified", "standard"])
def test_the_link_frame_lies_on_the_joints_own_axis(convention):
    """In either convention a link's z axis is its joint's axis: the joint's own motion does not move it."""
    rows = random_rows(7)
    chain = chain_from_dh(rows, convention)
    q = np.linspace(0.1, 0.5, 5)
    for i in range(5):
        moved = q.copy()
        moved[i] += 0.3
        before, after = chain.transforms(q)[i], chain.transforms(moved)[i]
        np.testing.assert_allclose(after[:3, 2], before[:3, 2], atol=1e-15)
        across = np.cross(after[:3, 3] - before[:3, 3], before[:3, 2])
        np.testing.assert_allclose(across, 0.0, atol=1e-15)


def test_base_and_flange_come_before_and_after():
    """The base pose comes before the first frame and the flange pose after the last one."""
    rows, q = random_rows(8), np.zeros(5)
    base, flange = elementary("y", 0.3, 0.2), elementary("x", -0.4, 0.1)
    moved = chain_from_dh(rows, "standard", base=base, flange=flange).flange(q)
    np.testing.assert_allclose(moved, base @ textbook(rows, "standard", q)[-1] @ flange, atol=1e-14)


def test_joints_have_names():
    """Joints are called J1, J2, ... unless the table names them."""
    assert chain_from_dh([DhRow(), DhRow(name="wrist")], "modified").names == ("J1", "wrist")


def test_a_wrong_table_is_refused():
    """An unknown convention and a row that is not finite are refused, the latter by its joint."""
    with pytest.raises(InputError, match="unknown convention 'craig'; allowed: standard or modified"):
        chain_from_dh([DhRow()], "craig")
    with pytest.raises(InputError, match="joint 2: the Denavit-Hartenberg row is not finite"):
        chain_from_dh([DhRow(), DhRow(a=np.nan)], "modified")
