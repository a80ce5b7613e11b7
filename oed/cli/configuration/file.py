"""The configuration file: where it is found, and whether each of its keys is an option."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from oed.cli.configuration.values import WrongValueError, typed_value
from oed.cli.declarations.declared import Declared, declared_options
from oed.cli.usage_errors import nearest_name
from oed.cli.verbs import Verb
from robots.common.errors import InputError
from robots.common.files import existing_file

NAME = "oed.toml"
VARIABLE = "OED_CONFIG"
NO_FILE = "none"
"""What ``--config`` is given to read no file."""

TABLES = "command"
"""The table whose tables are commands, for those with a name that is also an option's."""


@dataclass(frozen=True, kw_only=True)
class Configuration:
    """Defaults of options.

    Attributes:
        path: the file.
        origin: what named it: ``--config``, ``OED_CONFIG`` or ``working directory``.
        verbs: the options classes of all commands by name.
        shared: values of the top level by the options' names.
        tables: values of one command, by its name and the options' names.
    """

    path: Path
    origin: str
    verbs: Mapping[str, type[Verb]]
    shared: Mapping[str, Any]
    tables: Mapping[str, Mapping[str, Any]]

    def of(self, command: str) -> dict[Declared, Any]:
        """Gives the values for one command.

        Raises:
            InputError: a key of the top level whose value this command does not take.
        """
        own = self.tables.get(command, {})
        values = {}
        for name, option in named_options(self.verbs[command]).items():
            if name in own:
                values[option] = self._value(option, own[name], f"{command}.{name}")
            elif name in self.shared:
                remedy = f"put it into the table of the commands that take it, not of oed {command}"
                values[option] = self._value(option, self.shared[name], name, remedy)
        return values

    def check(self) -> None:
        """Checks all keys and values.

        Raises:
            InputError: a key that is no option, or a value that no command takes.
        """
        for key, found in self.shared.items():
            if not self._is_taken(key, found):
                self._refuse(key, found)
        for command, table in self.tables.items():
            if command not in self.verbs:
                raise self._unknown("there is no such command", f"{TABLES}.{command}", command, self.verbs)
            known = named_options(self.verbs[command])
            for key, found in table.items():
                if key not in known:
                    raise self._unknown(f"oed {command} has no such option", f"{command}.{key}", key, known)
                self._value(known[key], found, f"{command}.{key}")

    def _is_taken(self, key: str, found: Any) -> bool:
        """Whether a command takes a value; they are looked at one after the other, for it takes time to load them."""
        options = (named_options(self.verbs[name]).get(key) for name in self.verbs)
        return any(option is not None and _takes(option, found) for option in options)

    def _refuse(self, key: str, found: Any) -> None:
        options = {name: option for verb in self.verbs.values() for name, option in named_options(verb).items()}
        if key in options:
            self._value(options[key], found, key)
        if isinstance(found, dict):
            raise self._unknown("there is no such command", key, key, self.verbs)
        raise self._unknown("no command has this option", key, key, options)

    def _value(self, option: Declared, found: Any, key: str, remedy: str | None = None) -> Any:
        try:
            return typed_value(option, found, self.path.parent)
        except WrongValueError as error:
            shown = "a table" if isinstance(found, dict) else repr(found)
            raise InputError(
                f"key {key}: found {shown}",
                file=self.path,
                allowed=str(error),
                remedy=remedy,
                kind="configuration_value",
            ) from None

    def _unknown(self, problem: str, path: str, key: str, known: Iterable[str]) -> InputError:
        close = nearest_name(key, sorted(known))
        remedy = f"did you mean {close}?" if close else "`oed COMMAND --help` lists the options"
        return InputError(f"key {path}: {problem}", file=self.path, remedy=remedy, kind="configuration_key")


def named_options(verb: type[Verb]) -> dict[str, Declared]:
    """Lists the options of a command as a file has them, by name.

    Args:
        verb: its options class.
    """
    return {option.name: option for option in declared_options(verb).values() if not option.how.argument}


def find(given: str | None) -> tuple[Path, str] | None:
    """Finds the configuration file, and says what named it.

    Args:
        given: the value of ``--config``; then ``OED_CONFIG`` and the working directory do not count.

    Returns:
        The path and its origin; None without a file.
    """
    if given is not None:
        return None if given == NO_FILE else (Path(given), "--config")
    named = os.environ.get(VARIABLE, "")
    if named:
        return None if named == NO_FILE else (Path(named), VARIABLE)
    return (Path(NAME), "working directory") if Path(NAME).exists() else None


def read(path: Path, origin: str, verbs: Mapping[str, type[Verb]]) -> Configuration:
    """Reads and checks a configuration file.

    Args:
        path: the file.
        origin: what named it.
        verbs: the options classes of all commands by name.

    Raises:
        InputError: a missing file, broken TOML, or a wrong key or value.
    """
    try:
        data = tomllib.loads(existing_file(path).read_text(encoding="utf-8-sig"))
    except UnicodeDecodeError as error:
        raise InputError("the file is not text in UTF-8", file=path) from error
    except tomllib.TOMLDecodeError as error:
        both = f"; a command with the name of an option has its table as [{TABLES}.NAME]" if _clashes(error) else ""
        raise InputError(f"not valid TOML: {error}{both}", file=path) from error
    except InputError as error:
        if origin == VARIABLE:
            raise InputError(error.problem, file=path, remedy=f"the variable {VARIABLE} names this file") from error
        raise
    nested = data.pop(TABLES, {})
    if not isinstance(nested, dict) or not all(isinstance(table, dict) for table in nested.values()):
        raise InputError(f"key {TABLES}: found a value", file=path, allowed=f"tables such as [{TABLES}.identify]")
    tables = {key: data.pop(key) for key in list(data) if key in verbs and isinstance(data[key], dict)}
    for key, table in nested.items():
        tables[key] = {**tables.get(key, {}), **table}
    found = Configuration(path=path, origin=origin, verbs=verbs, shared=data, tables=tables)
    found.check()
    return found


def _clashes(error: Exception) -> bool:
    return any(word in str(error) for word in ("overwrite", "twice", "immutable", "mutate"))


def _takes(option: Declared, found: Any) -> bool:
    try:
        typed_value(option, found, Path())
    except WrongValueError:
        return False
    return True
