"""What all commands have in common: an options class that runs."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

from oed.cli.declarations.declared import declared_options
from robots.common.errors import InputError
from robots.common.options import Option
from robots.common.progress import Progress


@dataclass(frozen=True)
class Printed:
    """What a command prints when it is done.

    Attributes:
        summary: for people.
        data: the same for machines.
        code: exit code.
        note: for the standard error, after the summary.
    """

    summary: str
    data: Mapping[str, Any]
    code: int = 0
    note: str = ""


@dataclass(frozen=True, kw_only=True)
class Verb:
    """Options of a command, and what it does with them. The docstring of its module is the command's help.

    A field is an option, and a field whose type is another options class is a group of them. The docstring describes
    the fields; `Option` behind a type says more.

    Attributes:
        json: print the result as JSON.
        quiet: print only errors.
    """

    examples: ClassVar[tuple[str, ...]] = ()
    """Command lines to copy."""
    function: ClassVar[str] = ""
    """The public function that does the work, by its path; empty for a command that only lists or prints."""
    introduces: ClassVar[bool] = False
    """Whether work on a robot begins with the command: it then shows the notes on its description in full."""
    alternatives: ClassVar[tuple[tuple[str, str], ...]] = ()
    """Pairs of fields that exclude each other. A group of options may have them, too."""

    uses: ClassVar[Mapping[str, str]] = {}
    """How the help calls uses of the verb, such as "Of make", before what options of theirs mean."""

    json: Annotated[bool, Option(section="Output")] = False
    quiet: Annotated[bool, Option(section="Output")] = False
    typed: frozenset[str] = field(default=frozenset(), repr=False)
    """Fields whose values are typed."""
    given: frozenset[str] = field(default=frozenset(), repr=False)
    """Fields whose values are typed or from the configuration file."""

    @property
    def use(self) -> str:
        """Which of several uses the options choose; an option may belong to some of them only."""
        return ""

    def unused(self) -> Collection[str]:
        """Names the fields that do not apply beside the others: refused if typed, left out of a configuration file."""
        return {name for name, option in declared_options(type(self)).items() if self._is_foreign(option.how)}

    def refusal(self, names: Collection[str]) -> InputError:
        """Makes the error about typed options that do not apply.

        Args:
            names: of the options, with dashes.
        """
        verb = "does" if len(names) == 1 else "do"
        beside, remedy = self.reason(names)
        return InputError(f"{', '.join(names)} {verb} not apply with {beside}", remedy=remedy, kind="option_not_used")

    def reason(self, names: Collection[str]) -> tuple[str, str]:
        """Says beside what options do not apply, and what to do.

        Args:
            names: of the options, with dashes.
        """
        return f"`{self.use}`", "remove them"

    def owner(self, names: Collection[str]) -> str:
        """Names the use to which the first of options belongs.

        Args:
            names: with dashes; none of them belongs to this use.
        """
        options = declared_options(type(self)).values()
        return next(option.how.only[0] for option in options if f"--{option.name}" in names and option.how.only)

    def kept(self) -> str:
        """Says what an interrupted command has written so far."""
        return "nothing was written"

    def run(self, progress: Progress) -> Printed | None:
        """Does what the command is for.

        Args:
            progress: hears how far it is.

        Returns:
            What to print; None if that is done.
        """
        raise NotImplementedError

    def _is_foreign(self, how: Option) -> bool:
        return bool(how.only) and self.use not in how.only
