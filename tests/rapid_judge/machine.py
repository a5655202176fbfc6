"""Executes a RAPID module statement by statement, with inputs that are drawn at random.

Written from the description of the language; shares no code with the package.
"""

from __future__ import annotations

import contextlib
import math
import re
from dataclasses import dataclass, replace

TOKEN = re.compile(
    r"\s+|(?P<remark>!.*)|(?P<num>\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+)|(?P<name>[A-Za-z]\w*)|(?P<text>\"[^\"]*\")"
    r"|(?P<sign>:=|<>|<=|>=|.)"
)
FIELDS = {
    "robtarget": ["trans", "rot", "robconf", "extax"],
    "pos": ["x", "y", "z"],
    "orient": ["q1", "q2", "q3", "q4"],
}
PART = {"trans": "pos", "rot": "orient"}


class Halt(Exception):
    """The program ended, or ran long enough."""


@dataclass
class Done:
    """A motion that was executed."""

    line: int
    word: str
    via: list | None
    target: list
    speed: float | None
    zone: float | None
    tool: list | str
    wobj: list | str
    force: str | None
    displaced: bool


class Machine:
    def __init__(self, text: str, random, most: int = 400) -> None:
        self.tokens = []
        for number, line in enumerate(text.split("\n"), 1):
            at, own = 0, []
            while at < len(line):
                found = TOKEN.match(line, at)
                at = found.end()
                if found.lastgroup:
                    word = found[0] if found.lastgroup == "remark" else found[0].lower()
                    own.append((found.lastgroup, word, number))
            # A comment in the line of a statement is of that statement.
            self.tokens += sorted(own, key=lambda token: token[0] != "remark")
        self.random, self.left = random, most
        self.done: list[Done] = []
        self.force = None
        self.displaced = False
        self.kinds: dict[str, str] = {}
        self.world: dict[str, object] = {}
        self.routines: dict[str, tuple[int, list]] = {}
        self._module()

    # -- structure
    def _module(self) -> None:
        i = 0
        while i < len(self.tokens):
            word = self.tokens[i][1]
            if word in ("const", "pers", "var"):
                i = self._declare(i, self.world, self.kinds, [self.world])
            elif word == "proc":
                name = self.tokens[i + 1][1]
                i += 3
                parameters = []
                while self.tokens[i][1] != ")":
                    mode = ""
                    if self.tokens[i][1] == "inout":
                        mode = "inout"
                        i += 1
                    parameters.append((mode, self.tokens[i][1], self.tokens[i + 1][1]))
                    i += 2
                    if self.tokens[i][1] == ",":
                        i += 1
                self.routines[name] = (i + 1, parameters)
                while self.tokens[i][1] != "endproc":
                    i += 1
            else:
                i += 1

    def _declare(self, i: int, into: dict, kinds: dict, scopes: list) -> int:
        kind, name = self.tokens[i + 1][1], self.tokens[i + 2][1]
        i += 3
        size = None
        if self.tokens[i][1] == "{":
            size, i = self._value(i + 1, scopes)
            i += 1
        kinds[name] = kind
        if self.tokens[i][1] == ":=":
            into[name], i = self._value(i + 1, scopes)
        else:
            zero = {"num": 0.0, "pos": [0.0] * 3}.get(kind)
            if kind == "robtarget":
                zero = [[0.0] * 3, [0.0] * 4, [0.0] * 4, [0.0] * 6]
            into[name] = zero if size is None else [zero] * int(size)
        return i + 1

    # -- running
    def run(self, name: str = "main") -> list[Done]:
        with contextlib.suppress(Halt):
            self._call(name, {}, {})
        return self.done

    def _call(self, name: str, own: dict, kinds: dict) -> dict:
        start, _ = self.routines[name]
        self.own, saved = own, getattr(self, "own", None)
        self.own_kinds, saved_kinds = kinds, getattr(self, "own_kinds", None)
        end = start
        while self.tokens[end][1] != "endproc":
            end += 1
        labels = {
            self.tokens[i][1]: i + 2
            for i in range(start, end)
            if self.tokens[i + 1][1] == ":" and self.tokens[i][0] == "name" and self._starts(i)
        }
        self._body(start, end, labels)
        self.own, self.own_kinds = saved, saved_kinds
        return own

    def _starts(self, i: int) -> bool:
        return self.tokens[i - 1][1] in (
            ";",
            ":",
            ")",
            "then",
            "do",
            "else",
            "endif",
            "endwhile",
            "endfor",
            "endtest",
        ) or (self.tokens[i - 1][0] == "remark")

    def _body(self, i: int, end: int, labels: dict) -> None:
        """Runs from a token to the end of the routine; loops keep a stack of what they come back to."""
        stack: list[tuple] = []
        while i < end:
            self.left -= 1
            if self.left < 0:
                raise Halt
            kind, word, line = self.tokens[i]
            if kind == "remark":
                said = word[1:].strip()
                if said.upper().startswith("FORCE"):
                    self.force = said
                i += 1
            elif word in ("const", "pers", "var"):
                i = self._declare(i, self.own, self.own_kinds, [self.own, self.world])
            elif word == "if":
                holds, j = self._value(i + 1)
                if self.tokens[j][1] == "then":
                    i = j + 1 if holds else self._skip(j + 1, end, ("elseif", "else", "endif"))
                    if not holds:
                        at = self.tokens[i][1]
                        i = i if at == "elseif" else i + 1
                        if at == "elseif":
                            i = self._elseif(i, end)
                else:
                    i = j if holds else self._semicolon(j)
            elif word in ("elseif", "else"):
                i = self._skip(i + 1, end, ("endif",)) + 1
            elif word in ("endif", "endtest"):
                i += 1
            elif word == "while":
                holds, j = self._value(i + 1)
                if holds:
                    stack.append(("while", i))
                    i = j + 1
                else:
                    i = self._skip(j + 1, end, ("endwhile",)) + 1
            elif word == "endwhile":
                i = stack.pop()[1]
            elif word == "for":
                name = self.tokens[i + 1][1]
                first, j = self._value(i + 3)
                last, j = self._value(j + 1)
                step = 1.0 if first <= last else -1.0
                if self.tokens[j][1] == "step":
                    step, j = self._value(j + 1)
                hidden = self.own.get(name)
                self.own[name] = first
                if (last - first) * step < 0:
                    i = self._skip(j + 1, end, ("endfor",)) + 1
                    self._restore(name, hidden)
                else:
                    stack.append(("for", j + 1, name, last, step, hidden))
                    i = j + 1
            elif word == "endfor":
                _, body, name, last, step, hidden = stack[-1]
                self.own[name] += step
                if (last - self.own[name]) * step >= 0:
                    i = body
                else:
                    stack.pop()
                    self._restore(name, hidden)
                    i += 1
            elif word == "test":
                value, j = self._value(i + 1)
                i = self._case(j, end, value)
            elif word in ("case", "default"):
                i = self._skip(i + 1, end, ("endtest",)) + 1
            elif word == "goto":
                i = labels[self.tokens[i + 1][1]]
            elif word == "return":
                return
            elif self.tokens[i + 1][1] == ":" and kind == "name":
                i += 2
            else:
                i = self._simple(i, line)

    def _restore(self, name: str, hidden) -> None:
        """The variable of a loop is there in it alone."""
        del self.own[name]
        if hidden is not None:
            self.own[name] = hidden

    def _elseif(self, i: int, end: int) -> int:
        """The token after ELSEIF ... THEN that holds, or after ELSE or ENDIF."""
        while True:
            holds, j = self._value(i + 1)
            if holds:
                return j + 1
            i = self._skip(j + 1, end, ("elseif", "else", "endif"))
            if self.tokens[i][1] != "elseif":
                return i + 1

    def _case(self, i: int, end: int, value) -> int:
        while True:
            word = self.tokens[i][1]
            if word == "endtest":
                return i + 1
            if word == "default":
                return i + 2
            match, j = False, i
            while self.tokens[j][1] != ":":
                other, j = self._value(j + 1)
                match |= other == value
            if match:
                return j + 1
            i = self._skip(j + 1, end, ("case", "default", "endtest"))

    def _skip(self, i: int, end: int, words: tuple) -> int:
        depth = 0
        while i < end:
            word = self.tokens[i][1]
            if depth == 0 and word in words:
                return i
            if word == "if":
                _, j = self._value(i + 1)
                depth += self.tokens[j][1] == "then"
            elif word in ("while", "for", "test"):
                depth += 1
            elif word in ("endif", "endwhile", "endfor", "endtest"):
                depth -= 1
            i += 1
        raise AssertionError("a block does not end")

    def _semicolon(self, i: int) -> int:
        while self.tokens[i][1] != ";":
            i += 1
        return i + 1

    def _simple(self, i: int, line: int) -> int:
        word = self.tokens[i][1]
        following = self.tokens[i + 1][1]
        if following in (":=", "{", "."):
            return self._assign(i)
        required, options, j = self._arguments(i + 1)
        if word in ("movel", "movej", "movec", "moveldo"):
            self._move(word, line, required, options)
        elif word == "waittime" and self.done and (required[0][0] >= 0.2 or "inpos" in options):
            self.done[-1] = replace(self.done[-1], zone=0.0)  # too late to be planned ahead
        elif word == "pdispset":
            self.displaced = True
        elif word == "pdispoff":
            self.displaced = False
        elif word == "incr":
            name = required[0][1][0][1]
            scope = self.own if name in self.own else self.world
            scope[name] += 1
        elif word in self.routines:
            _, parameters = self.routines[word]
            own, kinds = {}, {}
            for (_, kind, name), (value, _) in zip(parameters, required, strict=True):
                own[name], kinds[name] = value, kind
            caller = self.own
            after = self._call(word, own, kinds)
            for (mode, _, name), (_, texts) in zip(parameters, required, strict=True):
                if mode:
                    scope = caller if texts[0][1] in caller else self.world
                    scope[texts[0][1]] = after[name]
        return j

    def _arguments(self, i: int):
        required, options = [], {}
        while self.tokens[i][1] != ";":
            if self.tokens[i][1] == "\\":
                name = self.tokens[i + 1][1]
                i += 2
                value = True
                if self.tokens[i][1] == ":=":
                    start = i + 1
                    value, i = self._value(start)
                    value = (value, self.tokens[start:i])
                options[name] = value
            else:
                start = i
                value, i = self._value(i)
                required.append((value, self.tokens[start:i]))
            if self.tokens[i][1] == ",":
                i += 1
        return required, options, i + 1

    def _move(self, word: str, line: int, required: list, options: dict) -> None:
        via = None
        if word == "movec":
            via = required.pop(0)[0]
        target, speed, zone, tool = required[:4]

        def named(one):
            return one[1][0][1] if isinstance(one[0], Input) or one[0] is None else one[0]

        own = options.get("v")
        millimetres = own[0] if own else speed[0][0] if isinstance(speed[0], list) else None
        size = None
        if isinstance(zone[0], list):
            size = 0.0 if zone[0][0] is True else options["z"][0] if "z" in options else zone[0][1]
        wobj = named(options["wobj"]) if "wobj" in options else "wobj0"
        self.done.append(
            Done(line, word, via, target[0], millimetres, size, named(tool), wobj, self.force, self.displaced)
        )

    def _assign(self, i: int) -> int:
        name = self.tokens[i][1]
        scope, kinds = (self.own, self.own_kinds) if name in self.own else (self.world, self.kinds)
        path, kind = [], kinds.get(name, "num")
        i += 1
        while self.tokens[i][1] != ":=":
            if self.tokens[i][1] == "{":
                value, i = self._value(i + 1)
                path.append(int(value) - 1)
            else:
                part = self.tokens[i + 1][1]
                path.append(FIELDS[kind].index(part))
                kind = PART.get(part, "num")
                i += 1
            i += 1
        value, i = self._value(i + 1)
        if path:
            whole = _copied(scope[name])
            inner = whole
            for step in path[:-1]:
                inner = inner[step]
            inner[path[-1]] = value
            value = whole
        scope[name] = value
        return i + 1

    # -- values
    def _value(self, i: int, scopes: list | None = None):
        return self._or(i, scopes if scopes is not None else [self.own, self.world])

    def _or(self, i, scopes):
        value, i = self._and(i, scopes)
        while self.tokens[i][1] == "or":
            other, i = self._and(i + 1, scopes)
            value = bool(value) or bool(other)
        return value, i

    def _and(self, i, scopes):
        value, i = self._compare(i, scopes)
        while self.tokens[i][1] == "and":
            other, i = self._compare(i + 1, scopes)
            value = bool(value) and bool(other)
        return value, i

    def _compare(self, i, scopes):
        value, i = self._sum(i, scopes)
        sign = self.tokens[i][1]
        if sign in ("=", "<>", "<", ">", "<=", ">="):
            other, i = self._sum(i + 1, scopes)
            one, two = float(value), float(other)
            value = {
                "=": one == two, "<>": one != two, "<": one < two,
                ">": one > two, "<=": one <= two, ">=": one >= two,
            }[sign]  # fmt: skip
        return value, i

    def _sum(self, i, scopes):
        negative = self.tokens[i][1] == "-"
        if self.tokens[i][1] in "+-":
            i += 1
        value, i = self._product(i, scopes)
        value = -value if negative else value
        while self.tokens[i][1] in ("+", "-"):
            sign = 1 if self.tokens[i][1] == "+" else -1
            other, i = self._product(i + 1, scopes)
            value = (
                [a + sign * b for a, b in zip(value, other, strict=True)]
                if isinstance(value, list)
                else value + sign * other
            )
        return value, i

    def _product(self, i, scopes):
        value, i = self._primary(i, scopes)
        while self.tokens[i][1] in ("*", "/"):
            sign = self.tokens[i][1]
            other, i = self._primary(i + 1, scopes)
            value = value * other if sign == "*" else value / other
        return value, i

    def _primary(self, i, scopes):
        kind, word, _ = self.tokens[i]
        if kind == "num":
            return float(word), i + 1
        if kind == "text":
            return word, i + 1
        if word == "[":
            items = []
            while self.tokens[i][1] != "]":
                value, i = self._value(i + 1, scopes)
                items.append(value)
            return items, i + 1
        if word == "(":
            value, i = self._value(i + 1, scopes)
            return value, i + 1
        if word == "not":
            value, i = self._primary(i + 1, scopes)
            return not value, i
        if word in ("offs", "reltool"):
            return self._displaced(word, i + 2, scopes)
        if word in ("true", "false"):
            return word == "true", i + 1
        scope = next((one for one in scopes if word in one), None)
        if scope is None:
            return self._foreign(word), i + 1
        value = scope[word]
        type_name = (self.own_kinds if scopes and scope is scopes[0] and len(scopes) > 1 else self.kinds).get(
            word
        )
        i += 1
        while self.tokens[i][1] in ("{", "."):
            if self.tokens[i][1] == "{":
                index, i = self._value(i + 1, scopes)
                if not 1 <= index <= len(value) or index != int(index):
                    raise Halt
                value = value[int(index) - 1]
                i += 1
            else:
                part = self.tokens[i + 1][1]
                value = value[FIELDS[type_name].index(part)]
                type_name = PART.get(part)
                i += 2
        return value, i

    def _foreign(self, word: str):
        found = re.fullmatch(r"v(\d+)", word)
        if found:
            return [float(found[1]), 500.0, 5000.0, 1000.0]
        if word == "fine":
            return [True, 0.0]
        found = re.fullmatch(r"z(\d+)", word)
        if found:
            return [False, 0.3 if found[1] == "0" else float(found[1])]
        if re.fullmatch(r"di\d+", word):
            return Input(self.random.integers(0, 2))
        return None

    def _displaced(self, word, i, scopes):
        values, options = [], {}
        while self.tokens[i][1] != ")":
            if self.tokens[i][1] == "\\":
                value, j = self._value(i + 3, scopes)
                options[self.tokens[i + 1][1]] = value
                i = j
            else:
                value, i = self._value(i, scopes)
                values.append(value)
            if self.tokens[i][1] == ",":
                i += 1
        target = _copied(values[0])
        if word == "offs":
            target[0] = [a + b for a, b in zip(target[0], values[1:], strict=True)]
            return target, i + 1
        q = target[1]
        size = math.sqrt(sum(c * c for c in q))
        q = [c / size for c in q]
        step = turn_vector(q, values[1:])
        target[0] = [a + b for a, b in zip(target[0], step, strict=True)]
        for axis, name in enumerate(("rx", "ry", "rz")):
            half = math.radians(options.get(name, 0.0)) / 2
            part = [math.cos(half), 0.0, 0.0, 0.0]
            part[axis + 1] = math.sin(half)
            q = multiply(q, part)
        target[1] = q
        return target, i + 1


class Input(int):
    """A digital input."""


def _copied(value):
    return [_copied(one) for one in value] if isinstance(value, list) else value


def multiply(p, q):
    a, b, c, d = p
    e, f, g, h = q
    return [
        a * e - b * f - c * g - d * h,
        a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f,
        a * h + b * g - c * f + d * e,
    ]


def turn_vector(q, v):
    return multiply(multiply(q, [0.0, *v]), [q[0], -q[1], -q[2], -q[3]])[1:]
