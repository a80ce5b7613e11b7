"""Plant files."""

from __future__ import annotations

import numpy as np
import pytest

from robots.common.errors import InputError
from robots.plants import Sensors, load_plant, nominal_plant

FULL = """
friction: coulomb-viscous
spread: 0.1
spread_seed: 7
parameters: {f1_3: 7.5}
sensors: {encoder_counts: 4096, torque_noise: 0.05, coloured_share: 0.2, correlation_time: 0.1, torque_step: 0.01}
"""


@pytest.fixture
def er3a(catalogue_robot):
    return catalogue_robot("er3a")


@pytest.fixture
def write(tmp_path):
    def write_text(text):
        path = tmp_path / "plant.yaml"
        path.write_text(text)
        return path

    return write_text


def test_a_full_file(write, er3a):
    """A plant file states friction, spread, single parameters and sensors."""
    plant = load_plant(write(FULL), er3a)
    expected = nominal_plant(er3a, friction="coulomb-viscous", spread=0.1, seed=7, overrides={"f1_3": 7.5})
    np.testing.assert_array_equal(plant.parameters, expected.parameters)
    assert plant.model.names == expected.model.names
    sensors = Sensors(
        encoder_counts=4096, torque_noise=0.05, coloured_share=0.2, correlation_time=0.1, torque_step=0.01
    )
    assert plant.sensors == sensors


def test_what_is_not_stated_has_its_default(write, er3a):
    """A plant file may state as little as it likes."""
    plant = load_plant(write("spread: 0.0\n"), er3a)
    np.testing.assert_array_equal(plant.parameters, nominal_plant(er3a).parameters)
    assert plant.sensors == Sensors()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("frictoin: polynomial", "frictoin"),
        ("friction: sticky", "friction"),
        ("sensors: {encoder: 1}", "encoder"),
        ("sensors: {torque_noise: -1}", "torque_noise is -1.0; allowed: zero or a positive number"),
        ("sensors: {coloured_share: 2}", "coloured_share is 2.0; allowed: 0 to 1"),
        ("spread: -1", "a spread of -1.0"),
        ("spread: wide", "spread"),
        ("parameters: {f1_33: 1}", "column parameters: unknown parameter f1_33; allowed: such as f1_3"),
        ("parameters: {f1_3: .nan}", "f1_3"),
        ("spread: [", "plant.yaml"),
    ],
)
def test_a_wrong_file_is_refused(text, message, write, er3a):
    """An unknown key, parameter or value is refused, naming the file and the key."""
    path = write(text)
    with pytest.raises(InputError) as caught:
        load_plant(path, er3a)
    assert message in str(caught.value)
    assert str(path) in str(caught.value)


def test_a_missing_file_is_refused(tmp_path, er3a):
    """A missing file is refused by name."""
    with pytest.raises(InputError, match=r"nowhere\.yaml"):
        load_plant(tmp_path / "nowhere.yaml", er3a)


EFFECTS = """
effects:
  - {effect: stribeck, joint: 2, parameters: {stribeck_torque: 5, stribeck_velocity: 0.05, exponent: 2}}
  - {effect: base_tilt, parameters: {tilt_2: 0.01}}
"""


def test_effects_are_listed(write, er3a):
    """A plant file lists effects by name, joint and parameters; a coefficient that is not stated is zero."""
    stribeck, tilt = load_plant(write(EFFECTS), er3a).effects
    assert (stribeck.effect, stribeck.joint, stribeck.coefficients, stribeck.shape) == (
        "stribeck",
        2,
        (5.0,),
        (0.05, 2),
    )
    assert (tilt.effect, tilt.joint) == ("base_tilt", None)
    assert (tilt.coefficients, tilt.shape) == ((0.0, 0.01), (0.0, 0.0))


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ("{effect: stribek, joint: 2, parameters: {}}", "unknown effect 'stribek'; allowed: such as stribeck"),
        ("{effect: stribeck, joint: 9, parameters: {}}", "stribeck on joint 9; allowed: 1, 2, 3"),
        ("{effect: stribeck, parameters: {}}", "stribeck on joint None"),
        ("{effect: base_tilt, joint: 1, parameters: {}}", "base_tilt on joint 1; allowed: no joint"),
        (
            "{effect: base_tilt, parameters: {tilt_3: 1}}",
            "base_tilt has no parameter 'tilt_3'; allowed: tilt_1, tilt_2, own_moment_1, own_moment_2",
        ),
        ("{effect: base_tilt, parameters: {tilt_2: 9}}", "tilt_2 is 9.0 rad; allowed: -0.5 to 0.5"),
        ("{effect: base_tilt, parameters: {tilt_2: .nan}}", "tilt_2 is nan"),
        (
            "{effect: base_tilt, parameters: {}}",
            "base_tilt needs at least one nonzero coefficient; allowed: one of tilt_1, tilt_2",
        ),
        ("{effect: friction_step, joint: 1, parameters: {coulomb_step: 1}}", "friction_step lacks change_time"),
        ("{effect: base_tilt}", "parameters"),
        ("base_tilt", "effects"),
    ],
)
def test_a_wrong_effect_is_refused(entry, message, write, er3a):
    """An unknown effect, joint or parameter, and a missing or impossible value, are refused by name."""
    path = write(f"effects:\n  - {entry}\n")
    with pytest.raises(InputError) as caught:
        load_plant(path, er3a)
    assert message in str(caught.value)
    assert str(path) in str(caught.value)
