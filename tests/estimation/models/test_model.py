import copy
import json
import re
import shutil

import numpy as np
import pytest
import scipy.stats

from estimation import identify, load_model, predict
from robots.common.errors import InputError
from robots.loading import load_robot
from robots.plants import nominal_plant, simulate


@pytest.fixture(scope="module")
def estimate(arm, arm_log):
    return identify(arm, arm_log())


@pytest.fixture(scope="module")
def content(estimate):
    """A model file's content, as JSON reads it."""
    return json.loads(json.dumps(estimate.model.to_dict()))


@pytest.fixture
def written(tmp_path):
    def write(data):
        path = tmp_path / "model.json"
        path.write_text(data if isinstance(data, str) else json.dumps(data))
        return path

    return write


@pytest.mark.slow
def test_the_file_gives_back_the_model(estimate, tmp_path):
    """Saving and loading changes no bit of values, covariance, names, terms and provenance."""
    path = tmp_path / "model.json"
    estimate.model.save(path)
    loaded = load_model(path)
    assert np.array_equal(loaded.values, estimate.model.values)
    assert np.array_equal(loaded.covariance, estimate.model.covariance)
    assert np.array_equal(loaded.determined, estimate.model.determined)
    assert loaded.names == estimate.model.names
    assert loaded.formulas == estimate.model.formulas
    assert loaded.torque_model.terms == estimate.model.torque_model.terms
    assert loaded.provenance == json.loads(json.dumps(estimate.model.provenance))
    loaded.save(tmp_path / "again.json")
    assert (tmp_path / "again.json").read_text() == path.read_text()


@pytest.mark.slow
def test_the_file_is_enough_for_a_prediction(tmp_path, fourier_motion):
    """A model of a robot whose description is gone predicts the same torque, from its file or its folder."""
    description = tmp_path / "mine.yaml"
    shutil.copy(load_robot.__globals__["CATALOG"] / "er3a.yaml", description)
    robot = load_robot(description)
    log = simulate(nominal_plant(robot), fourier_motion(robot, duration=10.0, period=0.01))
    model = identify(robot, log, check=False).model
    (tmp_path / "out").mkdir()
    model.save(tmp_path / "out" / "model.json")
    description.unlink()
    expected = predict(model, log).predicted
    for path in (tmp_path / "out", tmp_path / "out" / "model.json"):
        loaded = load_model(path)
        # The chain's numbers are written to the last bit; compiled and interpreted sums differ in rounding.
        np.testing.assert_allclose(predict(loaded, log).predicted, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    assert (loaded.robot.origin, loaded.robot.digest) == (robot.origin, robot.digest)
    assert len(loaded.robot.digest) == 64


def test_the_file_states_what_it_must(content, estimate):
    """Each parameter has name, value, unit and standard error; the provenance has logs, method, level and version."""
    assert content["format_version"] == 1
    for item, column in zip(content["parameters"], estimate.model.parameters, strict=True):
        assert {"name", "value", "unit", "standard_error", "determined", "stands_for"} <= set(item)
        assert (item["name"], item["unit"]) == (column.name, column.unit)
        assert (item["standard_error"] is None) == (not item["determined"])
    assert {"logs", "method", "residual_rms", "tool_version"} <= set(content["provenance"])
    assert len(content["provenance"]["residual_rms"]) == 2


def test_undetermined_parameters_have_no_standard_error(estimate):
    """Where data do not determine a parameter, its standard error is infinite, and absent in the file."""
    model = copy.copy(estimate.model)
    object.__setattr__(model, "determined", np.zeros(len(model.values), dtype=bool))
    assert np.isinf(model.standard_errors).all()
    assert all(item["standard_error"] is None for item in model.to_dict()["parameters"])
    frame = model.to_frame()
    assert not frame["determined"].any()
    assert list(frame.index) == list(model.names)


@pytest.mark.parametrize("level", [0.5, 0.95])
def test_confidence_intervals_are_those_of_the_normal_distribution(estimate, level):
    """An interval is symmetric about its value, and infinite for a parameter that is not determined."""
    model = estimate.model
    limits = estimate.conf_int(level)
    known = model.determined
    expected = scipy.stats.norm.interval(level, model.values[known], model.standard_errors[known])
    np.testing.assert_allclose(limits.to_numpy()[known].T, expected, rtol=1e-12)
    assert np.isinf(limits.to_numpy()[~known]).all()
    with pytest.raises(InputError, match="confidence level 2"):
        model.conf_int(2.0)


def test_an_existing_file_is_kept(estimate, tmp_path):
    """Without force a model is not overwritten."""
    path = tmp_path / "model.json"
    path.write_text("mine")
    with pytest.raises(InputError, match="force"):
        estimate.model.save(path)
    assert path.read_text() == "mine"
    estimate.model.save(path, force=True)
    assert load_model(path).names == estimate.model.names


def _set(path, value):
    def change(data):
        *keys, last = path
        for key in keys:
            data = data[key]
        data[last] = value

    return change


def _drop(*path):
    def change(data):
        *keys, last = path
        for key in keys:
            data = data[key]
        del data[last]

    return change


DAMAGES = {
    "another format": _set(["format"], "spreadsheet"),
    "no version": _drop("format_version"),
    "a newer version": _set(["format_version"], 99),
    "a version that is text": _set(["format_version"], "1"),
    "no parameters": _drop("parameters"),
    "an empty list of parameters": _set(["parameters"], []),
    "parameters that are null": _set(["parameters"], None),
    "parameters that are text": _set(["parameters"], ["a"]),
    "a parameter without name": _drop("parameters", 0, "name"),
    "a parameter of another model": _set(["parameters", 0, "name"], "Izz_9"),
    "a parameter twice": _set(["parameters", 0, "name"], "offset_2"),
    "a value that is text": _set(["parameters", 0, "value"], "much"),
    "a value that is null": _set(["parameters", 0, "value"], None),
    "a value that is NaN": _set(["parameters", 0, "value"], float("nan")),
    "a value that is infinite": _set(["parameters", 0, "value"], float("inf")),
    "a variance below zero": _set(["covariance", 0, 0], -1.0),
    "a covariance too small": _set(["covariance"], [[1.0]]),
    "a covariance with NaN": _set(["covariance", 0, 0], float("nan")),
    "no covariance": _drop("covariance"),
    "no terms": _set(["terms"], None),
    "an unknown term": _set(["terms", 0], {"name": "magnetism"}),
    "a term with an unknown setting": _set(["terms", 0, "colour"], "red"),
    "a term that is text": _set(["terms", 0], "rigid_body"),
    "velocity scales of another robot": _set(["terms", 1, "velocity_scale"], [0.1, 0.1, 0.1]),
    "a robot that is a list": _set(["robot"], []),
    "no joints": _set(["robot", "joints"], []),
    "a joint of an unknown kind": _set(["robot", "joints", 0, "kind"], "spherical"),
    "a joint with an unknown key": _set(["robot", "joints", 0, "colour"], "red"),
    "a rotation that is none": _set(["robot", "joints", 0, "rotation"], [[1, 2], [3, 4]]),
    "gravity of two numbers": _set(["robot", "gravity"], [0.0, 1.0]),
    "no name": _set(["robot", "name"], None),
    "no provenance": _set(["provenance"], None),
    "a cut-off that is text": _set(["provenance", "cutoff_hz"], "low"),
    "a cut-off of zero": _set(["provenance", "cutoff_hz"], 0),
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES.keys())
def test_damaged_files_are_refused(content, written, damage):
    """Whatever is wrong with a model file, one error names file, entry and remedy, in the words of no library."""
    data = copy.deepcopy(content)
    damage(data)
    path = written(data)
    with pytest.raises(InputError) as caught:
        load_model(path)
    assert caught.value.file == str(path)
    text = str(caught.value)
    assert "\n" not in text
    assert caught.value.remedy
    assert not re.search(
        r"\w+Error|NoneType|reshape|subscript|object has no|'str'|could not convert|unhashable", text
    ), text


@pytest.mark.parametrize("text", ["", "{", "[]", "null", "3", '"robot-oed model"', "\x00"])
def test_files_that_are_no_model_are_refused(written, text):
    """Empty, truncated and foreign JSON is refused by name."""
    path = written(text)
    with pytest.raises(InputError) as caught:
        load_model(path)
    assert caught.value.file == str(path)


def test_a_missing_file_says_what_to_give(tmp_path):
    """A path without a model says that a file or its folder is wanted."""
    with pytest.raises(InputError, match="no such file"):
        load_model(tmp_path / "none.json")
    with pytest.raises(InputError, match=r"model\.json: no such file"):
        load_model(tmp_path)


def test_bytes_are_no_model(tmp_path):
    """A binary file is refused as one that is no JSON."""
    path = tmp_path / "model.json"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="is not a model file"):
        load_model(path)
