"""The benchmark that reads descriptions of packages: its rows say what became of each file."""

from __future__ import annotations

import pytest

from benchmarks.descriptions import descriptions, package_name, read
from tests.robots.test_vendor_descriptions import BODY, arm

FORK = '<joint name="b1" type="revolute"><parent link="base"/><child link="d"/></joint><link name="d"/>'


@pytest.fixture
def package(tmp_path):
    """An unpacked package with one file of each kind."""
    (tmp_path / "vendor-1.2.dist-info").mkdir()
    (tmp_path / "vendor-1.2.dist-info" / "METADATA").write_text("Metadata-Version: 2.1\nName: vendor\nVersion: 1.2\n")
    files = {
        "arm.urdf": arm(),
        "known.urdf": arm([BODY.format(5)] * 3),
        "some.urdf": arm(("", BODY.format(5), "")).replace('velocity="2"', 'velocity="0"', 1),
        "fork.urdf": arm().replace("</robot>", f"{FORK}</robot>"),
        "table.urdf": '<robot name="table"><link name="top"/></robot>',
        "torn.urdf": arm()[:-20],
        "devices.xml": "<devices/>",
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def test_each_file_has_its_row(package):
    """Read, refused with the reason, or no robot at all; masses, limits and the chosen tip are stated."""
    assert package_name(package) == "vendor 1.2"
    rows = {row.file: (row.outcome, row.detail) for row in (read(path, package) for path in descriptions(package))}
    assert rows == {
        "arm.urdf": ("read", "3 joints, no masses, all limits"),
        "known.urdf": ("read", "3 joints, all masses, all limits"),
        "some.urdf": ("read", "3 joints, 1 of 3 masses, not all limits of velocity"),
        "fork.urdf": ("read", "3 joints, no masses, all limits, tip c"),
        "table.urdf": ("no robot", "the URDF has no joint"),
        "torn.urdf": ("refused", rows["torn.urdf"][1]),
    }
    assert rows["torn.urdf"][1].startswith("not well-formed XML")
