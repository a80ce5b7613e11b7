"""The effects of the catalogue as a table."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from typing import Any

from robots.common.errors import InputError
from robots.geometry.urdf_selection import nearest


def effect_rows() -> list[dict[str, Any]]:
    """Describes each effect of the catalogue, those of installed packages included.

    Returns:
        One mapping an effect, with its name, title, where it acts, the parameters of its shape with their units, the
        effects that resemble it, and the kinds of experiment that separate it from them, the best first.
    """
    from robots.terms.effect_bases.capabilities import Persistence
    from robots.terms.effects import EFFECTS, EXPERIMENTS

    return [
        {
            "name": effect.name,
            "title": effect.title,
            "acts_on": "robot" if effect.whole_robot else "joint",
            "rare": effect.rare,
            "lasting": effect.persistence is Persistence.STATE,
            "shape": [{"name": shape.name, "unit": shape.unit} for shape in effect.shapes],
            "rivals": list(effect.rivals),
            "experiments": [
                {"name": name, "what": EXPERIMENTS.get(name, name.replace("_", " "))} for name in effect.experiments
            ],
        }
        for effect in EFFECTS.values()
    ]


def explained_effect(name: str) -> dict[str, Any]:
    """Describes one effect: what `effect_rows` has, and a text with its formula and parameters.

    Args:
        name: of the effect.

    Raises:
        InputError: no such effect.
    """
    from robots.terms.effects import EFFECTS

    if name not in EFFECTS:
        raise InputError(f"there is no effect {name!r}", allowed=", ".join(EFFECTS), remedy=nearest(name, EFFECTS))
    row: dict[str, Any] = next(row for row in effect_rows() if row["name"] == name)
    effect, place = EFFECTS[name], "the whole robot" if row["acts_on"] == "robot" else "one joint"
    shapes = [f"  {shape['name']}" + (f" [{shape['unit']}]" if shape["unit"] else "") for shape in row["shape"]]
    lines = [
        f"{name}: {row['title']}. It acts on {place}.",
        *(["It is considered last: it resembles a common effect and is rare."] if row["rare"] else []),
        "",
        inspect.cleandoc(type(effect).__doc__ or ""),
        *(["", "Parameters beside the coefficients:", *shapes] if shapes else []),
        *(["", f"It resembles: {', '.join(row['rivals'])}."] if row["rivals"] else []),
        *(["", "Experiments that separate it, the best first:"] if row["experiments"] else []),
        *(f"  {experiment['name']}: {experiment['what']}" for experiment in row["experiments"]),
    ]
    return {**row, "text": "\n".join(lines)}


def effect_text(rows: Sequence[Mapping[str, Any]]) -> str:
    """Writes the table, and below it what the experiments are.

    Args:
        rows: as `effect_rows` gives them.
    """
    head = ("effect", "on", "what it is", "experiments that separate it")
    cells = [
        (
            row["name"] + (" *" if row["rare"] else ""),
            row["acts_on"],
            row["title"],
            ", ".join(experiment["name"] for experiment in row["experiments"]) or "-",
        )
        for row in rows
    ]
    widths = [max(len(line[column]) for line in (head, *cells)) for column in range(3)]
    lines = [
        "  ".join([*(cell.ljust(width) for cell, width in zip(line, widths, strict=False)), line[3]])
        for line in (head, *cells)
    ]
    kinds = {experiment["name"]: experiment["what"] for row in rows for experiment in row["experiments"]}
    width = max((len(name) for name in kinds), default=0)
    return "\n".join(
        [
            *lines,
            "* considered last: it resembles a common effect and is rare",
            "",
            "A diagnosis searches each log for all of them. If several explain it, these experiments separate them:",
            *(f"  {name.ljust(width)}  {what}" for name, what in kinds.items()),
        ]
    )
