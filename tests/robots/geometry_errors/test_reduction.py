"""Minimal sets and Denavit-Hartenberg tables."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from robots import load_robot
from robots.geometry_errors import (
    BodyPoses,
    GeometryModel,
    MeasuredPoses,
    error_term,
    random_positions,
    reduce_columns,
)
from robots.geometry_errors.arm import ErroneousArm
from robots.geometry_errors.dh_extraction import dh_table
from robots.loading import CATALOG

KINDS = tuple(error_term(kind) for kind in ("joint_zero", "link_placement"))


def scaled(robot, q):
    """Scaled Jacobian of poses, and the groups of its columns."""
    observed = np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (len(q), 1))
    model = GeometryModel([robot], KINDS, MeasuredPoses(q=q, measurement=BodyPoses(), observed=observed))
    setup = BodyPoses().example
    parameters = model.parameters(setup)
    scale = np.array([item.scale for item in parameters])
    matrix = (model.evaluate(np.zeros(len(model.errors)), setup).jacobian * scale).reshape(-1, len(scale))
    kinds = dict.fromkeys(["setup", *(item.kind for item in parameters)])
    groups = [[k for k, item in enumerate(parameters) if item.kind == kind] for kind in kinds]
    return matrix, groups, parameters


@pytest.mark.parametrize("name", ["ur10", "panda"])
def test_rank_is_that_of_pinocchio(name):
    """As many parameters are independent as the frame Jacobians of pinocchio have singular values beyond rounding."""
    robot = load_robot(name)
    q = random_positions(robot, 30, seed=1)
    matrix, groups, _ = scaled(robot, q)
    full = pin.buildModelFromUrdf(str(CATALOG / f"{name}.urdf"))
    lock = [full.getJointId(joint) for joint in full.names[1:] if joint not in robot.joint_names]
    model = pin.buildReducedModel(full, lock, pin.neutral(full))
    data, rows = model.createData(), []
    for x in q:
        index = [[np.cos(v), np.sin(v)] if model.joints[j + 1].nq == 2 else [v] for j, v in enumerate(x)]
        pin.forwardKinematics(model, data, np.concatenate(index))
        end = data.oMi[model.njoints - 1]
        # Six columns for each joint's placement: unit twists of its frame before it turns, seen from the last link.
        blocks = [end.toActionMatrixInverse()]
        for joint in range(1, model.njoints):
            before = data.oMi[model.parents[joint]] * model.jointPlacements[joint]
            blocks.append((end.inverse() * before).toActionMatrix())
        rows.append(np.hstack([*blocks, np.eye(6)]))
    values = np.linalg.svd(np.vstack(rows), compute_uv=False)
    # Singular values are either above a hundredth of the largest or rounding.
    assert reduce_columns(matrix, groups).rank == int((values > 1e-8 * values[0]).sum())


def test_parallel_axes_lose_their_common_shifts():
    """Of three parallel joints only one shift along the axes is kept (Hayati 1983)."""
    robot = load_robot("ur10")
    matrix, groups, parameters = scaled(robot, random_positions(robot, 40, seed=2))
    kept = {parameters[k].name for k in reduce_columns(matrix, groups).kept}
    # The axes of joints 2, 3 and 4 are along y.
    assert len(kept & {"link_2_y", "link_3_y", "link_4_y"}) == 1


def test_nearly_parallel_axes_keep_the_set_well_conditioned():
    """Turned by 0.1 mrad, the same number of parameters is kept, and the set stays well conditioned."""
    robot = load_robot("ur10")
    arm = ErroneousArm(robot=robot, terms=KINDS)
    from dataclasses import replace

    tilted = replace(robot, chain=arm.corrected_chain({"link_3_rx": 1e-4, "link_4_rz": -1e-4}))
    q = random_positions(robot, 40, seed=2)
    exact, groups, _ = scaled(robot, q)
    near, _, _ = scaled(tilted, q)
    conditions = []
    for matrix in (exact, near):
        kept = list(reduce_columns(matrix, groups).kept)
        conditions.append((len(kept), np.linalg.cond(matrix[:, kept] / np.linalg.norm(matrix[:, kept], axis=0))))
    assert conditions[0][0] == conditions[1][0]
    # Choosing a nearly redundant column would make it 1e4.
    assert conditions[1][1] < 3.0 * conditions[0][1]


def test_dropped_columns_are_combinations_of_kept_ones():
    """The stated combination gives each dropped column."""
    robot = load_robot("panda")
    matrix, groups, _ = scaled(robot, random_positions(robot, 40, seed=2))
    found = reduce_columns(matrix, groups)
    rebuilt = matrix[:, list(found.kept)] @ found.combination
    # Columns are of size one to a thousand.
    np.testing.assert_allclose(rebuilt, matrix[:, list(found.dropped)], atol=1e-8)


@pytest.mark.parametrize("name", ["ur10", "panda", "er3a"])
@pytest.mark.parametrize("convention", ["modified", "standard"])
@pytest.mark.parametrize("size", [0.0, 1.0])
def test_tables_give_the_flange_of_the_chain(name, convention, size):
    """A table of a nominal arm and of one with errors has the flange where the chain has it, to rounding."""
    robot = load_robot(name)
    rng = np.random.default_rng(3)
    names = [f"link_{i + 1}_{axis}" for i in range(robot.n) for axis in ("x", "y", "z", "rx", "ry", "rz")]
    errors = {item: size * 1e-3 * rng.standard_normal() for item in names}
    chain = ErroneousArm(robot=robot, terms=KINDS).corrected_chain(errors)
    table = dh_table(chain, convention)
    q = random_positions(robot, 10, seed=1)
    # Products of ten matrices with lengths of a metre.
    np.testing.assert_allclose(table.flange_pose(q), chain.flange(q), atol=1e-12)
    if size == 0.0:
        assert all(row.beta == 0.0 for row in table.rows)
