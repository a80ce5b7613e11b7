"""Drives of several runs against each other: false alarms, real changes, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2, f

from estimation.actuators import Actuators, DriveValue, MotionError
from estimation.comparisons import DriveComparison, compare_drives
from robots.common.errors import InputError

JOINTS = ("a", "b", "c", "d")
TRUE = {"armature": 0.02, "viscous": 0.3, "coulomb": 0.5, "kp": 20.0}
UNITS = {"armature": "kg m2", "viscous": "N m s/rad", "coulomb": "N m", "kp": "N m/rad"}


def result_of(
    seed: int, factors: dict[tuple[str, str], float] | None = None, *, scatter: float = 1.0, error: float = 0.01
) -> Actuators:
    """Gives drives whose values scatter by `scatter` times their standard errors about the truth times factors."""
    rng = np.random.default_rng(seed)
    values = []
    for parameter, true in TRUE.items():
        for joint in JOINTS:
            mean = true * (factors or {}).get((parameter, joint), (factors or {}).get((parameter, "all"), 1.0))
            value, deviation = mean + scatter * error * true * rng.standard_normal(), error * true
            values.append(
                DriveValue(
                    parameter=parameter,
                    group=joint,
                    joints=(joint,),
                    value=value,
                    standard_error=deviation,
                    lower=value - 1.96 * deviation,
                    upper=value + 1.96 * deviation,
                    unit=UNITS[parameter],
                    described=true,
                    status="identified",
                )
            )
    return Actuators(
        robot="arm",
        joints=JOINTS,
        law=("pd",) * 4,
        values=({},) * 4,
        parameters=tuple(values),
        errors=tuple(
            MotionError(name=j, described=1, fitted=1e-3, held_out_described=1, held_out=1e-3) for j in JOINTS
        ),
        findings=(),
        notes=(),
        held_out="held-out logs",
        provenance={"logs": [{"name": f"log{seed}", "sha256": f"{seed}", "samples": 100, "start": 0.0}]},
    )


def test_runs_that_agree_rarely_differ() -> None:
    """Of 300 comparisons of three equal runs about one in a hundred reports a difference, also if errors are small.

    The stated rate of false alarms is 1 %, at which seven or more of 300 have a probability of 3 %.
    """
    for scatter in (1.0, 3.0):
        alarms = sum(
            bool(compare_drives([result_of(3 * k + i, scatter=scatter) for i in range(3)]).different)
            for k in range(300)
        )
        assert alarms <= 6


@pytest.mark.parametrize("scatter", [1.0, 3.0])
def test_statistics_are_cochrans(scatter: float) -> None:
    """Two runs give (x - y)^2 / (s^2 + s^2), over what all runs scatter: chi-square, or F where that is estimated."""
    one, two = result_of(1, scatter=scatter), result_of(2, scatter=scatter)
    compared = compare_drives([one, two])
    x, y = one.value("coulomb", "b"), two.value("coulomb", "b")
    (item,) = [item for item in compared.differences if item.name == "coulomb b"]
    expected = (x.value - y.value) ** 2 / (x.standard_error**2 + y.standard_error**2) / compared.spread**2
    assert item.statistic == pytest.approx(expected)
    assert (compared.spread > 1) == (scatter > 1)
    tail = f.sf(expected, 1, 0.37 * 16) if scatter > 1 else chi2.sf(expected, 1)
    assert item.p_value == pytest.approx(tail)
    assert item.common == pytest.approx((x.value + y.value) / 2)


def test_a_change_of_all_joints_and_one_of_a_single_joint() -> None:
    """Viscous friction that falls by a fifth everywhere is one statement; an armature that differs alone another."""
    warm = result_of(2, {("viscous", "all"): 0.8, ("armature", "c"): 1.3})
    compared = compare_drives([result_of(1), warm], ["cold", "warm"])
    (change,) = compared.shared
    assert (change.parameter, change.joints) == ("viscous", 4)
    assert change.lower < -0.2 < change.upper
    assert [item.name for item in compared.alone] == ["armature c"]
    assert "temperature" in compared.conclusion
    again = DriveComparison.from_dict(compared.to_dict())
    assert again.summary() == compared.summary()
    assert len(compared.to_frame()) == 16
    assert compared.plot().get_ylabel().startswith("deviation")


def test_what_cannot_be_compared_is_refused() -> None:
    """One result, other joints, other laws and two results of one log are each one message."""
    one, two = result_of(1), result_of(2)
    with pytest.raises(InputError, match="1 result to compare; allowed: two or more"):
        compare_drives([one])
    with pytest.raises(InputError, match="other has the joints a, b, c, e"):
        compare_drives([one, replace(two, joints=("a", "b", "c", "e"))], ["first", "other"])
    with pytest.raises(InputError, match="other control laws"):
        compare_drives([one, replace(two, law=("servo",) * 4)])
    with pytest.raises(InputError, match="from the same log log1"):
        compare_drives([one, result_of(1)])
    open_ = tuple(replace(value, status="not determined") for value in two.parameters)
    with pytest.raises(InputError, match="no parameter is determined in all runs"):
        compare_drives([one, replace(two, parameters=open_)])
