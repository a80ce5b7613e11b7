"""README and documentation are written in short sentences and in the field's words."""

from __future__ import annotations

import re

import pytest

from benchmarks.sentence_lengths import FENCE, MEDIAN, NINTH_DECILE, ROOT, count, measure, page, pages, sentences

DIALECT = re.compile(
    r"\b(?:told|tells|tell|borne? out|bears? out|laden|besides|mend(?:s|ed|ing)?|stands? out of|speaks? against|"
    r"spoke against|nameless|thriftier|believable|all the same|is no part of|pulled towards|held by a prior)\b",
    re.IGNORECASE,
)
# The same in the sources, where more of these words have another meaning.
RIDDLES = re.compile(
    r"\b(?:freed of|eats|eaten|stand unlike|(?:is|are|be) told of|lean on|not to be trusted|any more|to speak of|"
    r"all the same)\b"
)
PROSE = [*pages(), ROOT / "CHANGELOG.md", ROOT / "benchmarks" / "README.md"]


@pytest.mark.parametrize("path", pages(), ids=lambda path: path.stem)
def test_sentences_are_short(path):
    """Half of a page's sentences have at most 18 words, nine tenths at most 30."""
    lengths = [count(sentence) for sentence in sentences(page(path))]
    median, ninth = measure(lengths)
    assert median <= MEDIAN
    assert ninth <= NINTH_DECILE


@pytest.mark.parametrize("path", PROSE, ids=lambda path: path.parent.name + path.stem)
def test_words_are_the_fields(path):
    """No page uses the words of the project's former dialect, outside code and printed output."""
    assert DIALECT.findall(FENCE.sub("", path.read_text(encoding="utf-8"))) == []


@pytest.mark.parametrize("package", ["robots", "estimation", "oed"])
def test_sources_have_no_riddles(package):
    """No docstring, comment or message says in a figure of speech what a word of the field says."""
    found = [
        f"{path.relative_to(ROOT)}: {riddle}"
        for path in sorted((ROOT / package).rglob("*.py"))
        for riddle in RIDDLES.findall(path.read_text(encoding="utf-8"))
    ]
    assert found == []


def test_splitting():
    """Headings, tables, code and comments are left out; items, abbreviations, code and formulas count as described."""
    text = """# A heading

<!-- a comment -->
One sentence of six words, [a link](page.md). The second
has `some inline code` and $x = 1$ (Lee et al. 2020)! Third.

```sh
not counted. At all.
```

| a table | of words |

**Run-in heading.** The item's list:

- first item
- second item. It has two.
1. J. Swevers, eq. 35

The torque is

$$\\tau = Y \\pi .$$

Next, where

$$x = 1$$

is one.
"""
    assert [count(sentence) for sentence in sentences(text)] == [7, 10, 1, 3, 2, 2, 3, 4, 4, 5]


def test_included_files_are_measured():
    """The page that includes the changelog is measured by the changelog."""
    assert sentences(page(ROOT / "docs" / "changelog.md")) == sentences(page(ROOT / "CHANGELOG.md"))
