"""Statistics have one home, `estimation/uncertainty`: elsewhere no quantile is typed, and nothing correlated anew."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
HOME = ROOT / "estimation" / "uncertainty"
# They share no code with the program, by contract.
APART = (ROOT / "oed" / "benchmarks" / "rivals", ROOT / "oed" / "benchmarks" / "truth")
FILES = sorted(
    path
    for package in ("robots", "estimation", "oed")
    for path in (ROOT / package).rglob("*.py")
    if not any(folder in path.parents for folder in (HOME, *APART))
)
# Quantiles of the normal distribution and of chi-square with one degree of freedom, by the first three digits.
TYPED = (1.645, 1.96, 2.576, 3.84, 0.6745, 1.4826, 0.455)
# Robots import nothing of the estimation: two effects write the median of a normal variable.
OF_ROBOTS = {"current_clipping.py": {1.4826}, "external_contact.py": {0.455}}


def typed_quantiles(tree: ast.AST) -> set[float]:
    """The numbers of a file that are a quantile to three digits or more."""
    numbers = {node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and type(node.value) is float}
    return {value for value in numbers for known in TYPED if value and abs(value / known - 1.0) < 4e-4}


def asked_quantiles(tree: ast.AST) -> set[str]:
    """The quantile functions of scipy that a file calls."""
    names = {node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
    names |= {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    return names & {"ppf", "isf", "ndtri", "chdtri", "stdtrit"}


def called(node: ast.AST) -> str:
    """The last name of what a node calls; nothing of another node."""
    function = node.func if isinstance(node, ast.Call) else None
    return function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")


def correlates(function: ast.AST) -> bool:
    """Whether a function takes the square or the conjugate of a spectrum that it transforms, and transforms back."""
    nodes = list(ast.walk(function))
    named = [node for node in nodes if isinstance(node, ast.Assign) and called(node.value) in ("fft", "rfft")]
    spectra = {target.id for node in named for target in node.targets if isinstance(target, ast.Name)}

    def is_spectrum(node: ast.AST) -> bool:
        return called(node) in ("fft", "rfft") or (isinstance(node, ast.Name) and node.id in spectra)

    squared = [node for node in nodes if called(node) in ("abs", "conj", "conjugate")]
    inside = [[*node.args, *([node.func.value] if isinstance(node.func, ast.Attribute) else [])] for node in squared]
    back = any(called(node) in ("ifft", "irfft") for node in nodes)
    return back and any(is_spectrum(part) for parts in inside for part in parts)


def functions(tree: ast.AST) -> list[ast.AST]:
    return [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]


@pytest.fixture(scope="module")
def trees() -> dict[Path, ast.AST]:
    return {path: ast.parse(path.read_text(encoding="utf-8")) for path in FILES}


def test_no_quantile_is_typed(trees):
    """No file outside the home holds 1.96 or its like, or asks scipy for a quantile."""
    found = {path.name: typed_quantiles(tree) - OF_ROBOTS.get(path.name, set()) for path, tree in trees.items()}
    assert {name: values for name, values in found.items() if values} == {}
    assert {path.name: names for path, tree in trees.items() if (names := asked_quantiles(tree))} == {}


def test_no_autocorrelation_is_written_again(trees):
    """No function outside the home makes an autocorrelation by Fourier transforms."""
    found = [f"{path.name}: {own.name}" for path, tree in trees.items() for own in functions(tree) if correlates(own)]
    assert found == []


def test_the_search_finds_what_it_looks_for():
    """What was written eight times is recognised, and a low-pass by Fourier transforms is not."""
    (own,) = functions(ast.parse("def f(x):\n    return np.fft.irfft(np.abs(np.fft.rfft(x, 2 * len(x))) ** 2)"))
    (cross,) = functions(ast.parse("def f(a, b):\n    s = rfft(a) * rfft(b).conj()\n    return irfft(s)"))
    (other,) = functions(ast.parse("def f(x, gain):\n    return irfft(rfft(x) * gain)"))
    assert correlates(own)
    assert correlates(cross)
    assert not correlates(other)
    assert typed_quantiles(ast.parse("a = 1.96\nb = 1.959964\nc = 1.95\nd = 3.841")) == {1.96, 1.959964, 3.841}
    assert asked_quantiles(ast.parse("scipy.stats.norm.ppf(0.975)")) == {"ppf"}
