"""Counts the words in the sentences of README.md and of the pages in docs/.

What counts as a sentence:

- Code blocks, tables, headings, pictures and comments are left out. So is a bold heading at the start of a paragraph.
- A paragraph and a list item each end a sentence. An item of several sentences is split like a paragraph.
- Inside them, a sentence ends at ``.``, ``!`` or ``?`` before a space and a capital letter, a digit, a bracket, inline
  code or a formula. Abbreviations (``e.g.``, ``eq.``, ``et al.``) and initials end none.
- A word has a letter or a digit. Inline code, an inline formula and a displayed formula are one word each; of a link,
  the words of its text count.
- A displayed formula belongs to the sentence before it, which goes on behind it if the text goes on in lower case.

Use: ``python benchmarks/sentence_lengths.py [FILE ...]``. A page that includes another file is measured by that file.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
MEDIAN, NINTH_DECILE = 18, 30  # the targets: words in a sentence

INCLUDE = re.compile(r"^```\{include\} (\S+)\n```", re.MULTILINE)
FENCE = re.compile(r"^ *(`{3,}|:{3,}).*?^ *\1 *$", re.MULTILINE | re.DOTALL)
COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
FORMULA = re.compile(r"\s*\$\$.*?\$\$\s*", re.DOTALL)
LEFT_OUT = re.compile(r"^ *(\||#|!\[|<).*$", re.MULTILINE)
BLOCK = re.compile(r"\n\s*\n|\n(?= *(?:[-*+]|\d+\.) )")
MARKER = re.compile(r"^ *(?:[-*+]|\d+\.) +")
HEADING = re.compile(r"^\*\*[^*]+[.:]\*\*")
LINK = re.compile(r"\[([^\]]*)\]\(([^)]*)\)")
SHORT = re.compile(r"\b(e\.g|i\.e|eqs?|al|vs|approx|cf|Fig|[A-Z])\.")  # single capitals are initials
SENTENCE = re.compile(r"(?<=[.!?])[)*\"']*\s+(?=[A-Z0-9(`$*\"'])")
MASK = "codeword"


def _formula(found: re.Match[str]) -> str:
    """One word in place of a displayed formula, and a full stop unless the sentence goes on."""
    after = found.string[found.end() : found.end() + 1]
    return f" {MASK} " if after.islower() else f" {MASK}.\n\n"


def blocks(text: str) -> list[str]:
    """The paragraphs and list items of a page, without what is not prose.

    Args:
        text: the page, in Markdown.

    Returns:
        Each paragraph or item on one line, inline code and formulas masked.
    """
    text = FORMULA.sub(_formula, COMMENT.sub("", FENCE.sub("\n\n", text)))
    text = LEFT_OUT.sub("\n", text)
    text = re.sub(r"`+[^`]+`+", f"`{MASK}`", text)
    text = re.sub(r"\$[^$\n]+(?:\n[^$\n]+)?\$", f"${MASK}$", text)
    text = LINK.sub(lambda found: found[1] or MASK, text)
    found = (HEADING.sub("", MARKER.sub("", block.strip("\n"))) for block in BLOCK.split(text))
    return [" ".join(block.split()) for block in found if block.strip()]


def sentences(text: str) -> list[str]:
    """The sentences of a page.

    Args:
        text: the page, in Markdown.

    Returns:
        Each sentence, in the page's order, inline code and formulas masked.
    """
    found = (part for block in blocks(text) for part in SENTENCE.split(SHORT.sub(r"\1", block)))
    return [sentence for sentence in found if count(sentence)]


def count(sentence: str) -> int:
    """The number of words in a sentence: what is between spaces and has a letter or a digit."""
    return sum(any(character.isalnum() for character in word) for word in sentence.split())


def page(path: Path) -> str:
    """The text of a page, and in place of each include directive the text of the file that it names."""
    return INCLUDE.sub(lambda found: page(path.parent / found[1]), path.read_text(encoding="utf-8"))


def measure(lengths: list[int]) -> tuple[float, float]:
    """Median and 90th percentile of the numbers of words in sentences."""
    return float(np.median(lengths)), float(np.percentile(lengths, 90))


def pages() -> list[Path]:
    """README.md and the pages of the documentation."""
    return [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def main() -> None:
    """Prints sentences, median and 90th percentile of each page and of all."""
    chosen = [Path(name).resolve() for name in sys.argv[1:]] or pages()
    lengths = {path: [count(sentence) for sentence in sentences(page(path))] for path in chosen}
    print(f"{'page':32} sentences  median  90 %   (targets: median {MEDIAN}, 90 % {NINTH_DECILE} words)")
    rows = [(path.name if path.parent == ROOT else f"{path.parent.name}/{path.name}", lengths[path]) for path in chosen]
    rows.append(("all", [length for some in lengths.values() for length in some]))
    for name, some in rows:
        median, ninth = measure(some) if some else (0.0, 0.0)
        print(f"{name:32} {len(some):9d}  {median:6.1f}  {ninth:4.1f}")


if __name__ == "__main__":
    main()
