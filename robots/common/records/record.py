"""Results as plain data: one writer of what JSON can hold, and one reader that checks what a file states.

A result is a dataclass that inherits from `Record`. Each field is an entry of its JSON object, in the order of the
class. A class whose file differs from that lists the entries of its file in `ENTRIES`:

======================= ==============================================================================
``"name"``              the attribute of that name: a field, a property, or a method
``"key=name"``          an attribute under another key
``"key=name.inner"``    an attribute of an attribute; null where the outer one is None
``"key=low,high"``      a list of several attributes
``"outer.key=name"``    an entry of an object inside
``"key=names[0]"``      an item; the index may be a key or an attribute, and ``names`` what a record above shares
``"key=name?"``         null where it is empty
``"key?"``              left out where it is empty
``"*"``                 all fields; a later entry of the same key takes the place of one
``"**name"``            all entries of an attribute
======================= ==============================================================================
"""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self, cast

from robots.common.plain import as_html
from robots.common.records.entries import value_at, written
from robots.common.records.files import write_json
from robots.common.records.findings import Finding
from robots.common.records.reading import Reader
from robots.version import VERSION

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Record:
    """What is written as JSON and read back: a dataclass, or a class that lists its entries.

    Args of a subclass:
        format: of the file; it and its version are the first entries.
        version: of the format.
        tool: whether the version of this software is the third entry.
        shares: attributes that methods of the records inside may ask for as arguments, such as "limits=robot.limits".
        whole: whether the records inside are written with all their fields, as a program needs them that goes on.
        as_list: whether it is written as a list of its values, without keys.
    """

    ENTRIES: ClassVar[tuple[str, ...]] = ()
    """The entries of the JSON object, where they are not the fields."""
    FORMAT: ClassVar[str] = ""
    FORMAT_VERSION: ClassVar[int] = 1
    _head: ClassVar[dict[str, Any]] = {}
    _shares: ClassVar[tuple[str, ...]] = ()
    _whole: ClassVar[bool] = False
    _as_list: ClassVar[bool] = False

    def __init_subclass__(
        cls,
        format: str = "",
        version: int = 1,
        tool: bool = False,
        shares: tuple[str, ...] = (),
        whole: bool = False,
        as_list: bool = False,
    ) -> None:
        super().__init_subclass__()
        cls._whole, cls._as_list = whole, as_list
        if format:
            cls.FORMAT, cls.FORMAT_VERSION = format, version
            cls._head = {"format": format, "format_version": version} | ({"tool_version": VERSION} if tool else {})
        if shares:
            cls._shares = shares

    def to_dict(self, *, whole: bool = False, **context: Any) -> dict[str, Any]:
        """Gives the record as plain data: numbers that are not finite are null.

        Args:
            whole: all fields, whatever `ENTRIES` lists.
            context: arguments of methods that are entries; those of the records inside come from this one.
        """
        shared = (text.partition("=") for text in self._shares)
        context = context | {name: value_at(self, path or name, context) for name, _, path in shared}
        return dict(self._head) | written(self, context | {"whole": whole or self._whole})

    @classmethod
    def from_dict(
        cls,
        data: object,
        *,
        file: str | PathLike[str] | None = None,
        remedy: str = "",
        whole: bool = False,
        **given: Any,
    ) -> Self:
        """Reads what `to_dict` gave.

        Args:
            data: plain data.
            file: in which they were found, for messages.
            remedy: what to do if they are damaged.
            whole: whether the data hold all fields, whatever `ENTRIES` lists.
            given: values of fields that are not written, and of arguments of the constructor.

        Raises:
            InputError: an entry that is missing or of another kind, named with the file.
        """
        return cast(Self, Reader(file=file, remedy=remedy, whole=whole).record(cls, data, "", given))


class Result(Record):
    """A record that is a command's answer: it is saved under one name in a folder, and shows itself in a notebook."""

    FILE: ClassVar[str] = ""
    """Name of its JSON file."""

    @property
    def conclusion(self) -> str:
        """What follows from the result, in a sentence or two that a person can act on."""
        raise NotImplementedError

    @property
    def remarks(self) -> tuple[Finding, ...]:
        """What a reader must know."""
        return ()

    def summary(self) -> str:
        """Says in some lines what was found."""
        raise NotImplementedError

    def save(self, folder: str | Path, *, force: bool = False) -> None:
        """Writes the files of the result into a folder that is there: JSON, and tables beside it.

        Args:
            folder: an existing one.
            force: replace files that are there.

        Raises:
            InputError: a file is there, and force is not given.
        """
        self._save_beside(Path(folder), force=force)
        write_json(Path(folder) / self.FILE, self.stated(), force=force)

    def stated(self, **context: Any) -> dict[str, Any]:
        """Gives the record as plain data, with its conclusion and remarks, as files and ``--json`` have it.

        Args:
            context: see `Record.to_dict`.
        """
        remarks = [{key: text for key, text in vars(remark).items() if text} for remark in self.remarks]
        return self.to_dict(**context) | {"conclusion": self.conclusion, "remarks": remarks}

    def _save_beside(self, folder: Path, *, force: bool) -> None:
        """Writes what belongs to the JSON file; nothing by default."""

    def _repr_html_(self) -> str:
        return as_html(self.summary())


def axes_for(ax: Axes | None, size: tuple[float, float]) -> Axes:
    """Gives where to draw: the axes that a caller has, or those of a new figure.

    Args:
        ax: the caller's; None for a new figure.
        size: width and height of the new figure [inch].
    """
    if ax is not None:
        return ax
    from matplotlib.figure import Figure

    return Figure(figsize=size).subplots()
