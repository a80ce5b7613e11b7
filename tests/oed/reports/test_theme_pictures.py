from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from oed.reports import (
    error_bars_picture,
    friction_picture,
    margins_picture,
    parameter_picture,
    residual_picture,
    save_png,
    spectrum_picture,
    to_plotly,
    torque_picture,
    trajectory_picture,
)
from robots.common.errors import InputError
from robots.limits import Limits, Margin


@pytest.mark.slow
def test_all_pictures_are_drawn_by_both_libraries(case: Any, tmp_path: Path) -> None:
    """Robots of one and of more joints, gaps in the torque and a prismatic joint included, can be drawn."""
    for picture in case.pictures():
        assert len(to_plotly(picture).data) >= len(picture.panels)
        save_png(picture, tmp_path / f"{picture.name}.png", dpi=40)
        assert (tmp_path / f"{picture.name}.png").stat().st_size > 2000


def test_prismatic_joints_are_in_metres(case: Any) -> None:
    """A prismatic joint is shown in m, m/s, m/s² and N, a revolute one in rad or, on request, in degrees."""
    m = case.motion
    picture = trajectory_picture(m.t, m.q, m.dq, m.ddq, kinds=["prismatic"] * case.n)
    assert [panel.y_label for panel in picture.panels[:3]] == [
        "position [m]",
        "velocity [m/s]",
        "acceleration [m/s²]",
    ]
    torque = torque_picture(m.t, case.measured, case.predicted, kinds=["prismatic"] * case.n)
    assert torque.panels[0].y_label == "force [N]"
    turned = trajectory_picture(m.t, m.q, m.dq, m.ddq, degrees=True)
    assert [panel.y_label for panel in turned.panels[:3]] == [
        "position [°]",
        "velocity [°/s]",
        "acceleration [°/s²]",
    ]
    np.testing.assert_allclose(turned.panels[1].series[0].y, np.rad2deg(m.dq[:, 0]))


def test_limits_near_are_drawn_and_limits_far_are_named() -> None:
    """A limit within 2.5 times the largest value is a line, one beyond is a note, an infinite one is neither."""
    t = np.linspace(0.0, 1.0, 11)
    wave = np.sin(2 * np.pi * t)[:, None]
    limits = Limits([-2.0], [2.0], [50.0], [np.inf], [np.inf], [np.inf])
    position, velocity, acceleration = trajectory_picture(t, wave, wave, wave, limits=limits).panels
    assert [line.value for line in position.lines] == [-2.0, 2.0]
    assert position.y_range is not None
    assert position.y_range[0] < -2.0 < 2.0 < position.y_range[1]
    assert (velocity.lines, velocity.note) == ((), "limit ±50.0")
    assert (acceleration.lines, acceleration.note) == ((), "")


def test_motionless_joints_have_an_axis() -> None:
    """A joint that stands still has an axis of finite length."""
    zero = np.zeros((5, 1))
    for panel in trajectory_picture(np.arange(5.0), zero, zero, zero).panels:
        assert panel.y_range is not None
        assert panel.y_range[0] < 0.0 < panel.y_range[1]


def test_neighbouring_segments_of_one_kind_are_one_stripe(six: Any) -> None:
    """The two friction segments that follow each other become one stripe of the shading."""
    spans = six.pictures()[0].panels[0].spans
    assert [(span.label, span.start, span.end) for span in spans] == [
        ("approach", 0.0, 2.0),
        ("fourier", 2.0, 42.0),
        ("friction", 42.0, 60.0),
    ]


def test_margins_show_the_use_of_each_limit() -> None:
    """Half of a velocity limit is 50 %, the middle of a range 0 %, a quarter from its end 50 %; no limit is no bar."""

    def margin(quantity: str, joint: int, value: float, limit: float, slack: float) -> Margin:
        return Margin(quantity=quantity, joint=joint, value=value, limit=limit, time=1.0, slack_fraction=slack)

    panel = margins_picture(
        [
            margin("lower", 1, 0.0, -1.0, 0.5),
            margin("upper", 1, 0.5, 1.0, 0.25),
            margin("lower", 2, 0.0, -1.0, 0.5),
            margin("upper", 2, 0.0, 1.0, 0.5),
            margin("velocity", 1, -1.0, 2.0, 0.5),
            margin("velocity", 2, 1.0, 0.0, -np.inf),
            margin("jerk", 1, 1.0, np.inf, 1.0),
        ]
    ).panels[0]
    bars = {series.name: series.y for series in panel.series}
    assert set(bars) == {"position", "velocity"}
    np.testing.assert_allclose(bars["position"], [50.0, 0.0])
    np.testing.assert_allclose(bars["velocity"], [50.0, 300.0])
    with pytest.raises(InputError):
        margins_picture([])


def test_spectrum_says_the_condition_number() -> None:
    """Singular values are sorted, their ratio stands in the legend, and a zero makes it infinite."""
    series = spectrum_picture({"a": [1.0, 10.0, 5.0], "b": [1.0, 0.0]}).panels[0].series
    assert [series[0].name, series[1].name] == ["a (cond 10.0)", "b (cond ∞)"]
    assert list(series[0].y) == [10.0, 5.0, 1.0]


def test_torque_titles_tell_the_error_in_spite_of_gaps() -> None:
    """RMS and share of the residual leave out the samples without a measurement."""
    measured = np.array([[2.0], [np.nan], [-2.0]])
    picture = torque_picture([0.0, 1.0, 2.0], measured, np.array([[1.0], [5.0], [-1.0]]))
    assert picture.panels[1].title == "Joint 1 residual: 1.00 N m RMS (50.0 % of the torque)"


def test_torque_band_is_drawn_about_the_prediction() -> None:
    """A joint's band lies about its predicted torque and about a residual of zero; a joint without one has none."""
    torque = np.zeros((3, 2))
    panels = torque_picture([0.0, 1.0, 2.0], torque, torque, band=[0.5, np.nan]).panels
    assert list(panels[0].series[1].error) == [0.5, 0.5, 0.5]
    band = panels[1].series[0]
    assert set(band.y) == {0.0}
    assert set(band.error) == {0.5}
    assert (band.x[0], band.x[-1]) == (0.0, 2.0)
    assert panels[2].series[1].error is None
    assert [series.name for series in panels[3].series] == ["residual"]
    with pytest.raises(InputError, match="band"):
        torque_picture([0.0, 1.0, 2.0], torque, torque, band=[0.5])


def test_lines_and_bands_end_at_pauses() -> None:
    """Between two logs, and where a clock goes back, neither line nor band is drawn."""
    t = np.concatenate([0.01 * np.arange(100), 50.0 + 0.01 * np.arange(100), 0.01 * np.arange(100)])
    torque = np.ones((300, 1))
    measured, predicted = torque_picture(t, torque, torque, band=[0.5]).panels[0].series
    for series in (measured, predicted):
        assert list(np.flatnonzero(np.isnan(series.y))) == [100, 201]
    ribbon = next(trace for trace in to_plotly(torque_picture(t, torque, torque, band=[0.5])).data if trace.fill)
    assert np.count_nonzero(np.isnan(ribbon.y)) == 3  # each stretch is an outline of its own


def test_rows_without_a_prediction_are_said() -> None:
    """A predicted line that ends has its share in the panel and its reason in the caption."""
    predicted = np.array([[1.0], [1.0], [np.nan], [np.nan]])
    picture = torque_picture([0.0, 1.0, 2.0, 3.0], np.ones((4, 1)), predicted, why_gaps="in rows at rest")
    assert picture.panels[0].note == "50 % not predicted"
    assert "has gaps in rows at rest." in picture.caption


def test_bars_that_would_flatten_the_others_are_stated() -> None:
    """A rival with errors five times as large as all others stands in the caption; a near one is drawn."""
    picture = error_bars_picture({"fit": [0.02]}, rivals={"constant": [0.9], "description": [0.06]})
    assert [series.name for series in picture.panels[0].series] == ["fit", "description"]
    assert "constant (90 to 90 %)" in picture.caption


@pytest.mark.slow
def test_residual_of_nothing_is_said_to_be_nothing() -> None:
    """A joint without measurements, and one without error, are drawn all the same."""
    residual = np.column_stack([np.full(500, np.nan), np.zeros(500)])
    picture = residual_picture(residual, np.ones((500, 2)), period=0.004)
    assert [picture.panels[index].note for index in (0, 2)] == ["no data", "no data"]
    to_plotly(picture)


def test_parameters_are_grouped_by_unit() -> None:
    """Each unit has a panel, bars carry 1.96 standard errors, and the hover text has the whole name."""
    name = "Ixx_2 - Iyy_2 + 0.432 mPx_3"
    picture = parameter_picture([name, "m_1", "Izz_1"], [1.0, 2.0, 3.0], [0.1, 0.2, np.nan], ["kg m²", "kg", "kg m²"])
    assert [panel.y_label for panel in picture.panels] == ["value [kg m²]", "value [kg]"]
    bars = picture.panels[0].series[0]
    np.testing.assert_allclose(bars.error, [0.1959964, 0.0])
    assert bars.texts[0] == f"{name}: 1.00 ± 0.10 kg m²"
    assert len(picture.panels[0].categories[0]) <= 14
    with pytest.raises(InputError):
        parameter_picture(["a"], [1.0, 2.0], [0.1], ["kg"])


def test_friction_is_the_polynomial_with_a_gap_at_rest() -> None:
    """The curve is f1 sign(dq) + f2 dq + f3 dq|dq| + f4 dq^3, broken at rest; the ribbon is 1.96 sigma wide."""
    f = np.array([[3.0, 2.0, 1.0, 0.5]])
    curve = friction_picture(f, [2.0], covariances=np.diag([0.04, 0, 0, 0])[None]).panels[0].series[0]
    assert curve.y[0] == pytest.approx(-(3 + 4 + 4 + 4))
    assert curve.y[-1] == pytest.approx(3 + 4 + 4 + 4)
    assert np.isnan(curve.y[curve.x == 0.0]).all()
    assert curve.error is not None
    assert curve.error[-1] == pytest.approx(1.959964 * 0.2)


def test_errors_are_in_percent() -> None:
    """NRMSE fractions and reference levels are shown in percent."""
    panel = error_bars_picture({"after": [0.02, 0.03]}, references={"target": 0.05}).panels[0]
    np.testing.assert_allclose(panel.series[0].y, [2.0, 3.0])
    assert panel.lines[0].value == pytest.approx(5.0)


def test_names_are_shown_where_they_say_more_than_the_number() -> None:
    """A joint named by its number alone is not named twice; wrong numbers of names or kinds are errors."""
    panel = error_bars_picture({"after": [0.1, 0.2, 0.3]}, joint_names=["joint_1", "A2", "elbow"]).panels[0]
    assert panel.categories == ("Joint 1", "Joint 2", "Joint 3 · elbow")
    with pytest.raises(InputError, match="joint names"):
        error_bars_picture({"after": [0.1]}, joint_names=["a", "b"])
    with pytest.raises(InputError, match="kind"):
        friction_picture(np.ones((1, 4)), [1.0], kinds=["helical"])
