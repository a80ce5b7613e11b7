"""Links and pictures of README and documentation lead to files of the repository."""

from __future__ import annotations

import re

import pytest

from benchmarks.sentence_lengths import FENCE, ROOT, pages

# Sphinx checks the links between the pages of docs/ itself; nothing else checks those of the other files.
FILES = [*pages(), ROOT / "CHANGELOG.md", ROOT / "benchmarks" / "README.md"]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.parent.name + path.stem)
def test_targets_exist(path):
    """Every relative link of a page names a file that exists."""
    prose = FENCE.sub("", path.read_text(encoding="utf-8"))
    targets = re.findall(r"\]\(([^)#\s]+)", prose)
    missing = [target for target in targets if "://" not in target and not (path.parent / target).exists()]
    assert missing == []


def test_no_line_is_a_comment():
    """No line of a page begins with a percent sign: the documentation takes it for a comment, and leaves it out."""
    left_out = [
        f"{path.name}: {line}"
        for path in pages()
        for line in FENCE.sub("", path.read_text(encoding="utf-8")).splitlines()
        if line.lstrip().startswith("%")
    ]
    assert left_out == []


def test_every_page_is_in_the_contents():
    """Every page of the documentation is listed on its first page."""
    index = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    listed = re.findall(r"^```\{toctree\}\n(.*?)^```", index, re.MULTILINE | re.DOTALL)
    assert {path.stem for path in pages()} - {"README", "index"} <= {word for part in listed for word in part.split()}


def test_pictures_are_small():
    """A picture has less than 200 kB: the repository keeps every version of it."""
    pictures = sorted((ROOT / "docs" / "images").iterdir())
    assert pictures
    assert all(picture.stat().st_size < 200_000 for picture in pictures)
