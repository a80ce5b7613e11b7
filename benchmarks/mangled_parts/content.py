"""Ways to spoil the content of a file: bytes, text, encodings."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Bytes = Callable[[bytes, np.random.Generator], bytes]

# What ends up in a cell.
CELLS = ("abc", "--", "1.2.3", "", "NaN", "inf", "1e999", "0x1F", "12;5", '"', "#", "１２", "1 2", "-", "True")
REMARKS = ("# pause", "", "end of file", "----", "# units: deg")


def truncate(data: bytes, rng: np.random.Generator) -> bytes:
    return data[: int(rng.integers(0, len(data)))]


def cut_bytes(data: bytes, rng: np.random.Generator) -> bytes:
    first = int(rng.integers(0, len(data)))
    return data[:first] + data[first + int(rng.integers(1, 2000)) :]


def zero_bytes(data: bytes, rng: np.random.Generator) -> bytes:
    first = int(rng.integers(0, len(data)))
    count = int(rng.integers(1, 600))
    return data[:first] + b"\0" * count + data[first + (count if rng.random() < 0.5 else 0) :]


def flip_bytes(data: bytes, rng: np.random.Generator) -> bytes:
    changed = bytearray(data)
    for place in rng.integers(0, len(data), int(rng.integers(1, 20))):
        changed[place] = int(rng.integers(0, 256))
    return bytes(changed)


def empty(data: bytes, rng: np.random.Generator) -> bytes:
    return b""


def prefix(data: bytes, rng: np.random.Generator) -> bytes:
    return rng.bytes(int(rng.integers(1, 50))) + data


def append(data: bytes, rng: np.random.Generator) -> bytes:
    return data + rng.bytes(int(rng.integers(1, 500)))


def double(data: bytes, rng: np.random.Generator) -> bytes:
    return data + data


BYTES: tuple[Bytes, ...] = (truncate, cut_bytes, zero_bytes, flip_bytes, empty, prefix, append, double)


def text_of(change: Callable[[str, np.random.Generator], str]) -> Bytes:
    """Makes a change of text one of bytes."""

    def changed(data: bytes, rng: np.random.Generator) -> bytes:
        return change(data.decode("utf-8", errors="replace"), rng).encode()

    changed.__name__ = change.__name__
    return changed


def garble_cell(text: str, rng: np.random.Generator) -> str:
    lines = text.split("\n")
    for row in rng.choice(len(lines) - 1, int(rng.integers(1, 4)), replace=False):
        cells = lines[row].split(",")
        cells[int(rng.integers(0, len(cells)))] = str(
            rng.choice(
                ["abc", "--", "1.2.3", "", "NaN", "inf", "1e999", "0x1F", "12;5", '"', "#", "１２", "1 2", "-", "True"]
            )
        )
        lines[row] = ",".join(cells)
    return "\n".join(lines)


def lose_digit(text: str, rng: np.random.Generator) -> str:
    place = int(rng.integers(text.find("\n") + 1, len(text)))
    return text[:place] + text[place + 1 :]


def lose_point(text: str, rng: np.random.Generator) -> str:
    points = [place for place, mark in enumerate(text) if mark == "."]
    place = int(rng.choice(points)) if points else 0
    return text[:place] + text[place + 1 :]


def repeat_header(text: str, rng: np.random.Generator) -> str:
    lines = text.split("\n")
    lines.insert(int(rng.integers(1, len(lines))), lines[0])
    return "\n".join(lines)


def lose_header(text: str, rng: np.random.Generator) -> str:
    return text.split("\n", 1)[-1]


def semicolons(text: str, rng: np.random.Generator) -> str:
    return text.replace(",", ";")


def decimal_commas(text: str, rng: np.random.Generator) -> str:
    return text.replace(",", ";").replace(".", ",")


def commas_for_points(text: str, rng: np.random.Generator) -> str:
    return text.replace(".", ",")


def some_semicolons(text: str, rng: np.random.Generator) -> str:
    return "".join(";" if mark == "," and rng.random() < 0.001 else mark for mark in text)


def tabs(text: str, rng: np.random.Generator) -> str:
    return text.replace(",", "\t")


def spaces(text: str, rng: np.random.Generator) -> str:
    return text.replace(",", rng.choice([" ", ", ", " ,"]))


def line_ends(text: str, rng: np.random.Generator) -> str:
    return text.replace("\n", str(rng.choice(["\r\n", "\r", "\n\n", "\u2028"])))


def quotes(text: str, rng: np.random.Generator) -> str:
    return "\n".join(",".join(f'"{cell}"' for cell in line.split(",")) for line in text.strip().split("\n"))


def remark(text: str, rng: np.random.Generator) -> str:
    lines = text.split("\n")
    lines.insert(int(rng.integers(0, len(lines))), str(rng.choice(REMARKS)))
    return "\n".join(lines)


def encode(data: bytes, rng: np.random.Generator) -> bytes:
    text = data.decode("utf-8", errors="replace")
    kind = str(rng.choice(["utf-16", "utf-16-be", "utf-32", "utf-8-sig", "latin-1", "cp500"]))
    return (f"# 20 °C\n{text}" if kind == "latin-1" else text).encode(kind, errors="replace")


TEXT: tuple[Bytes, ...] = (
    *map(text_of, (garble_cell, lose_digit, lose_point, repeat_header, lose_header, semicolons, decimal_commas,
                   commas_for_points, some_semicolons, tabs, spaces, line_ends, quotes, remark)),
    encode,
)  # fmt: skip
