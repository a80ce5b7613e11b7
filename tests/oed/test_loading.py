"""Saved results are read back by one loader, and other files are refused by file, entry and remedy."""

from __future__ import annotations

import json
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import oed
from estimation.external_forces.localisation import Localiser
from estimation.external_forces.result import ForceEstimate
from estimation.external_forces.thresholds.alarm_rates import AlarmThreshold
from estimation.external_forces.thresholds.calibrations import Calibration
from estimation.external_forces.thresholds.error_models import ErrorModel
from estimation.external_forces.thresholds.rate_checks import RateCheck
from estimation.monitoring.fleets import FleetResult, RobotRow
from estimation.payloads import PayloadEstimate
from oed.loading import LOADERS
from robots import InputError
from robots.common.records import Result
from tests.oed.reports.pages.test_pages_in_browser import forces, monitored, payload, prediction


def calibrated() -> ForceEstimate:
    """Forces with the calibration of a healthy log."""
    errors = ErrorModel(**{item.name: np.ones(2) for item in fields(ErrorModel)} | {"correlation": np.eye(2)})
    threshold = AlarmThreshold(
        value=9.0, rate=1.0, base=3.0, excess=1.0, peaks=25, separation=0.1, extremal_index=0.5, seconds=43.0
    )
    calibration = Calibration(
        bandwidth=20.0,
        velocity="smoothed",
        period=0.01,
        errors=errors,
        threshold=threshold,
        localiser=Localiser(joint=np.ones(2), link=np.ones(2), tool=1.0),
        friction_square=np.ones(2),
        check=RateCheck(alarms=1, hours=0.5, rate=1.0),
    )
    return replace(forces(), calibration=calibration)


def fleet() -> FleetResult:
    return FleetResult(rows=(RobotRow.of("robot 7", monitored()), RobotRow(name="x", light="green", text="-")))


@pytest.mark.parametrize("make", [monitored, fleet, calibrated, payload])
def test_a_result_is_the_same_when_it_is_loaded(make: Any, tmp_path: Path) -> None:
    """What a result states and its table are the same before and after its files."""
    before: Any = make()
    before.save(tmp_path)
    after = oed.load(tmp_path)
    assert type(after) is type(before)
    assert after.to_dict() == before.to_dict()
    assert after.summary() == before.summary()
    np.testing.assert_allclose(
        after.to_frame().select_dtypes("number").to_numpy(float),
        before.to_frame().select_dtypes("number").to_numpy(float),
        rtol=1e-12,
        atol=1e-12,  # Percentages are logarithms in memory.
    )


@pytest.mark.parametrize("make", [monitored, fleet, calibrated, prediction])
def test_it_can_be_drawn(make: Any) -> None:
    """A plot has something drawn, and names its axes with units."""
    axes = make().plot()
    assert axes.lines or axes.patches
    assert axes.get_ylabel()


def test_a_prediction_names_the_joints_there_are() -> None:
    with pytest.raises(InputError, match="1 to 2"):
        prediction().plot(joint=3)


def _written(folder: Path, **changes: Any) -> Path:
    payload().save(folder)
    file = folder / PayloadEstimate.FILE
    data = json.loads(file.read_text()) | changes
    file.write_text(json.dumps({key: value for key, value in data.items() if value != "left out"}))
    return file


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"format": "robot-oed unheard of"}, "format"),
        ({"format": "left out"}, "format"),
        ({"format_version": 99}, "99"),
        ({"rows": "left out"}, "rows"),
        ({"rows": "many"}, "rows"),
        ({"joints": "left out"}, "joints"),
    ],
)
def test_another_file_is_refused(changes: dict[str, Any], words: str, tmp_path: Path) -> None:
    """A foreign, newer, older or damaged file is refused by its name and entry."""
    file = _written(tmp_path, **changes)
    with pytest.raises(InputError) as caught:
        oed.load(file)
    assert words in str(caught.value)
    assert file.name in str(caught.value)


def test_what_is_not_there_or_no_result(tmp_path: Path) -> None:
    """A missing file, an empty folder and a file that is no JSON say what to give."""
    (tmp_path / "text.json").write_text("no JSON")
    for path in (tmp_path / "nothing", tmp_path, tmp_path / "text.json"):
        with pytest.raises(InputError, match="give a result of oed"):
            oed.load(path)


def test_a_file_of_an_earlier_version_names_what_it_lacks(tmp_path: Path) -> None:
    """`monitor.json` without the joints' names: the entry, the file and the remedy."""
    monitored().save(tmp_path)
    file = tmp_path / "monitor.json"
    data = json.loads(file.read_text())
    del data["joint_names"]
    file.write_text(json.dumps(data))
    with pytest.raises(InputError, match=r"joint_names.*oed monitor"):
        oed.load(tmp_path)


def test_every_format_has_a_loader_or_a_reason() -> None:
    """No result with a format is forgotten."""
    from oed.loading import ELSEWHERE, _named

    for path in LOADERS.values():
        assert callable(_named(path))

    def below(kind: type) -> list[type]:
        return [item for own in kind.__subclasses__() for item in (own, *below(own))]

    import oed.campaigns.discriminations.discrimination
    import oed.experiments.pareto_fronts  # noqa: F401

    kinds = [kind for kind in below(Result) if not kind.__module__.startswith("tests")]
    assert {kind.FORMAT for kind in kinds if kind.FORMAT} <= {*LOADERS, *ELSEWHERE}
