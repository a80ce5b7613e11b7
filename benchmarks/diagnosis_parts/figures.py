"""The figures of a benchmark as text, each beside what is wanted."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from benchmarks.diagnosis_parts.statistics import (
    CHANGE_TIME,
    NONLINEAR,
    SHAPES,
    TIMES,
    Row,
    both,
    detected,
    errors_left,
    file_over_reported,
    first_is_right,
    gain_ratios,
    in_the_set,
    named_right,
    parameter_errors,
    share,
    spurious,
    within_limits,
)


def figures(rows: Sequence[Row]) -> str:
    """Writes all figures that the rows hold."""
    of: dict[str, list[Row]] = defaultdict(list)
    for row in rows:
        if row["status"] == "done":
            of[row["stratum"]].append(row)
    one, half = of["one"], of["half"]
    found = [row for row in half + one if detected(row)]
    lines = [
        share("false alarms, no effect", of["none"], detected, "1 % or less"),
        share("  periodic", [r for r in of["none"] if r["motion"] == "periodic"], detected, ""),
        share("  aperiodic", [r for r in of["none"] if r["motion"] != "periodic"], detected, ""),
        share("detected at 0.5 % visible", half, detected, "98 %"),
        *(
            share(f"  in logs of {duration:.0f} s", [r for r in half if r["duration"] == duration], detected, "")
            for duration in sorted({row["duration"] for row in half})
        ),
        share("effect and joint right among detected, .5 and 1 %", found, first_is_right, "97 %"),
        share("  truth first or among the rivals", found, in_the_set, ""),
        share("detected at 1 % visible", one, detected, ""),
        share("first name right at 1 % visible", one, named_right, "95 %"),
        share("  nothing false named beside it", one, lambda row: not spurious(row), ""),
        share("detected, of those above the limit that is stated", filter(within_limits, half + one), detected, "95 %"),
        share("two effects at 3 %: both named", of["two"], both, "95 %"),
        share("  of those above the limits that are stated", filter(within_limits, of["two"]), both, ""),
        share("  a spurious one", of["two"], spurious, "2 % or less"),
        share(
            "outside the catalogue at 1 %: unexplained",
            of["stranger"],
            lambda row: row["verdict"] == "unexplained",
            "85 %",
        ),
        share("  wrongly named", of["stranger"], spurious, "5 % or less"),
        share("moves with pauses: false alarms, no effect", of["idle_moves"], detected, "1 % or less"),
        share("  detected at 1 % visible", of["moves"], detected, ""),
        share("  first name right at 1 % visible", of["moves"], named_right, "95 %"),
        share("  nothing false named beside it", of["moves"], lambda row: not spurious(row), ""),
        share("described without drives: detected at 1 % visible", of["bare"], detected, ""),
        share("  first name right at 1 % visible", of["bare"], named_right, "95 %"),
        share("  nothing false named beside it", of["bare"], lambda row: not spurious(row), ""),
        share("noise that wanders for up to a second: false alarms", of["slow_none"], detected, "1 % or less"),
        share("  detected at 1 % visible", of["slow"], detected, ""),
        share("  first name right at 1 % visible", of["slow"], named_right, "95 %"),
        share("  nothing false named beside it", of["slow"], lambda row: not spurious(row), ""),
        *_gains(half + one + of["two"]),
        *_parameters(half + one + of["two"]),
        *_followed(half + one + of["brief"]),
        *_cost([row for rows_of in of.values() for row in rows_of]),
    ]
    bad = [row for row in rows if row["status"] in ("failed", "refused")]
    lines.append(share("ended in an error", [r for r in rows if r["status"] != "hidden"], lambda r: r in bad, "0 %"))
    hidden = sum(row["status"] == "hidden" for row in rows)
    lines.append(f"  {hidden} cases left out: no robot shows their effect at the size with a plausible value")
    return "\n".join([*lines, "", *_by_effect(half, one)])


def _gains(rows: Sequence[Row]) -> list[str]:
    ratios = {name: gain_ratios(rows, f"oracle_{name}") for name in ("as_measured", "after")}
    left = errors_left(rows)
    if not len(left):
        return ["  gain on unseen motion over the true effect's own: no case"]
    lines = []
    for name, known in (("as_measured", "as logged"), ("after", "known")):
        if len(ratios[name]):
            text = f"gain over the true effect's own, motion {known}, {len(ratios[name])} cases"
            median, low = np.median(ratios[name]), np.quantile(ratios[name], 0.1)
            lines.append(f"  {text:58} median {median:.2f}, lowest tenth {low:.2f}   wanted .97 and .85")
    files = file_over_reported(rows)
    if len(files):
        text = f"the model's file over what is reported of it, {len(files)} joints"
        low, middle, high = (np.quantile(files, share) for share in (0.05, 0.5, 0.95))
        lines.append(f"  {text:58} median {middle:.2f}, nine tenths {low:.2f} to {high:.2f}, largest {files.max():.2f}")
    other = f"error left there over that of the true effect's own, {len(left)}"
    return [*lines, f"  {other:58} median {np.median(left):.2f}, highest tenth {np.quantile(left, 0.9):.2f}"]


def _parameters(rows: Sequence[Row]) -> list[str]:
    times, shapes = parameter_errors(rows, TIMES), parameter_errors(rows, SHAPES)
    well = [e for e in shapes if not e["marked"]]
    stated = [e for e in shapes + times if e["stated"]]
    return [
        share("change times within .2 s", times, lambda e: e["absolute"] <= CHANGE_TIME, "all"),
        share(
            "  within .2 s or reported as less sure", times, lambda e: e["absolute"] <= CHANGE_TIME or e["marked"], ""
        ),
        share("nonlinear parameters within 20 %, if determined", well, lambda e: e["relative"] <= NONLINEAR, "all"),
        share(
            "  within 20 % or marked as not determined", shapes, lambda e: e["relative"] <= NONLINEAR or e["marked"], ""
        ),
        share("  their stated interval holds the truth", stated, lambda e: e["inside"], "95 %"),
    ]


def _followed(rows: Sequence[Row]) -> list[str]:
    unclear = [row for row in rows if row["verdict"] == "ambiguous"]
    tried = [row for row in unclear if row.get("after") and row["after"].get("kind")]

    def resolved(row: Row) -> bool:
        after = row["after"]
        truth = [(e["effect"], e["joint"]) for e in row["truth"]]
        first = [(f["effect"], f["joint"]) for f in after["findings"][:1]]
        return after["verdict"] == "named" and bool(first) and first[0] in truth

    return [
        share("ambiguous at .5 and 1 %, short logs too", rows, lambda row: row["verdict"] == "ambiguous", ""),
        share("  resolved, and rightly, after the one experiment", tried, resolved, "90 %"),
    ]


def _cost(rows: Sequence[Row]) -> list[str]:
    if not rows:
        return []
    cpu, wall = np.array([r["cpu"] for r in rows]), np.array([r["wall"] for r in rows])
    memory = max(r["memory"] for r in rows)
    text = f"median {np.median(cpu):.1f} s of CPU, {np.median(wall):.1f} s of wall, at most {cpu.max():.1f} s of CPU"
    return [
        f"  {'one diagnosis, false-alarm control and limits included':58} {text}",
        f"  {'memory of its process':58} {memory:.0f} MB",
    ]


def _by_effect(half: Sequence[Row], one: Sequence[Row]) -> list[str]:
    kinds = sorted({row["truth"][0]["kind"] for row in [*half, *one]})
    lines = ["  effect                 detected .5 %  right .5 %  detected 1 %  right 1 %   mistaken for"]
    for kind in kinds:
        cells, wrong = [], []
        for rows in (half, one):
            mine = [row for row in rows if row["truth"][0]["kind"] == kind]
            cells += [f"{sum(map(detected, mine))}/{len(mine)}", f"{sum(map(first_is_right, mine))}/{len(mine)}"]
            wrong += [_said(row) for row in mine if detected(row) and not first_is_right(row)]
        lines.append(f"  {kind:22} {cells[0]:>13} {cells[1]:>11} {cells[2]:>13} {cells[3]:>10}   {', '.join(wrong)}")
    return lines


def _said(row: Row) -> str:
    if not row["findings"]:
        return str(row["verdict"])
    first = row["findings"][0]
    return f"{first['effect']} {first['joint'] or ''}".strip() + f" (seed {row['seed']})"
