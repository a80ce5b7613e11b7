"""What is installed: libraries with their versions, extras, a compiler."""

from __future__ import annotations

import os
import platform
import re
import sys
from importlib.metadata import PackageNotFoundError, requires, version
from typing import Any

PACKAGE = "robot-oed"

EXTRAS = {
    "mat": "MATLAB files of version 7.3",
    "ros": "ROS bags",
    "mujoco": "MuJoCo models (MJCF)",
    "cluster": "work on a Dask cluster (`--cluster`)",
    "monitor": "change points of monitored logs",
    "xacro": "robot descriptions in xacro",
}
"""What the extras bring to users; those that are not listed are for developers."""

_REQUIREMENT = re.compile(r"([A-Za-z0-9._-]+)\s*(?:\[.*?\])?\s*\(?([^;)]*)\)?\s*(?:;\s*(.*))?")
_SYSTEM = re.compile(r"""sys_platform\s*(==|!=)\s*['"](\w+)['"]""")
_EXTRA = re.compile(r"""extra\s*==\s*['"]([\w-]+)['"]""")


def installation() -> dict[str, Any]:
    """Describes the installation.

    Returns:
        ``version``, ``python``, ``platform``, ``cores``; ``libraries`` with the name, version, requirement and status
        of each (``ok``, ``missing`` or ``too old``); ``extras`` with what they bring, whether they are complete, and
        how to install them; the path of the C ``compiler``, None without one; ``problems`` in sentences.
    """
    from robots.version import VERSION

    libraries: list[dict[str, Any]] = []
    extras: dict[str, list[dict[str, Any]]] = {name: [] for name in EXTRAS}
    for name, wanted, extra in requires_of():
        entry = _library(name, wanted)
        if extra is None:
            libraries.append(entry)
        elif extra in EXTRAS:
            extras[extra].append(entry)
    offered = [
        {
            "name": name,
            "brings": EXTRAS[name],
            "installed": all(entry["status"] == "ok" for entry in entries),
            "libraries": entries,
            "install": f"pip install '{PACKAGE}[{name}]'",
        }
        for name, entries in extras.items()
        if entries
    ]
    problems = [
        f"{entry['name']} is {entry['status']} (found: {entry['version']}, needed: {entry['needed'] or 'any'})"
        for entry in libraries
        if entry["status"] != "ok"
    ]
    if not libraries:
        problems = [f"{PACKAGE} is not installed: its libraries are not known; run `pip install .` in its folder"]
    return {
        "version": VERSION,
        "python": platform.python_version(),
        "platform": platform.platform(terse=True),
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1,
        "executable": sys.executable,
        "libraries": libraries,
        "extras": offered,
        "compiler": _compiler(),
        "problems": problems,
    }


def with_configuration(found: dict[str, Any], state: dict[str, Any]) -> dict[str, Any]:
    """Adds the configuration file to the description of an installation.

    Args:
        found: as `installation` gives it.
        state: ``file``, ``origin``, ``keys`` and ``problem``, as `configuration_state` gives them.
    """
    problem = state["problem"]
    return {**found, "configuration": state, "problems": [*found["problems"], *([problem] if problem else [])]}


def requires_of(package: str = PACKAGE) -> list[tuple[str, str, str | None]]:
    """Lists what a package requires: name, versions, and the extra that asks for it.

    Args:
        package: its name; of one that is not installed, nothing is known.
    """
    try:
        lines = requires(package) or []
    except PackageNotFoundError:
        return []
    found = []
    for line in lines:
        match = _REQUIREMENT.match(line)
        if match is not None and _here(match[3] or ""):
            extra = _EXTRA.search(match[3] or "")
            found.append((match[1], (match[2] or "").strip(), extra[1] if extra else None))
    return found


def _here(marker: str) -> bool:
    """Whether a requirement with this marker is one on this operating system."""
    found = _SYSTEM.search(marker)
    return found is None or (sys.platform == found[2]) == (found[1] == "==")


def installation_text(found: dict[str, Any]) -> str:
    """Writes the description of an installation.

    Args:
        found: as `installation` gives it, with or without the configuration file.
    """
    lines = [
        f"{PACKAGE} {found['version']}, Python {found['python']}, {found['platform']}, {found['cores']} cores",
        f"C compiler: {found['compiler'] or 'none; results are the same, but designs take longer'}",
        *([_configuration_line(found["configuration"])] if "configuration" in found else []),
        "Libraries:",
    ]
    width = max((len(entry["name"]) for entry in found["libraries"]), default=0)
    for entry in found["libraries"]:
        state = "" if entry["status"] == "ok" else f"  {entry['status']}, needed: {entry['needed'] or 'any version'}"
        lines.append(f"  {entry['name'].ljust(width)}  {entry['version'] or '-'}{state}")
    if found["extras"]:
        lines.append("Extras:")
    for extra in found["extras"]:
        state = "installed" if extra["installed"] else f"missing; {extra['install']}"
        lines.append(f"  {extra['name'].ljust(width)}  {extra['brings']}: {state}")
    problems = found["problems"]
    lines.append("No problems found." if not problems else "Problems: " + "; ".join(problems))
    return "\n".join(lines)


def _configuration_line(state: dict[str, Any]) -> str:
    if state["file"] is None:
        return "Configuration file: none (no oed.toml here, no OED_CONFIG, no --config)"
    if state["problem"]:
        return f"Configuration file: {state['file']}, with a problem"
    return f"Configuration file: {state['file']} ({state['origin']}): {', '.join(state['keys']) or 'empty'}"


def _compiler() -> str | None:
    from robots.batch.compiled import CompilerError, compiler

    try:
        return compiler()[0]
    except CompilerError:
        return None


def _library(name: str, wanted: str) -> dict[str, Any]:
    try:
        present: str | None = version(name)
    except PackageNotFoundError:
        present = None
    status = "missing" if present is None else "ok"
    for least in re.findall(r">=\s*([\w.]+)", wanted):
        if present is not None and _numbers(present) < _numbers(least):
            status = "too old"
    return {"name": name, "version": present, "needed": wanted, "status": status}


def _numbers(text: str) -> tuple[int, ...]:
    """Gives the numbers of a release, such as (3, 6, 5)."""
    release = re.match(r"\d+(?:\.\d+)*", text)
    return tuple(int(part) for part in release[0].split(".")) if release else ()
