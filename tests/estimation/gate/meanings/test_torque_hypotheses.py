"""Specification of the odds of torque columns: what a wrong description explains is no other meaning."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimation.gate.meanings.described import FACTORS, STEP, JointEvidence
from estimation.gate.meanings.hypotheses import hypotheses


def evidence_of(joint: int, factor: float, *, described: float = 1000.0, multiple: float = 1000.0) -> JointEvidence:
    """Gives a joint whose torque fits the described one at a factor, known to 5 %."""
    factors = np.arange(*np.log(FACTORS), STEP)
    fit = -0.5 * ((factors - np.log(factor)) / 0.05) ** 2
    return JointEvidence(
        joint=joint,
        factors=factors,
        described=described + fit,
        inverted=0.0,
        multiple=multiple + fit,
        weightless=0.0,
        external=0.0,
        size=factor,
        friction=0.1,
    )


def test_each_joint_may_be_described_wrong_by_its_own_factor(er3a):
    """A fit of 0.7 and of 1.4 times the description does not make currents or signs likely."""
    best = hypotheses(er3a, [evidence_of(0, 0.7), evidence_of(1, 1.4), evidence_of(2, 1.0)])[0]
    assert best.odds < 4.0


@pytest.mark.parametrize(("factor", "kind"), [(1 / 20, "current"), (54.0, None), (1000.0, "unit")])
def test_a_current_on_one_joint_is_smaller_than_the_torque(er3a, factor, kind):
    """Beside torques of other joints, a column is a current [A] or in another unit, but no other multiple."""
    others = [evidence_of(joint, 1.0) for joint in range(5)]
    far = evidence_of(5, factor, multiple=25.0)
    far = replace(far, described=np.zeros_like(far.factors))
    best = hypotheses(er3a, [*others, far])[0]
    assert (best.kind if best.odds > 8.0 else None) == kind
    assert best.joints == (5,) or kind is None
    assert best.unit == (factor if kind == "unit" else None)


def test_all_joints_may_have_any_unit(er3a):
    """Milliamperes are larger than torques, with a factor of their own at each joint."""
    found = [
        evidence_of(joint, factor, described=0.0, multiple=50.0) for joint, factor in enumerate((20.0, 45.0, 80.0))
    ]
    best = hypotheses(er3a, found)[0]
    assert best.kind == "current"
    assert best.joints == (0, 1, 2)
