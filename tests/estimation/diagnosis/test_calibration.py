"""The constants that decide stand in one file, each with its meaning."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import estimation.diagnosis
from estimation.diagnosis import calibration

PACKAGE = Path(estimation.diagnosis.__file__).parent
# What decides is in these folders. Constants of numerics may stay there: tolerances, sizes of grids, rounds, effort.
FOLDERS = ("hypothesis_tests", "searches", "validations", "simulations", "results")
NUMERICS = {
    "fitted_effects.py": {"ACTS"},
    "power.py": {"DIRECTIONS"},
    "problem.py": {"ROUNDED"},
    "refinement.py": {"EFFORT", "ZOOMS", "AGAIN", "WIDE", "FACTOR", "SHARE", "SHORT_TRAVEL_FACTOR"},
    "scan.py": {"LONG", "PROPOSED", "WIDE", "CHUNK"},
    "acceptance.py": {"SURE", "BETWEEN", "TAIL", "FEWEST", "MOST"},
    "refit.py": {"CUT", "MIN_BASE_CHANGE", "MIN_EFFECT_CHANGE", "MIN_NOISE_CHANGE", "MIN_SLOW_NOISE_CHANGE"},
    "joint_refinement.py": {"RELINEARISATIONS", "CONVERGED", "EFFORT", "ROUNDS", "LEAST_GAIN", "FACTORS"},
    "search.py": {"SEARCHES", "ROUNDS", "SETTLED", "QUIETEST"},
    "selection.py": {"FAR_MORE"},
    "swap_search.py": {"SAME", "RIVALS", "MAX_CANDIDATES", "TWICE"},
    "forward_simulation.py": {"SEEN", "SLUGGISH", "NO_SIGN", "STRETCH", "ENOUGH_ROWS"},
    "name_comparison.py": {"CONTENDERS"},
    "gain_intervals.py": {"PARTS", "RESAMPLES", "BLOCK"},
    "gear_compliance.py": {"ALIGNED", "STIFFEST", "FEWEST", "MOST", "BLOCK"},
    "extended_model.py": {"STRETCH", "POINTS", "FEWEST"},
    "residual_shares.py": {"FEWEST", "SLOW"},
    "simulation_result.py": {"WORSE"},
    "notes.py": {"LITTLE", "MUCH_MORE", "SEVERAL"},
    "report.py": {"SHOWN"},
    "wording.py": {"NOTHING"},
}


def _constants(path: Path) -> list[tuple[str, ast.expr, bool]]:
    """Gives the upper-case names that a module assigns, their values, and whether a docstring follows."""
    body = ast.parse(path.read_text(encoding="utf-8")).body
    found = []
    for statement, after in zip(body, [*body[1:], None], strict=True):
        if not isinstance(statement, ast.Assign):
            continue
        for target in statement.targets:
            for name in target.elts if isinstance(target, ast.Tuple) else [target]:
                if isinstance(name, ast.Name) and name.id.isupper():
                    described = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
                    found.append((name.id, statement.value, described))
    return found


def _is_number(value: ast.expr) -> bool:
    """Whether a value is a number, or a tuple of them."""
    if isinstance(value, ast.UnaryOp):
        return _is_number(value.operand)
    if isinstance(value, ast.Tuple):
        return all(map(_is_number, value.elts))
    return isinstance(value, ast.Constant) and isinstance(value.value, int | float)


def test_every_deciding_constant_states_its_meaning() -> None:
    """Value, unit and meaning of each; each is used."""
    source = "\n".join(path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*.py") if path.stem != "calibration")
    for name, value, described in _constants(PACKAGE / "calibration.py"):
        assert _is_number(value), name
        assert described, f"{name} has no docstring"
        assert name in source, f"{name} is not used"
        assert vars(calibration)[name] > 0


@pytest.mark.slow
@pytest.mark.parametrize("folder", FOLDERS)
def test_constants_that_decide_are_nowhere_else(folder: str) -> None:
    """A new number in these folders is a deciding constant, unless it is listed as one of pure numerics."""
    for path in sorted((PACKAGE / folder).glob("*.py")):
        own = {name for name, value, _ in _constants(path) if _is_number(value)}
        allowed = NUMERICS.get(path.name, set())
        assert own <= allowed, f"{path.name}: move {sorted(own - allowed)} to calibration.py"
        assert allowed <= own, f"{path.name}: {sorted(allowed - own)} is gone; shorten the list"
