"""The examples of the documentation work as they are printed."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from benchmarks.sentence_lengths import pages
from estimation import read_log
from robots import load_robot, nominal_plant
from robots.plants import load_plant

DOCS = Path(__file__).parents[2] / "docs"


def block(page: str, language: str, containing: str) -> str:
    """The fenced block of a page that contains a text."""
    text = (DOCS / page).read_text(encoding="utf-8")
    blocks = re.findall(rf"^```{language}\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)
    return next(found for found in blocks if containing in found)


@pytest.fixture
def two_links(tmp_path):
    """The page's robot with a Denavit-Hartenberg table."""
    path = tmp_path / "two_links.yaml"
    path.write_text(block("robots.md", "yaml", "geometry:"), encoding="utf-8")
    return load_robot(path)


def test_table_example_is_a_robot(two_links):
    """The Denavit-Hartenberg example is a complete robot: its plant can be simulated."""
    assert two_links.n == 2
    assert np.isfinite(nominal_plant(two_links).parameters).all()
    np.testing.assert_allclose(two_links.limits.velocity, np.pi, rtol=1e-12)  # 180 deg/s, to rounding


def test_urdf_example_overrides_limits(tmp_path):
    """The example that adds to a URDF replaces its velocity limits and keeps its position limits."""
    urdf = Path(load_robot.__code__.co_filename).parent / "catalog" / "ur10.urdf"
    (tmp_path / "my_arm.urdf").write_text(urdf.read_text(encoding="utf-8"), encoding="utf-8")
    path = tmp_path / "my_arm.yaml"
    path.write_text(block("robots.md", "yaml", "my_arm.urdf"), encoding="utf-8")
    robot = load_robot(path)
    np.testing.assert_array_equal(robot.limits.velocity, [2, 2, 2, 3, 3, 3])
    np.testing.assert_array_equal(robot.limits.lower, load_robot("ur10").limits.lower)
    assert robot.period == 0.008


def test_plant_example_is_read(tmp_path):
    """The plant example is a plant of the er3a, with the friction parameter that it sets."""
    path = tmp_path / "plant.yaml"
    path.write_text(block("files.md", "yaml", "spread_seed"), encoding="utf-8")
    plant = load_plant(path, load_robot("er3a"))
    assert plant.parameters[plant.model.names.index("f1_3")] == 7.5


def test_log_example_is_read(tmp_path):
    """The log example is read, its degrees converted."""
    path = tmp_path / "log.csv"
    path.write_text(block("files.md", "text", "ECSV"), encoding="utf-8")
    log = read_log(path)
    assert log.q[1, 0] == pytest.approx(np.deg2rad(0.01))
    np.testing.assert_array_equal(log.tau[:, 0], [-0.12, -0.35])


def import_lines() -> list[str]:
    """Every import that a Python block of README or documentation begins with, once each."""
    found = []
    for path in pages():
        for code in re.findall(r"^```python\n(.*?)^```$", path.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL):
            found += re.findall(r"^(?:from|import) .*$", code, flags=re.MULTILINE)
    return sorted(set(found))


@pytest.mark.parametrize("line", import_lines())
def test_imports_work(line):
    """What the Python examples import is where they import it from."""
    exec(line, {})
