"""YAML files in, checked objects out."""

from __future__ import annotations

import pytest
from pydantic import Field

from robots.common.config import Config, parse_config, read_config
from robots.common.errors import InputError


class Inner(Config):
    gain: float = 1.0
    label: str = ""


class Outer(Config):
    count: int = 0
    rate: float = 0.0
    flag: bool = False
    label: str = ""
    inner: Inner = Inner()
    many: list[Inner] = Field(default=[])
    table: dict[str, float] = Field(default={})


def parse(text):
    return parse_config(text, Outer, file="some.yaml")


def test_numbers_are_numbers():
    """Every usual way of writing a number is one, exponents without a point included."""
    for text, value in [("3e-5", 3e-5), ("3E5", 3e5), ("-1.5e+3", -1500.0), (".5", 0.5), ("2", 2.0), ("1.", 1.0)]:
        assert parse(f"rate: {text}").rate == value
    assert parse("rate: .inf").rate == float("inf")
    assert parse("count: 010").count == 10


def test_words_are_words():
    """What looks like a boolean, a time or a date to old YAML is text; true and false alone are booleans."""
    for word in ("yes", "no", "on", "off", "12:30", "2024-01-01", "1_000"):
        assert parse(f"label: {word}").label == word
    assert parse("flag: true").flag is True


@pytest.mark.parametrize(
    ("text", "column", "row", "message"),
    [
        ("cuont: 1", "cuont", 1, "unknown key 'cuont'; allowed: count, rate, .*; did you mean 'count'"),
        (
            "count: 1\ninner:\n  gian: 2",
            "inner.gian",
            3,
            "unknown key 'gian'; allowed: gain, label; did you",
        ),
        ("many:\n- gain: 1\n- gain: 1\n  x: 2", "many[2].x", 4, "unknown key 'x'"),
        ("rate: fast", "rate", 1, "found 'fast'; input should be a valid number"),
        ("rate: true", "rate", 1, "found True"),
        ("rate: '1.5'", "rate", 1, "found '1.5'"),
        ("count: 1.5", "count", 1, "found 1.5"),
        ("label: 5", "label", 1, "found 5; input should be a valid string"),
        ("inner: 5", "inner", 1, "found 5"),
        ("many:\n- gain: [1]", "many[1].gain", 2, "found a list"),
        ("table:\n  a: 1\n  b: x", "table.b", 3, "found 'x'"),
        ("count: 1\ninner: {gain: 1, gain: 2}", "inner.gain", 2, "the key appears twice"),
        ("count: 1\ncount: [", None, 2, "not valid YAML"),
        ("count: 1\n\tlabel: x", None, 2, "not valid YAML"),
        ("a: b: c", None, 1, "not valid YAML: mapping values are not allowed here"),
        ("label: *missing", None, 1, "not valid YAML"),
        ("label: !!python/object:os.system x", None, 1, "not valid YAML"),
        ("count: !!int x", None, None, "not valid YAML"),
        ("? [1, 2]\n: 3", None, 1, "a key that is not plain text"),
        ("label: \x00", None, 1, "not valid YAML"),
        ("- 1\n- 2", None, None, "the file holds a list; allowed: keys and values"),
        ("just text", None, None, "the file holds a str"),
        ("", None, None, "the file is empty"),
        ("# only a comment", None, None, "the file is empty"),
        ("a: 1\n---\nb: 2", None, 2, "not valid YAML"),
        ("1: 2", "1", 1, "unknown key '1'"),
    ],
)
def test_errors_name_the_key_and_the_line(text, column, row, message):
    """An error names the file, the key by its path, its line, and what is allowed."""
    with pytest.raises(InputError, match=message) as caught:
        parse(text)
    assert (caught.value.file, caught.value.column, caught.value.row) == ("some.yaml", column, row)


def test_several_errors_are_counted():
    """Of several errors the first is reported, a misspelt key before its consequences, and the others are counted."""
    with pytest.raises(InputError, match=r"found 'x'; .*2 more problem"):
        parse("rate: x\ncount: y\nflag: z")


def test_an_anchor_may_be_used_twice():
    """Anchors and aliases work, also many of them."""
    assert parse("inner: &a {gain: 2}\nmany: [*a, *a]").many == [Inner(gain=2.0)] * 2
    bomb = "many: &a0 [{gain: 1}]\n" + "\n".join(f"k{i}: &a{i} [*a{i - 1}, *a{i - 1}]" for i in range(1, 40))
    with pytest.raises(InputError, match="unknown key 'k1'"):
        parse(bomb)


def test_a_loop_is_refused():
    """A value that holds itself is refused."""
    with pytest.raises(InputError):
        parse("table: &a {x: *a}")


def test_files_are_read_as_utf8(tmp_path):
    """A file is text in UTF-8, with or without a byte order mark; a missing one is named."""
    path = tmp_path / "a.yaml"
    path.write_bytes("\ufefflabel: \u00fc".encode())
    assert read_config(path, Outer).label == "\u00fc"
    path.write_bytes(b"label: \xff\xfe")
    with pytest.raises(InputError, match=r"a\.yaml: the file is not text in UTF-8"):
        read_config(path, Outer)
    with pytest.raises(InputError, match=r"b\.yaml: no such file"):
        read_config(tmp_path / "b.yaml", Outer)
