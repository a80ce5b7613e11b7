"""What each dependency weighs once installed: its own files, and what an environment without it would save.

Run it with the Python of the environment that is measured: ``python benchmarks/installed_sizes.py [EXTRA ...]``. Sizes
are those of the files that the installed packages list, in MB of 10^6 bytes.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from functools import cache
from importlib.metadata import Distribution, PackageNotFoundError, distribution

from packaging.requirements import Requirement

PACKAGE = "robot-oed"


@cache
def found(name: str) -> Distribution | None:
    """An installed distribution; None where there is none."""
    try:
        return distribution(name)
    except PackageNotFoundError:
        return None


@cache
def own_size(name: str) -> int:
    """Bytes of a distribution's own files."""
    place = found(name)
    paths = {file.locate() for file in place.files or []} if place else set()
    return sum(path.stat().st_size for path in paths if path.is_file())


@cache
def needs(name: str, extra: str = "") -> tuple[str, ...]:
    """What a distribution requires here, by name."""
    place = found(name)
    requirements = [Requirement(line) for line in (place.requires or [] if place else [])]
    here = [one for one in requirements if one.marker is None or one.marker.evaluate({"extra": extra})]
    return tuple(one.name.lower().replace("_", "-") for one in here if found(one.name))


def closure(names: Iterable[str]) -> set[str]:
    """These distributions and all that they require."""
    reached: set[str] = set()
    waiting = list(names)
    while waiting:
        name = waiting.pop()
        if name not in reached:
            reached.add(name)
            waiting += needs(name)
    return reached


def megabytes(names: Iterable[str]) -> str:
    """The size of distributions together."""
    return f"{sum(own_size(name) for name in names) / 1e6:.1f}"


def main() -> None:
    """Prints one row a requirement, largest first, and the whole."""
    plain = needs(PACKAGE)
    everything = closure(plain)
    rows = []
    for name in plain:
        alone = everything - closure(other for other in plain if other != name)
        rows.append((sum(own_size(one) for one in alone), name, alone))
    for extra in sys.argv[1:]:
        more = closure(set(needs(PACKAGE, extra)) - set(plain)) - everything
        rows.append((sum(own_size(one) for one in more), f"[{extra}]", more))
    print("| package | version | own files [MB] | saved without it [MB] | brings along |\n|---|---|---|---|---|")
    for size, name, alone in sorted(rows, reverse=True):
        place = found(name)
        brought = ", ".join(sorted(alone - {name}, key=own_size, reverse=True)[:6])
        if not alone and name.startswith("["):
            brought = "not installed"
        elif not alone:
            brought = "needed by " + ", ".join(sorted(one for one in everything if name in needs(one))[:6])
        print(f"| {name} | {place.version if place else ''} | {megabytes([name])} | {size / 1e6:.1f} | {brought} |")
    shared = everything - set(plain) - {one for _, _, alone in rows for one in alone}
    print(
        f"| needed by several | | {megabytes(shared)} | | {', '.join(sorted(shared, key=own_size, reverse=True)[:8])} |"
    )
    print(f"| {PACKAGE} | | {megabytes([PACKAGE])} | | |")
    print(f"\n{len(everything)} packages, {megabytes({*everything, PACKAGE})} MB in all")


if __name__ == "__main__":
    main()
