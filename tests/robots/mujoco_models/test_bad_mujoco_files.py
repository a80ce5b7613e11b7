import sys
from types import SimpleNamespace

import pytest

from robots import load_robot
from robots.common.errors import AssumedValueWarning, InputError
from robots.mujoco_models.files import compile_mjcf, mujoco_library
from tests.robots.mujoco_models.arms import ARM, GANTRY


def message(tmp_path, text, **choice):
    path = tmp_path / "model.xml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        load_robot(path, **choice)
    text = str(caught.value)
    assert "model.xml" in text
    assert "\n" not in text
    return text


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("</worldbody>", ""), "not well-formed"),
        (('mass="8"', 'mass="-8"'), "MuJoCo cannot load it"),
        (('<joint name="rail"', '<joint nmae="rail"'), "nmae"),
        (("<worldbody>", '<include file="nowhere.xml"/><worldbody>'), "nowhere.xml"),
        (("<worldbody>", '<include file="model.xml"/><worldbody>'), "includes itself"),
        (("<worldbody>", '<asset><mesh file="hand.stl"/></asset><worldbody>'), "meshes"),
        (('range="-0.5 0.7"', ""), "no range"),
    ],
)
def test_a_bad_file_is_one_message(tmp_path, change, words):
    """Each fault is said in one line that names the file and what is wrong."""
    assert change[0] in GANTRY
    assert words in message(tmp_path, GANTRY.replace(*change))


def test_other_roots_are_refused(tmp_path):
    """A URDF named .xml is distinguished from an MJCF, and other XML is refused."""
    assert ".urdf" in message(tmp_path, "<robot name='r'/>")
    assert "<mujoco>" in message(tmp_path, "<html/>")


def test_robots_that_float_or_stand_still_are_refused(tmp_path):
    """A robot on a free joint has no fixed base; without hinges there is no robot."""
    floating = GANTRY.replace('<joint name="rail"', "<freejoint/><joint").replace('<joint type="slide"', "<site")
    floating = '<mujoco><worldbody><body name="trunk"><freejoint/><geom size="0.1"/>'
    leg = '<body name="leg"><joint name="hip"/><geom size="0.1"/></body>'
    assert "free joint" in message(tmp_path, f"{floating}{leg}</body></worldbody></mujoco>")
    assert "no hinge" in message(tmp_path, f"{floating}</body></worldbody></mujoco>")


def test_a_tree_asks_for_its_tip(tmp_path):
    """Two branches are listed with their joints; an unknown tip gets the nearest name."""
    second = '<body name="left"><joint name="left_joint"/><geom size="0.1"/></body>'
    text = ARM.replace('<body name="base"', f'{second}<body name="base"')
    words = message(tmp_path, text)
    assert "the MJCF branches into 2 chains" in words
    assert "left: left_joint" in words
    assert "'tool'" in message(tmp_path, ARM, tip="tol")


def test_two_moving_joints_of_one_body_are_refused(tmp_path):
    """A body with two moving joints has no link between them."""
    text = GANTRY.replace('<joint name="swing"', '<joint name="sway" axis="1 0 0"/><joint name="swing"')
    assert "has no mass" in message(tmp_path, text)


def test_without_the_package_the_extra_is_named(tmp_path, monkeypatch):
    """Who has no MuJoCo reads how to get it."""
    monkeypatch.setitem(sys.modules, "mujoco", None)
    assert "robot-oed[mujoco]" in message(tmp_path, GANTRY)


def test_mujocos_warnings_are_ours(tmp_path, capfd):
    """What MuJoCo warns of comes as a warning that names the file, and not on the terminal."""
    path = tmp_path / "model.xml"
    path.write_text(GANTRY)
    library = mujoco_library(path)

    class Loud:
        @staticmethod
        def from_xml_path(name):
            model = library.MjModel.from_xml_path(name)
            library.get_mju_user_warning()("a doubtful\nmodel")
            return model

    monkey = pytest.MonkeyPatch()
    with monkey.context() as patch:
        patch.setattr("robots.mujoco_models.files.mujoco_library", lambda file: _with(library, Loud))
        with pytest.warns(AssumedValueWarning, match="MuJoCo: a doubtful model"):
            compile_mjcf(path)
    assert capfd.readouterr() == ("", "")


def _with(library, loader):
    names = ("get_mju_user_warning", "set_mju_user_warning", "FatalError")
    return SimpleNamespace(MjModel=loader, **{name: getattr(library, name) for name in names})
