"""Members of a family by name: the built-in ones, those registered at run time, and those of installed packages."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from pkgutil import iter_modules
from types import ModuleType
from typing import Generic, TypeVar

from robots.common.errors import InputError

Member = TypeVar("Member")


class ExtensionWarning(UserWarning):
    """An extension that an installed package offers cannot be used."""


class Registry(Mapping[str, Member], Generic[Member]):
    """A mapping from names to members that users and installed packages can add to.

    A package offers a member by an entry point of the registry's group, such as::

        [project.entry-points."robot_oed.criteria"]
        my-criterion = "my_package.criteria:MyCriterion"

    Entry points are imported when a name is not among the members here, or when all names are listed. One that fails
    is left out with a warning; to ask for it by its name is an error.

    Args:
        what: what a member is, for messages, such as ``criterion``.
        group: of the entry points.
        members: the built-in members.
        check: raises `InputError` for an object that is no such member.
        adapt: turns a registered object into the member, such as a class into an instance.
    """

    def __init__(
        self,
        what: str,
        group: str,
        members: Iterable[Member],
        *,
        check: Callable[[object], None],
        adapt: Callable[[object], Member] | None = None,
    ) -> None:
        self.what, self.group = what, group
        self._check, self._adapt = check, adapt
        self._members: dict[str, Member] = {name_of(member): member for member in members}
        self._offered: dict[str, EntryPoint] | None = None
        self._failed: dict[str, str] = {}

    def register(self, member: Member) -> Member:
        """Adds a member under its own name; usable as a decorator.

        Raises:
            InputError: no such member, no name, or a name that exists.
        """
        self._check(member)
        name = name_of(member)
        if name in self._members and not _same(self._members[name], self._adapted(member)):
            raise InputError(f"the {self.what} {name!r} exists already", remedy="give yours another name")
        self._members[name] = self._adapted(member)
        return member

    def unregister(self, name: str) -> None:
        """Takes a member away, such as at the end of a test; an unknown name is none."""
        self._members.pop(name, None)

    def get_or_raise(self, name: str) -> Member:
        """Gives the member of a name.

        Raises:
            InputError: an unknown name, or one whose package cannot be imported.
        """
        if name in self:
            return self[name]
        self.refuse_failed(name)
        raise InputError(f"unknown {self.what} {name!r}", allowed=", ".join(self))

    def refuse_failed(self, name: str) -> None:
        """Refuses a name whose entry point could not be loaded.

        Raises:
            InputError: with the reason.
        """
        if name in self._failed:
            raise InputError(self._failed[name], remedy="repair or remove the package that offers it")

    def __getitem__(self, name: str) -> Member:
        if name not in self._members:
            self._load(name)
        return self._members[name]

    def __contains__(self, name: object) -> bool:
        if isinstance(name, str) and name not in self._members:
            self._load(name)
        return name in self._members

    def __iter__(self) -> Iterator[str]:
        for name in list(self._offers()):
            self._load(name, warn=True)
        return iter(tuple(self._members))

    def __len__(self) -> int:
        return len(tuple(iter(self)))

    def _offers(self) -> dict[str, EntryPoint]:
        """The entry points that were not loaded yet, by name."""
        if self._offered is None:
            self._offered = {point.name: point for point in entry_points(group=self.group)}
        return self._offered

    def _load(self, name: str, *, warn: bool = False) -> None:
        point = self._offers().pop(name, None)
        if point is None:
            return
        try:
            member = point.load()
            self._check(member)
            if name_of(member) != name:
                raise InputError(f"its name is {name_of(member)!r}", allowed=repr(name))
            self.register(member)
        except Exception as error:
            package = point.dist.name if point.dist is not None else "a package"
            reason = str(error) if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
            self._failed[name] = f"the {self.what} {name!r} of {package} ({point.value}) cannot be used: {reason}"
            if warn:
                warnings.warn(self._failed[name], ExtensionWarning, stacklevel=3)

    def _adapted(self, member: object) -> Member:
        return member if self._adapt is None else self._adapt(member)  # type: ignore[return-value]


def name_of(member: object) -> str:
    """Gives the name that a member carries.

    Raises:
        InputError: a member without a name.
    """
    name = getattr(member, "name", None)
    if not isinstance(name, str) or not name:
        raise InputError(f"{_called(member)} has no name", allowed="a class attribute `name`, a string")
    return name


def subclass_check(base: type) -> Callable[[object], None]:
    """Makes the check that a member is a complete subclass of an abstract base."""

    def check(member: object) -> None:
        if not (isinstance(member, type) and issubclass(member, base)):
            raise InputError(f"{_called(member)} is no {base.__name__}", allowed=f"a subclass of {base.__qualname__}")
        missing = sorted(getattr(member, "__abstractmethods__", ()))
        if missing:
            raise InputError(f"{_called(member)} lacks {', '.join(missing)}", remedy="define what its base declares")
        name_of(member)

    return check


def members_of(package: ModuleType, base: type[Member]) -> list[type[Member]]:
    """Imports every module of a package, and collects the complete subclasses of a base that carry a name of their own.

    A new member is then one new file.
    """
    found = []
    for item in iter_modules(package.__path__):
        module = import_module(f"{package.__name__}.{item.name}")
        found += [
            kind
            for kind in vars(module).values()
            if isinstance(kind, type)
            and issubclass(kind, base)
            and kind.__module__ == module.__name__
            and isinstance(vars(kind).get("name"), str)
            and not getattr(kind, "__abstractmethods__", ())
        ]
    return sorted(found, key=name_of)


def _called(member: object) -> str:
    return member.__qualname__ if isinstance(member, type) else repr(member)


def _same(first: object, second: object) -> bool:
    """Whether both are one definition, such as a file that was imported twice."""
    kinds = [item if isinstance(item, type) else type(item) for item in (first, second)]
    return kinds[0].__module__ == kinds[1].__module__ and kinds[0].__qualname__ == kinds[1].__qualname__
