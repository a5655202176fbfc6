"""Text of KRL: tokens, expressions as nested tuples, statements with the places of their blocks."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from .values import Stop

_TOKEN = re.compile(
    r"""[ \t]*(?:(?P<real>\d+\.\d*(?:E[-+]?\d+)?|\.\d+(?:E[-+]?\d+)?|\d+E[-+]?\d+)|(?P<int>\d+)
    |(?P<radix>'[ \t]*[HB][ \t]*[0-9A-F]+[ \t]*')|(?P<text>"[^"]*")|(?P<enum>\#[ \t]*[A-Z_]\w*)
    |(?P<name>[A-Z_$][\w$]*)|(?P<op>==|<>|<=|>=|[-+*/:()\[\],.<>{}=]))""",
    re.I | re.X | re.A,
)


_FORCE = re.compile(r"""(?:[^";]|"[^"]*")*;[ \t]*FORCE[ \t]+(.*?)[ \t]*\Z""", re.I)


def tokens(line: str) -> list[tuple[str, str]]:
    """(kind, text) of a line without its comment; names, words and numbers in upper case."""
    out, at = [], 0
    code = re.match(r'(?:[^";]|"[^"]*")*', line)[0].rstrip()
    while at < len(code):
        found = _TOKEN.match(code, at)
        if found is None:
            if not code[at:].strip():
                break
            raise Stop(f"what is {code[at:]!r}")
        kind = found.lastgroup
        text = found[kind]
        if kind != "text":
            text = text.upper()
        if kind in ("enum", "radix"):
            text = re.sub(r"\s", "", text)
        out.append((kind, text))
        at = found.end()
    return out


_LEVELS = [
    {"==", "<>", "<", ">", "<=", ">="}, {"OR", "B_OR"}, {"EXOR", "B_EXOR"}, {"AND", "B_AND"}, {"+", "-"}, {"*", "/"}
]  # fmt: skip
"""Weakest first; signs and NOT bind more, ``:`` most."""


class Reader:
    """Takes expressions off a list of tokens."""

    def __init__(self, of: list[tuple[str, str]], parsed: dict[int, tuple[tuple, int]] | None = None) -> None:
        """``parsed``: expressions by where they begin, and where they end; kept from one execution to the next."""
        self.tokens, self.at = of, 0
        self.parsed = {} if parsed is None else parsed

    @property
    def next(self) -> str:
        return self.tokens[self.at][1] if self.at < len(self.tokens) else ""

    @property
    def kind(self) -> str:
        return self.tokens[self.at][0] if self.at < len(self.tokens) else "end"

    def take(self) -> str:
        text = self.next
        if self.kind == "end":
            raise Stop("a statement ends too early")
        self.at += 1
        return text

    def accept(self, *words: str) -> bool:
        if self.kind != "text" and self.next in words:
            self.at += 1
            return True
        return False

    def expect(self, word: str) -> None:
        if not self.accept(word):
            raise Stop(f"{word} is expected, not {self.next!r}")

    def name(self) -> str:
        if self.kind != "name":
            raise Stop(f"no name: {self.next!r}")
        return self.take()

    def end(self) -> None:
        if self.kind != "end":
            raise Stop(f"{self.next!r} is too much")

    def expression(self, level: int = 0) -> tuple:
        if level == 0 and self.at in self.parsed:
            found, self.at = self.parsed[self.at]
            return found
        if level == len(_LEVELS):
            return self._signed()
        start = self.at
        left = self.expression(level + 1)
        while self.kind in ("op", "name") and self.next in _LEVELS[level]:
            left = ("binary", self.take(), left, self.expression(level + 1))
        if level == 0:
            self.parsed[start] = left, self.at
        return left

    def _signed(self) -> tuple:
        if self.kind in ("op", "name") and self.next in ("+", "-", "NOT", "B_NOT"):
            return ("unary", self.take(), self._signed())
        left = self._operand()
        while self.accept(":"):
            left = ("product", left, self._operand())
        return left

    def _operand(self) -> tuple:
        kind = self.kind
        if kind == "int":
            return ("value", int(self.take()))
        if kind == "real":
            return ("value", float(self.take()))
        if kind == "radix":
            text = self.take()
            return ("value", int(text[2:-1], 16 if text[1] == "H" else 2))
        if kind == "text":
            return ("value", self.take())
        if kind == "enum":
            return ("value", self.take())
        if self.accept("("):
            inner = self.expression()
            self.expect(")")
            return inner
        if self.next == "{":
            return self.aggregate()
        name = self.name()
        if name in ("TRUE", "FALSE"):
            return ("value", name == "TRUE")
        if self.accept("("):
            return ("call", name, self.arguments())
        return self.place(name)

    def arguments(self) -> list:
        """After the opening bracket; None for one that is left out."""
        out: list = []
        while not self.accept(")"):
            out.append(None if self.next in (",", ")") else self.expression())
            if not self.accept(","):
                self.expect(")")
                break
        return out

    def place(self, name: str) -> tuple:
        """A variable with indices and components behind its name."""
        found: tuple = ("name", name)
        while self.next in ("[", "."):
            if self.accept("."):
                found = ("member", found, self.name())
                continue
            self.take()
            indices = [self.expression()]
            while self.accept(","):
                indices.append(self.expression())
            self.expect("]")
            found = ("element", found, indices)
        return found

    def aggregate(self) -> tuple:
        self.expect("{")
        if self.at + 1 < len(self.tokens) and self.kind == "name" and self.tokens[self.at + 1][1] == ":":
            self.at += 2
        items = {}
        while True:
            key = self.name()
            if self.accept("["):  # a string
                self.expect("]")
            if key in items:
                raise Stop(f"{key} twice")
            items[key] = self.expression()
            if not self.accept(","):
                break
        self.expect("}")
        return ("aggregate", items)


OPENS = {
    "IF": "ENDIF",
    "SWITCH": "ENDSWITCH",
    "FOR": "ENDFOR",
    "WHILE": "ENDWHILE",
    "LOOP": "ENDLOOP",
    "REPEAT": "UNTIL",
}
CLOSES = {end: start for start, end in OPENS.items()}
_BEHIND = {*OPENS, *CLOSES, "ELSE", "CASE", "DEFAULT"} - {"SWITCH"}
"""Words of lines whose comment counts where paths go on behind them; that of any other line counts in it."""
LOOPS = ("FOR", "WHILE", "LOOP", "REPEAT")


@dataclass
class Line:
    """``block``: of a block's lines, indices of its first, middle (ELSE, CASE, DEFAULT) and last line; ``inside``: the
    first lines of the blocks around."""

    number: int
    tokens: list
    parsed: dict[int, tuple[tuple, int]] = field(default_factory=dict)
    block: list[int] = field(default_factory=list)
    inside: tuple[int, ...] = ()

    @property
    def word(self) -> str:
        return self.tokens[0][1] if self.tokens[0][0] == "name" else ""

    def reader(self) -> Reader:
        return Reader(self.tokens, self.parsed)


@dataclass
class Routine:
    name: str
    parameters: list[tuple[str, bool]]
    """Name, and whether it is taken by value."""
    result: str = ""
    lines: list[Line] = field(default_factory=list)
    labels: dict[str, int] = field(default_factory=dict)


def routines(text: str) -> list[Routine]:
    """The routines of a module, the main one first."""
    out: list[Routine] = []
    open_ = False
    for number, line in enumerate(text.splitlines(), 1):
        if line.lstrip().startswith("&") and not out:
            continue
        found = tokens(line)
        force = _force(number, _FORCE.match(line) if open_ else None)
        if not found:
            if force:
                out[-1].lines += force
            continue
        words = [text for _, text in found[:3]]
        if words[0] == "GLOBAL" and words[1:2] in (["DEF"], ["DEFFCT"]):
            found, words = found[1:], words[1:]
        if words[0] in ("DEF", "DEFFCT"):
            if open_:
                raise Stop("a routine in a routine")
            out.append(_header(found))
            out[-1].lines += _force(number, _FORCE.match(line))
            open_ = True
        elif words in (["END"], ["ENDFCT"]):
            if not open_ or (words == ["ENDFCT"]) != bool(out[-1].result):
                raise Stop("an end without a begin")
            out[-1].lines += force
            open_ = False
        elif not open_:
            raise Stop("a statement outside of routines")
        elif len(found) == 2 and found[1] == ("op", ":") and found[0][0] == "name":
            if words[0] in out[-1].labels:
                raise Stop("a label twice")
            out[-1].labels[words[0]] = len(out[-1].lines)
            out[-1].lines += [Line(number, [("name", ";label")]), *force]
        elif words[0] in _BEHIND and words[1:2] not in (["="], ["["], ["."]):
            out[-1].lines += [Line(number, found), *force]
        else:
            out[-1].lines += [*force, Line(number, found)]
    if open_ or not out:
        raise Stop("a routine is not closed")
    for routine in out:
        _nest(routine.lines)
    if len({routine.name for routine in out}) < len(out):
        raise Stop("a routine twice")
    return out


def _force(number: int, said: re.Match | None) -> list[Line]:
    return [] if said is None else [Line(number, [("name", ";force"), ("text", " ".join(said[1].split()))])]


def _header(found: list) -> Routine:
    reader = Reader(found)
    result = reader.name() if reader.take() == "DEFFCT" else ""
    routine = Routine(reader.name(), [], result)
    if reader.accept("("):
        while not reader.accept(")"):
            name, by_value = reader.name(), False
            if reader.accept(":"):
                way = reader.name()
                if way not in ("IN", "OUT"):
                    raise Stop("IN or OUT")
                by_value = way == "IN"
            routine.parameters.append((name, by_value))
            reader.accept(",")
    reader.end()
    return routine


def _nest(lines: list[Line]) -> None:
    around: list[int] = []
    for at, line in enumerate(lines):
        word = line.word
        if word in OPENS and not (len(line.tokens) > 1 and line.tokens[1][1] in ("=", "[", ".")):
            line.inside = tuple(around)
            line.block = [at]
            around.append(at)
        elif word in ("ELSE", "CASE", "DEFAULT"):
            if not around or lines[around[-1]].word != ("IF" if word == "ELSE" else "SWITCH"):
                raise Stop(f"{word} outside")
            line.block = lines[around[-1]].block
            line.block.append(at)
            line.inside = tuple(around)
        elif word in CLOSES:
            if not around or lines[around[-1]].word != CLOSES[word]:
                raise Stop(f"{word} without {CLOSES[word]}")
            line.block = lines[around.pop()].block
            line.block.append(at)
            line.inside = tuple(around)
        else:
            line.inside = tuple(around)
    if around:
        raise Stop("a block is not closed")
