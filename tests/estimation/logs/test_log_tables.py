"""Dialects and times of logs of other programs, and the mapping that a refusal proposes."""

import numpy as np
import pytest

from estimation.logs import read_log
from estimation.logs.mappings.suggestions import suggest_mapping
from robots.common.errors import InputError

ROWS = ((0.0, 0.1, 0.2, 3.0, -4.0), (0.5, 0.2, 0.4, 4.0, -5.5), (1.0, 0.3, 0.6, 5.0, -6.0))


def lines(names, delimiter=",", *, decimal=".", first=None, end=""):
    rows = []
    for row in ROWS:
        cells = [repr(value).replace(".", decimal) for value in row]
        rows.append(delimiter.join([*([first(row[0])] if first else cells[:1]), *cells[1:]]) + end)
    return "\n".join([delimiter.join(names) + end, *rows]) + "\n"


OWN = ("t", "q1", "q2", "tau1", "tau2")


@pytest.mark.parametrize(
    "content",
    [
        lines(OWN, " "),
        "# " + lines(OWN),
        "sep=;\n" + lines(OWN, ";", decimal=","),
        lines(OWN, ";", decimal=",", end=";"),
        lines(OWN, end=","),
        lines(OWN, first=lambda t: f"1970-01-01T00:00:0{t}"),
        lines(OWN, ";", decimal=",", first=lambda t: f"00:00:0{t}".replace(".", ",")),
        "\ufeff" + lines(OWN, "\t", decimal=","),
    ],
)
def test_dialects_give_the_same_log(tmp_path, content):
    """Blanks, names behind #, sep=, decimal commas, trailing delimiters and ISO times change no value."""
    path = tmp_path / "log.csv"
    path.write_text(content)
    log = read_log(path, 2)
    np.testing.assert_array_equal(np.column_stack([log.t, log.q, log.tau]), ROWS)


def refused(path, n=None, **options):
    with pytest.raises(InputError) as caught:
        read_log(path, n, **options)
    return caught.value


def test_time_with_a_unit_and_as_text_is_refused(tmp_path):
    """A mapping that states milliseconds for dates is a contradiction."""
    path = tmp_path / "log.csv"
    path.write_text(lines(("stamp", *OWN[1:]), first=lambda t: f"1970-01-01T00:00:0{t}"))
    mapping = tmp_path / "m.yaml"
    mapping.write_text("time: {column: stamp, unit: ms}\nposition: {columns: 'q{joint}'}\n")
    assert "'ms'" in refused(path, mapping=mapping).problem
    mapping.write_text("time: {column: stamp}\nposition: {columns: 'q{joint}'}\n")
    np.testing.assert_array_equal(read_log(path, mapping=mapping).t, [0.0, 0.5, 1.0])


@pytest.mark.parametrize(
    ("names", "factors"),
    [
        (("time", "q1", "q2", "tau1", "tau2"), {}),
        (("Time [ms]", "Axis1 [deg]", "Axis2 [deg]", "Torque1 [Nm]", "Torque2 [Nm]"), {"t": 1e-3, "q": np.pi / 180}),
        (("stamp", "joint_1_position", "joint_2_position", "joint_1_effort", "joint_2_effort"), {}),
        (("t (us)", "pos_0", "pos_1", "joint_torque_0", "joint_torque_1"), {"t": 1e-6}),
        (("__time", "/js/a/position", "/js/b/position", "/js/a/effort", "/js/b/effort"), {}),
        (("timestamp", "actualPos[0]", "actualPos[1]", "motorCurrent[0] (mA)", "motorCurrent[1] (mA)"), {"i": 1e-3}),
    ],
)
def test_advice_about_unknown_columns_works(tmp_path, names, factors):
    """The mapping that a refusal prints is saved, given, and reads the log."""
    path, mapping = tmp_path / "log.csv", tmp_path / "mapping.yaml"
    path.write_text(lines(names))
    error = refused(path, 2, joints=["a", "b"])
    assert names[0] in error.problem
    mapping.write_text(error.remedy.split("\n", 1)[1])
    log = read_log(path, 2, mapping=mapping, joints=["a", "b"])
    values = np.array(ROWS)
    np.testing.assert_allclose(log.t, values[:, 0] * factors.get("t", 1.0), rtol=1e-15)
    np.testing.assert_allclose(log.q, values[:, 1:3] * factors.get("q", 1.0), rtol=1e-15)
    signal = log.current if "i" in factors else log.tau
    np.testing.assert_allclose(signal, values[:, 3:] * factors.get("i", 1.0), rtol=1e-15)


def test_measured_columns_are_proposed_before_commanded_ones():
    """Commands and external torques are proposed only where there is nothing else."""
    names = ["t", "cmd_pos_0", "cmd_pos_1", "pos_0", "pos_1", "tau_ext_0", "tau_ext_1", "tau_0", "tau_1"]
    text = suggest_mapping(names, 2)
    assert '"pos_{index}"' in text
    assert '"tau_{index}"' in text


def test_german_names_and_loads_are_recognised():
    """As KUKA and Siemens controllers write them."""
    names = ("Zeit_ms", "Winkel_1", "Winkel_2", "Drehmoment_1", "Drehmoment_2")
    assert suggest_mapping(names, 2) == (
        'time: {column: Zeit_ms, unit: ms}\nposition: {columns: "Winkel_{joint}"}\n'
        'torque: {columns: "Drehmoment_{joint}"}\n'
    )
    assert 'torque: {columns: "load_{joint}"}' in suggest_mapping(("t", "pos_1", "pos_2", "load_1", "load_2"), 2)


def test_nothing_is_proposed_for_columns_without_meaning(tmp_path):
    """Where no column looks like a position, the message lists the columns and proposes nothing."""
    path = tmp_path / "log.csv"
    path.write_text(lines(("a", "b", "c", "d", "e")))
    error = refused(path)
    assert "a, b, c, d, e" in error.problem
    assert "\n" not in error.remedy
