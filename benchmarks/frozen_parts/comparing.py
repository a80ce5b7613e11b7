"""What differs between two runs of the frozen sets."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.diagnosis import read_rows

# Keys whose values are sentences, and what differs by time or machine alone.
TEXTS = frozenset(
    {"notes", "unseen", "sentence", "why", "note", "pattern", "advice", "assumed", "text", "action", "problem"}
    | {"warnings", "found", "stands_for", "detail"}
)
OF_THE_RUN = frozenset({"seconds", "tool_version"})
# Two runs on one machine differ by less, unless something else was computed.
RELATIVE, ABSOLUTE = 1e-6, 1e-9


def structure(value: Any, *, texts: bool = False) -> Any:
    """Leaves texts, and what is only of the run, out of plain data."""
    if isinstance(value, dict):
        left_out = OF_THE_RUN if texts else OF_THE_RUN | TEXTS
        return {key: structure(item, texts=texts) for key, item in value.items() if key not in left_out}
    if isinstance(value, list | tuple):
        return [structure(item, texts=texts) for item in value]
    return value


def differences(old: Any, new: Any, relative: float = RELATIVE, at: str = "") -> Iterator[str]:
    """Lists where two structures differ by more than rounding."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in sorted(old.keys() | new.keys()):
            if key not in old or key not in new:
                yield f"{at}.{key}: only in the {'old' if key in old else 'new'}"
            else:
                yield from differences(old[key], new[key], relative, f"{at}.{key}")
    elif isinstance(old, list) and isinstance(new, list):
        if len(old) != len(new):
            yield f"{at}: {len(old)} entries, now {len(new)}"
        for k, (before, after) in enumerate(zip(old, new, strict=False)):
            yield from differences(before, after, relative, f"{at}[{k}]")
    elif isinstance(old, float) and isinstance(new, int | float):
        both_nan = math.isnan(old) and math.isnan(new)
        if not both_nan and not math.isclose(old, new, rel_tol=relative, abs_tol=ABSOLUTE):
            yield f"{at}: {old:.8g}, now {new:.8g}"
    elif old != new:
        yield f"{at}: {old!r}, now {new!r}"


def headline(row: dict[str, Any]) -> str:
    """One line of what a row says."""
    named = ", ".join(f"{f['effect']} {f['joint'] or ''}".strip() for f in row.get("findings", ()) if "effect" in f)
    said = row.get("refused") if isinstance(row.get("refused"), str) else row.get("verdict", row.get("result", "done"))
    return f"{said}: {named}" if named else str(said)


def compare(old: Path, new: Path, *, most: int = 5, relative: float = RELATIVE, texts: bool = False) -> int:
    """Prints the differences of two runs; the exit code is 1 where there are any.

    Args:
        old: rows of the earlier version.
        new: rows of the later one.
        most: differences printed of one row.
        relative: numbers that differ by a smaller share are the same.
        texts: compare sentences, too.
    """
    before, after = ({row["key"]: row for row in read_rows(path)} for path in (old, new))
    common = sorted(before.keys() & after.keys())
    changed: Counter[str] = Counter()
    for key in common:
        pair = (structure(rows[key], texts=texts) for rows in (before, after))
        found = list(differences(*pair, relative))
        if found:
            changed[part_of(key)] += 1
            print(f"{key}: {headline(before[key])} -> {headline(after[key])}; {len(found)} values differ")
            print(*(f"    {line}" for line in found[:most]), sep="\n")
    for part, count in sorted(Counter(map(part_of, common)).items()):
        own = [key for key in common if part_of(key) == part]
        times = [sum(rows[key].get("seconds", 0.0) for key in own) for rows in (before, after)]
        ratio = f"; processor time {times[1] / times[0]:.2f} of the old" if all(times) else ""
        print(f"{part}: {count - changed[part]} of {count} rows are the same{ratio}")
    print(
        f"{len(common) - changed.total()} of {len(common)} rows are the same; {len(before) - len(common)} were not run"
    )
    return 1 if changed or not common else 0


def part_of(key: str) -> str:
    """The part that a row belongs to."""
    return key.split("/")[0]
