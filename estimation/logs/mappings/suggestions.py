"""The mapping that would fit a table of unknown columns, as text to be saved."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass

import yaml

# Words of a column's name, in English and as German controllers write them, in the order in which quantities are
# recognised. A velocity's name often has a position's.
_WORDS = {
    "temperature": r"temp|temperature|temperatures|temperatur",
    "acceleration": r"ddq|qdd|acc|accel|acceleration|accelerations|beschleunigung",
    "velocity": r"dq|qd|vel|velocity|velocities|speed|speeds|omega|geschwindigkeit|drehzahl",
    "current": r"i|iq|cur|curr|current|currents|amps|strom",
    "torque": r"tau|trq|tq|torque|torques|effort|efforts|moment|moments|mt|tauj|load|loads|drehmoment",
    "position": r"q|qmsr|pos|position|positions|angle|angles|axis|ax|theta|joint|j|mp|encoder|state|winkel|lage|achse",
}
_LOADS = ("current", "torque")
_COMMANDED = re.compile(r"target|desired|des|cmd|command|commanded|ref|reference|setpoint|set|goal|soll|ext|external")
_UNITS = {
    "rad": ("position", "rad"),
    "deg": ("position", "deg"),
    "degree": ("position", "deg"),
    "degrees": ("position", "deg"),
    "°": ("position", "deg"),
    "mrad": ("position", "mrad"),
    "nm": ("torque", "N m"),
    "ma": ("current", "mA"),
    "a": ("current", "A"),
}
_TIME = re.compile(
    r"(?i)ts|epoch|secs?|seconds|millis|t([_ \[(]+[mun]?s(ec)?[\])]?)?|.*(time|stamp|zeit|clock).*"
    r"|(.*[ _])?(date|datum)([ _].*)?"
)
_NANO = re.compile(r"(?i)nano_?s(ec)?|(?<![a-z])nsecs?(?![a-z])")
_TIME_UNITS = {
    "ms": "ms",
    "msec": "ms",
    "us": "us",
    "usec": "us",
    "ns": "ns",
    "nsec": "ns",
    "s": "s",
    "sec": "s",
    "millis": "ms",
}
PLAIN_REMEDY = "rename the columns, or describe them in a mapping (--mapping)"
NO_LOAD = (
    "no column looks like torque or current by its name, and a dynamic model needs one (oed actuators works from "
    "commands and positions)"
)
RATE_REMEDY = "if there is no column of time, state the rows per second, such as --rate 250"
_KEYS = ("position", "velocity", "torque", "current", "temperature")


@dataclass(frozen=True, kw_only=True)
class _Group:
    """Columns whose names differ by the joint only.

    Attributes:
        pattern: with ``{joint}`` or ``{index}``.
        names: in order.
        words: of the pattern, in small letters.
        by_name: whether ``{joint}`` stands for the robot's names of its joints, and not for their numbers.
    """

    pattern: str
    names: tuple[str, ...]
    words: tuple[str, ...]
    by_name: bool = False

    def columns(self, count: int, by_name: bool) -> str:
        """Writes the columns of the first joints: as a pattern, if {joint} means the same in the whole mapping."""
        filled = (self.pattern.replace("{joint}", str(k + 1)).replace("{index}", str(k)) for k in range(count))
        same = self.by_name if "{joint}" in self.pattern and by_name else list(filled) == list(self.names)
        return _text(self.pattern) if same else _list(self.names[:count])


def save_mapping(text: str) -> str:
    """Says what to do with a mapping.

    Args:
        text: the YAML to be saved.
    """
    return f"check this mapping, save it as mapping.yaml and add --mapping mapping.yaml:\n{text}".rstrip()


def remedy_for_columns(names: Sequence[str], n: int | None = None, joints: Sequence[str] | None = None) -> str:
    """Says what to do about a missing column: if possible, with the mapping that would fit.

    Args:
        names: of all columns.
        n: the number of joints, where it is known.
        joints: names of the robot's joints in its order, where they are known.
    """
    if not _time_of(names) and "t" not in names and has_usual_names(names):
        return RATE_REMEDY
    suggested = suggest_mapping(names, n, joints)
    if suggested is None:
        return PLAIN_REMEDY
    if not ("torque:" in suggested or "current:" in suggested):
        return f"{PLAIN_REMEDY}; {NO_LOAD}"
    rate = "" if suggested.startswith("time:") else f"{RATE_REMEDY}; "
    return rate + save_mapping(suggested)


def suggest_mapping(names: Sequence[str], n: int | None = None, joints: Sequence[str] | None = None) -> str | None:
    """Writes the mapping that would fit, by the names of the columns.

    Args:
        names: of all columns.
        n: the number of joints, where it is known.
        joints: names of the robot's joints in its order, where they are known.

    Returns:
        YAML to be saved and checked, without `time` if no column looks like it; None if none looks like positions.
    """
    chosen: dict[str, _Group] = {}
    for group in _groups(names, joints):
        quantity = _quantity(group.words)
        if quantity is None or (n is not None and len(group.names) < n):
            continue
        known = chosen.get(quantity)
        if known is None or _rank(group) < _rank(known):
            chosen[quantity] = group
    position = chosen.get("position")
    time = _time_of(names)
    if position is None:
        return None
    count = n or len(position.names)
    by_name = any(group.by_name for group in chosen.values())
    lines = [_time_line(names, time)] if time else []
    for key in _KEYS:
        found = chosen.get(key)
        if found is None or (key == "current" and "torque" in chosen) or len(found.names) < count:
            continue
        unit = next((unit for word in found.words if (unit := _unit(key, word))), None)
        written = found.columns(count, by_name)
        lines.append(f"{key}: {{columns: {written}{f', unit: {_text(unit)}' if unit else ''}}}")
    if by_name and joints is not None and any("{joint}" in line for line in lines):
        lines.append(f"joints: {_list(joints)}")
    return "\n".join(lines) + "\n"


def _groups(names: Sequence[str], joints: Sequence[str] | None) -> list[_Group]:
    """Collects columns that differ by a joint's name or by one number that counts from 0 or 1."""
    groups = []
    if joints and len(joints) > 1:
        patterns = dict.fromkeys(name.replace(joints[0], "{joint}") for name in names if joints[0] in name)
        for pattern in patterns:
            members = tuple(pattern.replace("{joint}", joint) for joint in joints)
            if set(members) <= set(names):
                words = _words(pattern.replace("{joint}", " "))
                groups.append(_Group(pattern=pattern, names=members, words=words, by_name=True))
    numbered: dict[str, dict[int, str]] = {}
    for name in names:
        for match in re.finditer(r"\d+", name):
            pattern = f"{name[: match.start()]}{{}}{name[match.end() :]}"
            numbered.setdefault(pattern, {})[int(match[0])] = name
    for pattern, counted in numbered.items():
        first = 0 if 0 in counted else 1
        run: list[str] = []
        while first + len(run) in counted:
            run.append(counted[first + len(run)])
        if run and (len(counted) > 1 or len(names) < 8):
            key = "index" if first == 0 else "joint"
            groups.append(_Group(pattern=pattern.replace("{}", f"{{{key}}}"), names=tuple(run), words=_words(pattern)))
    return groups


def _words(pattern: str) -> tuple[str, ...]:
    # Two letters before a capital are a word; one may be a prefix of a unit, as in mNm.
    spaced = re.sub(r"([a-z])([A-Z][a-z])|([a-z]{2})([A-Z])", r"\1\3 \2\4", pattern)
    return tuple(word.lower() for word in re.findall(r"[A-Za-z°]+", spaced))


def _quantity(words: Sequence[str]) -> str | None:
    found = [quantity for quantity, spellings in _WORDS.items() if any(re.fullmatch(spellings, word) for word in words)]
    if found and found[0] in _LOADS:
        # The last word is the noun: a current torque is one, and so is a torque current.
        kinds = (kind for word in reversed(words) for kind in _LOADS if re.fullmatch(_WORDS[kind], word))
        return next(kinds)
    if found:
        return found[0]
    return next((_UNITS[word][0] for word in words if word in _UNITS), None)


def _rank(group: _Group) -> tuple[bool, int, int]:
    """Measured before commanded, then more joints, then the shorter name."""
    commanded = any(_COMMANDED.fullmatch(word) for word in group.words)
    return commanded, -len(group.names), len(group.pattern)


def _unit(key: str, word: str) -> str | None:
    quantity, unit = _UNITS.get(word, (None, ""))
    if quantity == "position" and key == "velocity" and unit in ("rad", "deg"):
        return f"{unit}/s"
    return unit if quantity == key else None


def _time_unit(name: str) -> str:
    words = re.findall(r"[a-z]+", name.lower())
    return next((_TIME_UNITS[word] for word in reversed(words) if word in _TIME_UNITS), "s")


def _time_line(names: Sequence[str], time: str) -> str:
    """Writes the entry of the time; a column of nanoseconds beside one of seconds belongs to it."""
    finer = next((name for name in names if name != time and _NANO.search(name)), None)
    if finer is None or _NANO.search(time):
        return f"time: {{column: {_text(time)}, unit: {_time_unit(time)}}}"
    return f"time: {{column: {_text(time)}, nanoseconds: {_text(finer)}}}"


def _time_of(names: Sequence[str]) -> str | None:
    """Finds the column of time by its name: the shortest that fits."""
    return min((name for name in names if _TIME.fullmatch(name)), key=len, default=None)


def has_usual_names(names: Sequence[str]) -> bool:
    """Whether a table has positions, and torques or currents, under the names of a log; joints count from 0 or 1.

    Args:
        names: of all columns.
    """
    present = set(names)
    return all(
        any(f"{prefix}{number}" in present for prefix in prefixes for number in (0, 1))
        for prefixes in (("q",), ("tau", "i"))
    )


def _text(text: str) -> str:
    """Writes a text for YAML, in quotes where it would read as something else."""
    try:
        return text if yaml.safe_load(f"[{text}]") == [text] else json.dumps(text)
    except yaml.YAMLError:
        return json.dumps(text)


def _list(names: Sequence[str]) -> str:
    return "[" + ", ".join(_text(name) for name in names) + "]"
