import pytest

from estimation.logs.columns import BY_FIELD, QUANTITIES, column_name, parse_name


@pytest.mark.parametrize(
    ("name", "field", "joint"),
    [
        ("t", "t", None),
        ("q1", "q", 1),
        ("dq12", "dq", 12),
        ("ddq2", "ddq", 2),
        ("tau3", "tau", 3),
        ("i4", "current", 4),
        ("temp5", "temperature", 5),
        ("temp_env", "ambient", None),
        ("qlink6", "qlink", 6),
        ("segment", "segment", None),
        ("cycle", "cycle", None),
        ("q0", "q", 0),
    ],
)
def test_name_tells_quantity_and_joint(name, field, joint):
    """The names of the log format are understood, and made again from quantity and joint."""
    quantity, number = parse_name(name)
    assert (quantity.field, number) == (field, joint)
    assert column_name(quantity, joint) == name


@pytest.mark.parametrize("name", ["q", "t1", "tau", "Q1", "q_1", "q1_ref", "segment1", "time", "", "temp_env1", "q-1"])
def test_other_names_are_no_columns_of_a_log(name):
    """Names beside the format are left alone."""
    assert parse_name(name) is None


def test_quantities_are_distinct_and_state_their_own_unit():
    """Prefixes and fields are unique, and the unit of a log is the first that a file may state."""
    assert len({quantity.prefix for quantity in QUANTITIES}) == len(QUANTITIES) == len(BY_FIELD)
    for quantity in QUANTITIES:
        assert next(iter(quantity.units.values())) == 1.0
        assert quantity.unit.replace(" ", "").replace("^", "") in quantity.units
