from __future__ import annotations

import hashlib
import json
import re
from html.parser import HTMLParser
from typing import Any

import numpy as np
import pytest

from oed.reports import (
    Fact,
    Finding,
    Footer,
    InputFile,
    Page,
    Panel,
    Picture,
    Recording,
    Section,
    Series,
    Table,
    render,
)
from oed.reports.rendering.html import SCRIPT
from robots.common.errors import InputError

pytestmark = pytest.mark.slow

VOID = {"meta", "link", "br", "hr", "img", "input", "col", "wbr"}


class Outline(HTMLParser):
    """Collects elements, identifiers and text, and complains about elements that are not closed in order."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.seen: list[tuple[str, dict[str, str | None]]] = []
        self.words: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] not in ("script", "style"):
            self.words.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.words).split())

    def attributes(self, name: str) -> list[str]:
        return [attributes[name] or "" for _, attributes in self.seen if name in attributes]


def parse(html: str) -> Outline:
    outline = Outline()
    outline.feed(html)
    outline.close()
    assert outline.open == []
    return outline


def picture(name: str = "p") -> Picture:
    series = Series(x=[0, 1], y=[0, 1], name="</script><b>")
    return Picture(title="Picture <1>", name=name, panels=(Panel(series=(series,)),), caption="Caption")


@pytest.fixture(scope="module")
def full(six: Any) -> str:
    """A page with everything, of a 60 s experiment of six joints at 250 Hz."""
    pictures = six.pictures()
    table = Table(headings=("Name", "Value", "Unit"), rows=(("Izz_1", 12.34567, "kg m²"), ("m_1", None, "kg")))
    return render(
        Page(
            title="Experiment",
            robot="er3a",
            logs=(Recording(name="monday", start=1738310400.0, duration=60.0), Recording(name="undated", start=0.0)),
            verdict="The experiment is good.",
            facts=(Fact(label="Condition number", value=41.2671, note="scaled"), Fact(label="Duration", value="60 s")),
            findings=(
                Finding(code="value.assumed", text="A value is assumed."),
                Finding(code="limit.exceeded", subject="Joint 2:", text="too fast.", action="Do not play it."),
            ),
            sections=(
                Section(title="Motion", paragraphs=("Text.",), pictures=pictures[:3]),
                Section(title="Fit", pictures=pictures[3:], tables=(table,)),
                Section(title="Fit", folded=True, paragraphs=("Hidden.",)),
            ),
            footer=Footer(
                tool="robot-oed 1",
                date="2025-01-31",
                command="oed design --robot er3a",
                seed=7,
                versions=(("numpy", "2.0"),),
                inputs=(InputFile(name="log.csv", size=12, modified="2025-01-30", sha256="0" * 64),),
            ),
        )
    )


def test_page_is_well_formed(full: str) -> None:
    """Every element is closed in order, every identifier is used once, and every reference has its target."""
    outline = parse(full)
    identifiers = outline.attributes("id")
    assert len(identifiers) == len(set(identifiers))
    targets = [value[1:] for value in outline.attributes("href") if value.startswith("#")]
    for value in [*targets, *outline.attributes("aria-labelledby"), *outline.attributes("data-figure")]:
        assert value in identifiers


def test_page_loads_nothing_from_anywhere(full: str) -> None:
    """The file has no address of a network at all, and a policy that forbids the browser to load one."""
    assert not re.search(r"https?://", full)
    assert not re.search(r"""(?:src|href)\s*=\s*["']?\s*//""", full)
    assert "@import" not in full
    assert not re.search(r"<(?:iframe|object|embed|base|audio|video)\b", full)
    outline = parse(full)
    assert outline.attributes("src") == []
    assert all(value.startswith(("#", "data:")) for value in outline.attributes("href"))
    policy = next(value for value in outline.attributes("content") if "default-src" in value)
    assert "default-src 'none'" in policy


def test_page_stays_small(full: str) -> None:
    """Sixty seconds at 250 Hz of six joints with every picture there is fit in 4 MB; plotly takes 1.2 of them."""
    assert len(full.encode()) < 4e6


def test_drawing_library_is_inside_once(full: str) -> None:
    """plotly.js is written once, however many pictures there are."""
    assert full.count("* plotly.js (basic - minified) v") == 1
    assert len([tag for tag, _ in parse(full).seen if tag == "script"]) == 8 + 2


def test_drawing_library_is_the_published_one() -> None:
    """The bundle is the published file of the version that the Python package has, unchanged."""
    text = SCRIPT.read_bytes()
    assert hashlib.sha256(text).hexdigest() == "99784e3abfb07b142a15e521a439e6d9addceadb3f79553fd24c72774f0649ba"


def test_pictures_use_what_the_basic_bundle_draws(full: str) -> None:
    """Traces are lines, points and bars only."""
    figures = re.findall(r'<script type="application/json" id="figure-[^>]*>(.*?)</script>', full, re.DOTALL)
    kinds = {trace["type"] for figure in figures for trace in json.loads(figure)["data"]}
    assert kinds == {"scatter", "bar"}


def test_texts_and_tables_need_no_script(full: str) -> None:
    """Verdict, facts, warnings, paragraphs, tables, captions and the command are in the text of the file."""
    text = parse(full).text
    for words in (
        "The experiment is good.",
        "Condition number 41.27 scaled",
        "A value is assumed.",
        "Joint 2: too fast. Do not play it.",
        "monday (60.00 s), undated",
        "2025-01-31 08:00 UTC",
        "seed 7",
        "numpy 2.0",
        "0" * 64,
        "Hidden.",
        "Izz_1 12.35 kg m²",
        "m_1 – kg",
        "Dashed lines are limits",
        "robot-oed 1, 2025-01-31",
        "oed design --robot er3a",
    ):
        assert words in text


def test_verdict_and_findings_come_before_everything_else(full: str) -> None:
    """The answer and the findings, the urgent first, stand before the key figures, sections and pictures."""
    text = parse(full).text
    places = [text.index(words) for words in ("The experiment", "too fast", "A value is", "Condition number", "Text.")]
    assert places == sorted(places)


def test_page_can_be_used_by_keyboard_and_ear(full: str) -> None:
    """The page has a language, one main part and heading, a way past the contents, and names for pictures."""
    seen = parse(full).seen
    assert ("html", {"lang": "en"}) in seen
    assert [tag for tag, _ in seen].count("main") == [tag for tag, _ in seen].count("h1") == 1
    assert any(attributes.get("class") == "skip" for _, attributes in seen)
    assert all("aria-labelledby" in attributes for tag, attributes in seen if attributes.get("role") == "img")
    assert all(attributes.get("scope") == "col" for tag, attributes in seen if tag == "th")


def test_contents_list_every_section(full: str) -> None:
    """Sections of one title have identifiers of their own, and the contents lead to each."""
    targets = [value for value in parse(full).attributes("href") if value.startswith("#section-")]
    assert targets == ["#section-motion", "#section-fit", "#section-fit-2"]


def test_texts_are_escaped_everywhere() -> None:
    """No text, wherever it stands, becomes markup or ends a script."""
    evil = "<script>alert(1)</script>&\"'"
    html = render(
        Page(
            title=evil,
            robot=evil,
            verdict=evil,
            logs=(Recording(name=evil),),
            facts=(Fact(label=evil, value=evil, note=evil),),
            findings=(Finding(code="done", subject=evil, text=evil, action=evil),),
            sections=(
                Section(
                    title=evil,
                    paragraphs=(evil,),
                    pictures=(picture(),),
                    tables=(Table(headings=(evil,), rows=((evil,),), caption=evil),),
                ),
            ),
            footer=Footer(tool=evil, date=evil, command=evil),
        )
    )
    assert "<script>alert" not in html
    outline = parse(html)
    assert outline.text.count(evil) >= 10
    assert "b" not in [tag for tag, _ in outline.seen]


def test_page_without_pictures_is_small() -> None:
    """A page of text alone carries no drawing library and no contents for a single section."""
    html = render(Page(title="t", verdict="v", sections=(Section(title="s"),)))
    outline = parse(html)
    assert len(html) < 20_000
    assert not {"script", "nav", "noscript"} & {tag for tag, _ in outline.seen}


def test_cells_are_rounded_and_aligned() -> None:
    """Floats have four digits, integers all of theirs, booleans and gaps words; columns of numbers stand right."""
    table = Table(
        headings=("a", "b", "c", "d"),
        rows=((1.23456, 123456, True, "x"), (np.float64(0.5), np.int64(7), None, "y"), (None, None, False, "z")),
    )
    assert table.align == ("right", "right", "left", "left")
    text = parse(render(Page(title="t", verdict="v", sections=(Section(title="s", tables=(table,)),)))).text
    assert "1.235 123456 yes x 0.5000 7 – y – – no z" in text


@pytest.mark.parametrize(
    "build",
    [
        lambda: Table(headings=("a",), rows=((1, 2),)),
        lambda: Table(headings=("a",), rows=(), align=("right", "left")),
        lambda: Table(headings=("a",), rows=(), align=("up",)),
        lambda: Fact(label="a", value=1, status="great"),
        lambda: Finding(code="great", text="t"),
        lambda: Page(title="t", verdict="v", sections=(Section(title="s", pictures=(picture(), picture())),)),
    ],
    ids=["cells", "alignments", "alignment", "fact", "code", "names"],
)
def test_contents_are_checked(build: Any) -> None:
    """Rows, alignments, states and names of pictures that do not fit are errors of ours."""
    with pytest.raises(InputError):
        build()
