"""Small parsers of KRL and RAPID, written from the rules of public grammars: no code of the product.

Sources: antlr/grammars-v4, kuka/krl.g4 and abb/abbParser.g4; the spline of KRL from published programs (PTP_SPLINE,
SPTP, TIME_BLOCK START, PART and END); statements of RAPID from ABB's modules (abb_driver, EGM examples).
"""

from __future__ import annotations

import re


class ParseError(Exception):
    """Text that is not of the language."""


class Parser:
    """Reads tokens one by one.

    Args:
        text: the program.
        comment: what begins a comment.
        lines: whether the end of a line is a token.
    """

    TOKEN = re.compile(
        r'(?P<number>\d+\.\d*(?:[eE][+-]?\d+)?|\d+[eE][+-]?\d+|\.\d+|\d+)|(?P<name>[A-Za-z_$]\w*)|(?P<string>"[^"\n]*")'
        r"|(?P<op>:=|==|<>|<=|>=|[-+*/:=<>(){}\[\],.;#\\])|(?P<space>[ \t\r]+)|(?P<newline>\n)"
    )

    def __init__(self, text: str, comment: str, lines: bool) -> None:
        # How two values are compared.
        self.equal = "==" if lines else "="
        self.tokens: list[tuple[str, str]] = []
        for line in text.splitlines():
            # The end of a statement in RAPID is what begins a comment in KRL.
            code = line.split(comment, 1)[0]
            at = 0
            while at < len(code):
                match = self.TOKEN.match(code, at)
                if match is None:
                    raise ParseError(f"{code[at:]!r} in {line!r}")
                if match.lastgroup != "space":
                    self.tokens.append((str(match.lastgroup), match[0]))
                at = match.end()
            if lines:
                self.tokens.append(("newline", "\n"))
        self.at = 0

    @property
    def next(self) -> str:
        """The next token, names in capitals."""
        if self.at >= len(self.tokens):
            return ""
        kind, text = self.tokens[self.at]
        return text.upper() if kind == "name" else text

    def take(self, *wanted: str) -> str:
        """Takes a token, one of those wanted if any are."""
        found = self.next
        if not found or (wanted and found not in wanted):
            raise ParseError(f"{found!r} instead of {wanted} after {self.tokens[max(self.at - 6, 0) : self.at]}")
        self.at += 1
        return found

    def kind(self, kind: str) -> str:
        """Takes a token of a kind."""
        if self.at >= len(self.tokens) or self.tokens[self.at][0] != kind:
            raise ParseError(f"{self.next!r} instead of a {kind}")
        return self.take()

    def skip_lines(self) -> None:
        """Leaves out empty lines."""
        while self.next == "\n":
            self.take()

    def number(self) -> float:
        """Takes a number with its sign."""
        sign = self.take() if self.next in ("+", "-") else ""
        return float(sign + self.kind("number"))

    def variable(self) -> str:
        """Takes a variable with its index and its components."""
        name = self.kind("name")
        for before, after in (("[", "]"), ("{", "}")):
            if self.next == before:
                self.take(before)
                name += before + self.expression() + self.take(after)
        while self.next == ".":
            self.take(".")
            name += "." + self.variable()
        return name

    def primary(self) -> str:
        """Takes a number, an aggregate, an enumeration value, a call, a variable or an expression in brackets."""
        if self.at >= len(self.tokens) - 1:
            raise ParseError("the text ends in an expression")
        kind = self.tokens[self.at][0]
        if self.next in ("+", "-"):
            return self.take() + self.primary()
        if self.next == "(":
            return self.take("(") + self.expression() + self.take(")")
        if self.next == "#":
            return self.take("#") + self.kind("name")
        if kind in ("number", "string"):
            return self.take()
        name = self.variable()
        if self.next == "(":
            self.take("(")
            while self.next != ")":
                self.expression()
                if self.next != ")":
                    self.take(",")
            self.take(")")
        return name

    def expression(self) -> str:
        """Takes operands and the operators between them."""
        text = self.primary()
        while self.next in ("+", "-", "*", "/", self.equal, "<>", "<", ">", "<=", ">=", "AND", "OR"):
            text += self.take() + self.primary()
        return text


class Krl(Parser):
    """A KRL program (.src) or data list (.dat).

    Attributes:
        name: of the module.
        arrays: elements of each declared array.
        points: aggregates of axes, in order: those of assignments, then those of the spline.
        parts: shares of the time block.
        time: of all time blocks [s].
        waits: times of all waits [s].
        order: kinds of statements in order.
    """

    def __init__(self, text: str) -> None:
        super().__init__(text, ";", lines=True)
        self.arrays: dict[str, int] = {}
        self.points: list[list[float]] = []
        self.parts: list[float] = []
        self.time = 0.0
        self.waits: list[float] = []
        self.order: list[str] = []
        self.skip_lines()
        if self.take("DEF", "DEFDAT") == "DEF":
            self.name = self.kind("name")
            self.take("(")
            self.take(")")
            self.take("\n")
            self._statements("END")
        else:
            self.name = self.kind("name")
            self.take("PUBLIC")
            self.take("\n")
            self.skip_lines()
            while self.next != "ENDDAT":
                self._declaration() if self.next == "DECL" else self._assignment()
                self.skip_lines()
            self.take("ENDDAT")
        self.skip_lines()
        if self.at != len(self.tokens):
            raise ParseError(f"{self.next!r} behind the end")

    def _declaration(self) -> None:
        self.take("DECL")
        self.take("INT", "REAL", "BOOL", "E6AXIS")
        name = self.kind("name")
        if self.next == "[":
            self.take("[")
            self.arrays[name] = int(self.kind("number"))
            self.take("]")
        elif self.next == "=":
            self.take("=")
            self.expression()
        self.take("\n")

    def _aggregate(self) -> list[float]:
        self.take("{")
        values = []
        while True:
            self.take(f"A{len(values) + 1}")
            values.append(self.number())
            if self.take(",", "}") == "}":
                return values

    def _assignment(self) -> None:
        self.variable()
        self.take("=")
        if self.next == "{":
            self.points.append(self._aggregate())
        else:
            self.expression()
        self.take("\n")

    def _statements(self, *ends: str) -> None:
        while self.next not in ends:
            self._statement()
        self.take(*ends)
        self.take("\n")

    def _statement(self) -> None:
        first = self.next
        if first == "\n":
            self.take()
            return
        if first == "DECL":
            if self.order:
                raise ParseError("a declaration behind a statement")
            self._declaration()
            return
        self.order.append(first)
        if first == "IF":
            self.take()
            self.expression()
            self.take("THEN")
            self.take("\n")
            self._statements("ENDIF")
        elif first == "HALT":
            self.take()
            self.take("\n")
        elif first == "WAIT":
            self.take()
            self.take("SEC")
            self.waits.append(self.number())
            self.take("\n")
        elif first == "PTP":
            self.take()
            self.primary()
            self.take("\n")
        elif first == "PTP_SPLINE":
            self.take()
            self.take("\n")
            self._spline()
        elif first in ("GLOBAL", "INTERRUPT"):
            while self.take() != "\n":
                pass
        elif self.tokens[self.at + 1][1] == "(":
            self.primary()
            self.take("\n")
        else:
            self._assignment()

    def _spline(self) -> None:
        self.take("TIME_BLOCK")
        self.take("START")
        self.take("\n")
        while self.next == "SPTP":
            self.take()
            self.points.append(self._aggregate())
            self.take("\n")
            self.take("TIME_BLOCK")
            if self.take("PART") and self.take("="):
                self.parts.append(self.number())
            self.take("\n")
        self.take("TIME_BLOCK")
        self.take("END")
        self.take("=")
        self.time += self.number()
        self.take("\n")
        self.take("ENDSPLINE")
        self.take("\n")


class Rapid(Parser):
    """A RAPID module.

    Attributes:
        name: of the module.
        procedures: names.
        targets: axes of each array of joint targets.
        order: names of the statements, in order.
        moves: arguments of each MoveAbsJ.
    """

    def __init__(self, text: str) -> None:
        super().__init__(text, "!", lines=False)
        self.targets: dict[str, list[list[float]]] = {}
        self.procedures: list[str] = []
        self.order: list[str] = []
        self.moves: list[list[str]] = []
        self.take("MODULE")
        self.name = self.kind("name")
        while self.next != "ENDMODULE":
            self._procedure() if self.next == "PROC" else self._data()
        self.take("ENDMODULE")
        if self.at != len(self.tokens):
            raise ParseError(f"{self.next!r} behind the end")

    def _data(self) -> None:
        self.take("CONST", "VAR", "PERS")
        kind = self.take("NUM", "JOINTTARGET", "EGMIDENT", "EGM_MINMAX", "BOOL")
        name = self.kind("name")
        count = None
        if self.next == "{":
            self.take("{")
            count = int(self.kind("number"))
            self.take("}")
        if self.next == ":=":
            self.take(":=")
            value = self._value()
            if kind == "JOINTTARGET" and count is not None:
                assert isinstance(value, list)
                if len(value) != count or any([len(part) for part in target] != [6, 6] for target in value):
                    raise ParseError(f"{len(value)} targets in {name}{{{count}}}")
                self.targets[name] = [target[0] for target in value]
        self.take(";")

    def _value(self) -> list | float | str:
        if self.next != "[":
            return (
                float(self.expression())
                if self.tokens[self.at][0] == "number" or self.next == "-"
                else self.expression()
            )
        self.take("[")
        values = [self._value()]
        while self.take(",", "]") == ",":
            values.append(self._value())
        return values

    def _procedure(self) -> None:
        self.take("PROC")
        self.procedures.append(self.kind("name"))
        self.take("(")
        self.take(")")
        while self.next in ("VAR", "CONST"):
            self._data()
        self._statements("ENDPROC")

    def _statements(self, end: str) -> None:
        while self.next != end:
            self._statement()
        self.take(end)

    def _statement(self) -> None:
        first = self.next
        self.order.append(first)
        if first == "IF":
            self.take()
            self.expression()
            self.take("THEN")
            self._statements("ENDIF")
        elif first == "FOR":
            self.take()
            self.kind("name")
            self.take("FROM")
            self.expression()
            self.take("TO")
            self.expression()
            self.take("DO")
            self._statements("ENDFOR")
        elif first == "ERROR":
            self.take()
        elif self.tokens[self.at + 1][1] == ":=" or "." in (self.tokens[self.at + 1][1],):
            self.variable()
            self.take(":=")
            self.expression()
            self.take(";")
        else:
            self._call()

    def _call(self) -> None:
        name, arguments = self.kind("name"), []
        while self.next != ";":
            if self.next == "\\":
                self.take("\\")
                argument = "\\" + self.kind("name")
                if self.next == ":=":
                    argument += self.take(":=") + self.expression()
            else:
                argument = self.expression()
            arguments.append(argument)
            if self.next == ",":
                self.take(",")
        self.take(";")
        if name == "MOVEABSJ":
            self.moves.append(arguments)
