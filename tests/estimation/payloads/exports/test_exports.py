"""Every form in which controllers take a payload, read back by a reader that is not ours."""

from __future__ import annotations

import json
import re
from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest
import yaml
from scipy.spatial.transform import Rotation

from estimation.payloads.body import Body
from estimation.payloads.exports import EXPORTS, payload_export
from robots.common.errors import InputError

TURN = Rotation.from_euler("xyz", [0.4, -0.3, 0.5]).as_matrix()
MASS, CENTRE = 1.23456789, np.array([0.021, -0.013, 0.104])
INERTIA = TURN @ np.diag([0.0041, 0.0033, 0.0012]) @ TURN.T


def _numbers(text: str) -> list[float]:
    return [float(word) for word in re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", text)]


def urscript(text: str) -> tuple[float, np.ndarray, np.ndarray]:
    """The manual's order: Ixx, Iyy, Izz, Ixy, Ixz, Iyz."""
    line = next(line for line in text.splitlines() if not line.startswith("#"))
    assert re.fullmatch(r"set_target_payload\([^\[]+, \[[^\]]+\], \[[^\]]+\]\)", line)
    m, x, y, z, xx, yy, zz, xy, xz, yz = _numbers(line.split("payload", 1)[1])
    return m, np.array([x, y, z]), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def franka(text: str) -> tuple[float, np.ndarray, np.ndarray]:
    """Column-major matrices of 9 and 16 entries."""
    data = json.loads(text)
    assert set(data) == {"id", "name", "color", "mass", "centerOfMass", "transformation", "inertia"}
    assert not data["id"].startswith("ee-")
    assert " " not in data["id"]
    np.testing.assert_array_equal(np.reshape(data["transformation"], (4, 4), order="F"), np.eye(4))
    return data["mass"], np.array(data["centerOfMass"]), np.reshape(data["inertia"], (3, 3), order="F")


def kuka(text: str) -> tuple[float, np.ndarray, np.ndarray]:
    """Millimetres, degrees, and moments about principal axes: A about Z, B about the new Y, C about the new X."""
    line = next(line for line in text.splitlines() if not line.startswith(";"))
    place = r"X (\S+),Y (\S+),Z (\S+)"
    shape = rf"LOAD_DATA\[1\]=\{{M (\S+),CM \{{{place},A (\S+),B (\S+),C (\S+)\}},J \{{{place}\}}\}}"
    found = re.fullmatch(shape, line)
    assert found
    m, x, y, z, a, b, c, jx, jy, jz = map(float, found.groups())
    turn = Rotation.from_euler("ZYX", [a, b, c], degrees=True).as_matrix()
    return m, np.array([x, y, z]) / 1000, turn @ np.diag([jx, jy, jz]) @ turn.T


def ros(text: str) -> tuple[float, np.ndarray, np.ndarray]:
    """A parameter file for any node; whole numbers would be integer parameters."""
    load = yaml.safe_load(text)["/**"]["ros__parameters"]["payload"]
    flat = [load["mass"], *load["center_of_gravity"].values(), *(v for k, v in load.items() if k.startswith("i"))]
    assert all(isinstance(value, float) for value in flat)
    I = {axes: load[f"i{axes}"] for axes in ("xx", "yy", "zz", "xy", "xz", "yz")}  # noqa: E741
    matrix = [[I["xx"], I["xy"], I["xz"]], [I["xy"], I["yy"], I["yz"]], [I["xz"], I["yz"], I["zz"]]]
    return load["mass"], np.array([load["center_of_gravity"][axis] for axis in "xyz"]), np.array(matrix)


def urdf(text: str) -> tuple[float, np.ndarray, np.ndarray]:
    """Read by pinocchio, with a free flyer so that the inertia has a joint to hang on."""
    model = pin.buildModelFromXML(text, pin.JointModelFreeFlyer())
    body = model.inertias[1]
    return body.mass, body.lever, body.inertia


READERS: dict[str, Callable[[str], tuple[float, np.ndarray, np.ndarray]]] = {
    "urscript": urscript,
    "franka": franka,
    "kuka": kuka,
    "ros": ros,
    "urdf": urdf,
}


@pytest.mark.parametrize("name", EXPORTS)
@pytest.mark.parametrize("mass", [MASS, 2.0, 0.004])
def test_a_form_states_mass_centre_and_inertia(name: str, mass: float) -> None:
    """In the units and the order that its documentation states, to the nine digits that are written."""
    export = payload_export(name)
    assert export.name == name
    m, centre, inertia = READERS[name](export.text(Body.of(mass, CENTRE, INERTIA * mass / MASS), "payload of a robot"))
    assert m == pytest.approx(mass, rel=1e-8)
    np.testing.assert_allclose(centre, CENTRE, rtol=1e-7)
    # Angles have nine digits, which leaves products of inertia 1e-8 of the moments.
    np.testing.assert_allclose(inertia, INERTIA * mass / MASS, atol=1e-7 * INERTIA.max() * mass / MASS)


@pytest.mark.parametrize("name", EXPORTS)
def test_a_form_has_its_own_file_and_says_where_it_comes_from(name: str) -> None:
    """No two forms share a file; the title is in the text."""
    export = payload_export(name)
    assert [other.file for other in EXPORTS.values()].count(export.file) == 1
    assert "payload of a robot" in export.text(Body.of(1.0, CENTRE, INERTIA), "payload of a robot")
    assert (type(export).__doc__ or "").count("https://") >= 1


def test_no_number_has_an_exponent_where_controllers_read_it() -> None:
    """Small moments of inertia are written out."""
    small = Body.of(0.01, [1e-5, 0, 0], np.diag([3e-8, 2e-8, 2e-8]))
    for name in ("urscript", "kuka"):
        assert not re.search(r"\de[-+]?\d", EXPORTS[name].text(small, "payload"))


def test_an_unknown_form_is_refused_with_the_known_ones() -> None:
    """The message lists all names."""
    with pytest.raises(InputError, match="urscript, franka, kuka, ros, urdf"):
        payload_export("fanuc")
