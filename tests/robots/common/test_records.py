"""Results as plain data: what is written, what is read back, and what is said of a damaged file."""

from __future__ import annotations

import importlib
import json
import pkgutil
import re
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Any, Literal, get_type_hints

import numpy as np
import pytest
from numpy.typing import NDArray

import estimation
import oed
import robots
from robots.common.errors import InputError
from robots.common.records import Record, Result, entries_of, plain, read, read_json, read_null_as

ROOT = Path(__file__).parents[3]


class Colour(Enum):
    RED = "red"


@dataclass(frozen=True, kw_only=True)
class Part:
    name: str
    size: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Whole(Result, format="test whole", version=2, shares=("labels",)):
    """A result with a bit of everything."""

    FILE = "whole.json"
    conclusion = "Nothing follows."
    ENTRIES = (
        "values",
        "flags",
        "colour",
        "kind",
        "ci95=low,high",
        "inside.part=part",
        "parts",
        "pair",
        "run=labels[run]",
        "first=parts[0].name",
        "nothing=part.name?",
        "text?",
        "open",
        "sentence",
    )

    labels: tuple[str, ...] = ("a", "b")
    run: int | None = 1
    values: NDArray[np.float64]
    flags: NDArray[np.bool_]
    colour: Colour
    kind: Literal["one", "two"]
    low: float
    high: float
    part: Part | None
    parts: tuple[Part, ...]
    pair: tuple[int, str] = (1, "x")
    text: str = ""
    open: float = field(default=0.0, metadata=read_null_as(np.inf))

    def sentence(self, labels: tuple[str, ...]) -> str:
        """Says something with what is shared."""
        return f"runs {', '.join(labels)}"

    def summary(self) -> str:
        """Says <something>."""
        return "a < b"


def whole(**changes: Any) -> Whole:
    values: dict[str, Any] = {
        "values": np.array([[1.0, np.nan]]),
        "flags": np.array([True, False]),
        "colour": Colour.RED,
        "kind": "two",
        "low": -np.inf,
        "high": 2.0,
        "part": None,
        "parts": (Part(name="p", size=np.float64(3.0)),),
        "open": np.inf,
    }
    return Whole(**values | changes)


DATA = {
    "format": "test whole",
    "format_version": 2,
    "values": [[1.0, None]],
    "flags": [True, False],
    "colour": "red",
    "kind": "two",
    "ci95": [None, 2.0],
    "inside": {"part": None},
    "parts": [{"name": "p", "size": 3.0}],
    "pair": [1, "x"],
    "run": "b",
    "first": "p",
    "nothing": None,
    "open": None,
    "sentence": "runs a, b",
}


def test_all_kinds_of_values_are_written_in_the_order_of_the_entries():
    """Arrays, enumerations, records, lists of attributes, objects inside; what is not finite is null."""
    assert json.dumps(whole().to_dict()) == json.dumps(DATA)
    assert whole(text="more").to_dict()["text"] == "more"
    assert plain(np.float32(0.5)) == 0.5
    assert plain({1: np.int64(2), "path": Path("a")}) == {"1": 2, "path": "a"}


def test_what_was_written_is_read_back(tmp_path: Path):
    """A null is NaN, or what the field states; entries that are no fields are ignored; later fields have defaults."""
    whole().save(tmp_path)
    data = read_json(tmp_path / "whole.json", "test whole", 2, remedy="do it again")
    del data["pair"]
    again = Whole.from_dict(data, labels=("a", "b"))
    assert again.to_dict() == DATA
    assert np.isnan(again.low)
    assert again.open == np.inf
    assert again.values.dtype == float
    assert again.flags.dtype == bool
    with pytest.raises(InputError, match="the file exists"):
        whole().save(tmp_path)
    assert again._repr_html_() == "<pre>a &lt; b</pre>"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"kind": "three"}, 'column kind: found "three"; allowed: one, two'),
        ({"colour": "blue"}, 'column colour: found "blue"; allowed: red'),
        ({"ci95": [1.0]}, "column ci95: found [1.0]; allowed: a list of 2"),
        ({"ci95": ["x", 2.0]}, 'column ci95: found "x"; allowed: a number'),
        ({"parts": [{"name": "p"}]}, "column parts[1].size: is missing"),
        ({"parts": [{"name": 1, "size": 1}]}, "column parts[1].name: found 1; allowed: a text"),
        ({"inside": {}}, "column inside.part: is missing"),
        ({"values": [[1.0], [1.0, 2.0]]}, "column values: found [[1.0], [1.0, 2.0]]; allowed: a list of numbers"),
        ({"pair": [1.5, "x"]}, "column pair[1]: found 1.5; allowed: a whole number"),
        ({"pair": [1]}, "column pair: 1 values; allowed: 2"),
        ({"parts": 3}, "column parts: found 3; allowed: a list"),
    ],
)
def test_a_damaged_entry_is_named_with_file_and_remedy(change: dict[str, Any], words: str):
    """The message says where in the file, what was found, what is allowed, and what to do."""
    with pytest.raises(InputError, match=re.escape(words)) as caught:
        Whole.from_dict(DATA | change, file="some.json", remedy="do it again")
    assert str(caught.value).startswith("some.json: ")
    assert str(caught.value).endswith("; do it again")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"{", "is not a test whole file"),
        (b"\xff", "is not a test whole file"),
        (b"[]", "is not a test whole file"),
        (b'{"format": "other"}', 'allowed: "format": "test whole"'),
        (b'{"format": "test whole", "format_version": 3}', "format version 3; allowed: up to 2"),
        (b'{"format": "test whole"}', "format version None"),
    ],
)
def test_foreign_and_newer_files_are_refused(content: bytes, words: str, tmp_path: Path):
    """Text that is no JSON, bytes, other formats, and versions that this one does not know."""
    file = tmp_path / "whole.json"
    file.write_bytes(content)
    with pytest.raises(InputError, match=words) as caught:
        read_json(file, "test whole", 2, remedy="do it again")
    assert "whole.json" in str(caught.value)
    assert "do it again" in str(caught.value)


def test_a_missing_file_is_answered_with_what_to_give(tmp_path: Path):
    """The message says which file would do."""
    with pytest.raises(InputError, match="no such file; do it again"):
        read_json(tmp_path / "none.json", remedy="do it again")


def test_values_of_other_kinds_are_refused():
    """A whole number may be written as 8.0; a truth value is no number."""
    assert read(int, 8.0) == 8
    for kind, value in ((float, True), (int, True), (dict[str, float], []), (bool, 1), (Part, [])):
        with pytest.raises(InputError):
            read(kind, value)


def subclasses(kind: type) -> set[type]:
    found = set(kind.__subclasses__())
    return found | {deeper for one in found for deeper in subclasses(one)}


@pytest.mark.slow
def test_entries_of_all_records_name_attributes():
    """Every entry names a field or attribute of its class, or what is shared; every result has a conclusion."""
    for package in (robots, estimation, oed):
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if not module.name.endswith("__main__"):
                importlib.import_module(module.name)
    silent = [kind.__name__ for kind in subclasses(Result) if kind.FILE and kind.conclusion is Result.conclusion]
    assert set(silent) <= {"Planned", "Whole"}
    ours = [kind for kind in subclasses(Record) if kind.__module__.split(".")[0] in ("robots", "estimation", "oed")]
    assert len(ours) > 60
    shared = {text.partition("=")[0] for kind in ours for text in kind._shares}
    unknown = []
    for kind in ours:
        if kind in (Result,) or not (kind.ENTRIES or hasattr(kind, "__dataclass_fields__")):
            continue
        names = set(dir(kind)) | set(get_annotations(kind))
        for entry in entries_of(kind):
            first = [re.split(r"[.\[?]", path)[0] for path in entry.paths]
            unknown += [(kind.__name__, name) for name in first if name not in names | shared | instance_names(kind)]
    assert unknown == []


def get_annotations(kind: type) -> dict[str, Any]:
    """Annotations of a class and its bases, as they are written."""
    return {name: hint for one in kind.__mro__ for name, hint in vars(one).get("__annotations__", {}).items()}


def instance_names(kind: type) -> set[str]:
    """Attributes that the constructor of a class without fields sets."""
    init = vars(kind).get("__init__")
    return set() if init is None or hasattr(kind, "__dataclass_fields__") else set(init.__code__.co_names)


def test_no_class_copies_its_fields_by_hand():
    """There is one `to_dict` and one `from_dict`, those of the records."""
    own = ROOT / "robots/common/records/record.py"
    written = [
        str(path.relative_to(ROOT))
        for package in ("robots", "estimation", "oed")
        for path in (ROOT / package).rglob("*.py")
        if path != own and re.search(r"def (to|from)_dict\b", path.read_text(encoding="utf-8"))
    ]
    assert written == []


def test_hints_of_records_that_are_read_can_be_resolved():
    """The types of a record's fields are known where it is read: none is imported for type checkers only."""
    from estimation.diagnosis.findings import Finding
    from estimation.monitoring.evaluation import Evaluation

    assert get_type_hints(Finding)["rivals"] == tuple[tuple[str, float], ...]
    assert "forces" in get_type_hints(Evaluation)


FILES = json.loads((Path(__file__).parent / "data" / "records_1.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", FILES)
def test_what_an_earlier_version_wrote_is_read_and_written_the_same(name: str):
    """Records of version 1 files, as they were written when each class copied its fields by itself."""
    module, _, kind = name.rpartition(".")
    record = getattr(importlib.import_module(module), kind).from_dict(FILES[name], file="file.json")
    assert json.dumps(record.to_dict()) == json.dumps(FILES[name])
