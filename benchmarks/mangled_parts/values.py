"""Ways to spoil the values of a log: columns, rows, units, signs."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Columns = dict[str, np.ndarray]
Values = Callable[[Columns, np.random.Generator], Columns]


def _some(rng: np.random.Generator, rows: int, least: int = 1, most: int = 30) -> np.ndarray:
    return rng.choice(rows, size=min(rows, int(rng.integers(least, most))), replace=False)


def _column(columns: Columns, rng: np.random.Generator, prefix: str = "") -> str:
    return str(rng.choice([name for name in columns if name.startswith(prefix) and (prefix or name)]))


def _changed(columns: Columns, name: str, values: np.ndarray) -> Columns:
    return {**columns, name: values}


def drop_columns(c: Columns, rng: np.random.Generator) -> Columns:
    gone = set(rng.choice(list(c), size=int(rng.integers(1, 3)), replace=False))
    return {name: values for name, values in c.items() if name not in gone}


def cut_rows(c: Columns, rng: np.random.Generator) -> Columns:
    rows = len(c["t"])
    first, stop = sorted(rng.integers(0, rows + 1, 2))
    keep = np.ones(rows, dtype=bool)
    if rng.random() < 0.5:
        keep[first:stop] = False
    else:
        keep = ~keep
        keep[first:stop] = True
    return {name: values[keep] for name, values in c.items()}


def thin_rows(c: Columns, rng: np.random.Generator) -> Columns:
    keep = rng.random(len(c["t"])) > rng.uniform(0.02, 0.7)
    return {name: values[keep] for name, values in c.items()}


def repeat_rows(c: Columns, rng: np.random.Generator) -> Columns:
    order = np.sort(np.concatenate([np.arange(len(c["t"])), _some(rng, len(c["t"]), 1, 200)]))
    return {name: values[order] for name, values in c.items()}


def shuffle_rows(c: Columns, rng: np.random.Generator) -> Columns:
    order = np.arange(len(c["t"]))
    for row in _some(rng, len(order) - 1):
        order[[row, row + 1]] = order[[row + 1, row]]
    return {name: values[order] for name, values in c.items()}


def shuffle_time(c: Columns, rng: np.random.Generator) -> Columns:
    return _changed(c, "t", rng.permutation(c["t"]))


def reverse(c: Columns, rng: np.random.Generator) -> Columns:
    return {name: values[::-1] for name, values in c.items()}


def reverse_time(c: Columns, rng: np.random.Generator) -> Columns:
    return _changed(c, "t", c["t"][::-1])


def round_time(c: Columns, rng: np.random.Generator) -> Columns:
    return _changed(c, "t", np.round(c["t"], int(rng.integers(1, 4))))


def jitter_time(c: Columns, rng: np.random.Generator) -> Columns:
    step = float(np.median(np.diff(c["t"])))
    return _changed(c, "t", c["t"] + step * rng.uniform(0, rng.uniform(0.1, 1.5), len(c["t"])))


def not_finite(c: Columns, rng: np.random.Generator) -> Columns:
    name = _column(c, rng)
    values = c[name].copy()
    values[_some(rng, len(values))] = rng.choice([np.nan, np.inf, -np.inf])
    return _changed(c, name, values)


def huge(c: Columns, rng: np.random.Generator) -> Columns:
    name = _column(c, rng)
    values = c[name].copy()
    values[_some(rng, len(values), 1, 4)] = rng.choice([1e6, -1e9, 1e30, 1e300, -1.7e308, 65535.0])
    return _changed(c, name, values)


def spikes(c: Columns, rng: np.random.Generator) -> Columns:
    name = _column(c, rng, str(rng.choice(["q", "tau"])))
    values = c[name].copy()
    rows = _some(rng, len(values), 1, 20)
    values[rows] += rng.choice([-1, 1], len(rows)) * rng.uniform(0.2, 5) * np.ptp(values)
    return _changed(c, name, values)


def zeros(c: Columns, rng: np.random.Generator) -> Columns:
    name = _column(c, rng, str(rng.choice(["q", "tau"])))
    values = c[name].copy()
    values[_some(rng, len(values), 5, 200)] = 0.0
    return _changed(c, name, values)


def swap_columns(c: Columns, rng: np.random.Generator) -> Columns:
    a, b = rng.choice([name for name in c if name != "t"], 2, replace=False)
    return {**c, a: c[b], b: c[a]}


def copy_column(c: Columns, rng: np.random.Generator) -> Columns:
    a, b = rng.choice([name for name in c if name != "t"], 2, replace=False)
    return _changed(c, a, c[b])


def constant_column(c: Columns, rng: np.random.Generator) -> Columns:
    name = _column(c, rng)
    return _changed(c, name, np.full(len(c[name]), float(rng.choice([0.0, 1.0, c[name][0]]))))


def stuck(c: Columns, rng: np.random.Generator) -> Columns:
    name = _column(c, rng, str(rng.choice(["q", "tau"])))
    values = c[name].copy()
    first = int(rng.integers(0, len(values) - 20))
    values[first : first + int(rng.integers(20, max(len(values) // 2, 21)))] = values[first]
    return _changed(c, name, values)


def jump(c: Columns, rng: np.random.Generator) -> Columns:
    name = _column(c, rng, "q")
    values = c[name].copy()
    values[int(rng.integers(1, len(values))) :] += rng.choice([-1, 1]) * rng.uniform(0.3, 6.3)
    return _changed(c, name, values)


def all_degrees(c: Columns, rng: np.random.Generator) -> Columns:
    return {name: np.rad2deg(values) if name.startswith(("q", "dq")) else values for name, values in c.items()}


def one_in_degrees(c: Columns, rng: np.random.Generator) -> Columns:
    name = _column(c, rng, "q")
    return _changed(c, name, np.rad2deg(c[name]))


def milliseconds(c: Columns, rng: np.random.Generator) -> Columns:
    return _changed(c, "t", c["t"] * rng.choice([1e3, 1e6, 1e9]))


def since_1970(c: Columns, rng: np.random.Generator) -> Columns:
    return _changed(c, "t", c["t"] + 1.7e9)


def flip_torque(c: Columns, rng: np.random.Generator) -> Columns:
    name = _column(c, rng, "tau")
    return _changed(c, name, -c[name])


def flip_position(c: Columns, rng: np.random.Generator) -> Columns:
    name = _column(c, rng, "q")
    return _changed(c, name, -c[name])


def motor_torque(c: Columns, rng: np.random.Generator) -> Columns:
    return {name: values / 100.0 if name.startswith("tau") else values for name, values in c.items()}


def motor_position(c: Columns, rng: np.random.Generator) -> Columns:
    return {name: values * 100.0 if name.startswith("q") else values for name, values in c.items()}


def clip(c: Columns, rng: np.random.Generator) -> Columns:
    name = _column(c, rng, "tau")
    limit = np.quantile(np.abs(c[name]), rng.uniform(0.5, 0.95))
    return _changed(c, name, np.clip(c[name], -limit, limit))


def whole_numbers(c: Columns, rng: np.random.Generator) -> Columns:
    name = _column(c, rng, str(rng.choice(["q", "tau"])))
    return _changed(c, name, np.round(c[name], int(rng.integers(0, 2))))


def single_precision(c: Columns, rng: np.random.Generator) -> Columns:
    return {name: values.astype(np.float32).astype(float) for name, values in c.items()}


def delay(c: Columns, rng: np.random.Generator) -> Columns:
    late = int(rng.integers(2, 30))
    return {name: np.roll(values, late) if name.startswith("tau") else values for name, values in c.items()}


def shuffle_torque(c: Columns, rng: np.random.Generator) -> Columns:
    return {name: rng.permutation(values) if name.startswith("tau") else values for name, values in c.items()}


def twice(c: Columns, rng: np.random.Generator) -> Columns:
    return {name: np.concatenate([values, values]) for name, values in c.items()}


def rename(c: Columns, rng: np.random.Generator) -> Columns:
    name = _column(c, rng)
    new = str(
        rng.choice([name.upper(), f" {name}", f"{name} [rad]", f"{name}_", f"0{name}", "q0", "q7", "tau9", "état"])
    )
    return {new if key == name else key: values for key, values in c.items()}


def nothing(c: Columns, rng: np.random.Generator) -> Columns:
    return c


VALUES: tuple[Values, ...] = (
    drop_columns, cut_rows, thin_rows, repeat_rows, shuffle_rows, shuffle_time, reverse, reverse_time, round_time,
    jitter_time, not_finite, huge, spikes, zeros, swap_columns, copy_column, constant_column, stuck, jump, all_degrees,
    one_in_degrees, milliseconds, since_1970, flip_torque, flip_position, motor_torque, motor_position, clip,
    whole_numbers, single_precision, delay, shuffle_torque, twice, rename, nothing,
)  # fmt: skip
