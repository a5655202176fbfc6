"""Executes a RAPID module statement by statement, with inputs that are drawn at random.

Written from the description of the language; shares no code with the package.
"""

from __future__ import annotations

import contextlib
import math
import re
from dataclasses import dataclass, replace

import numpy as np

TOKEN = re.compile(
    r"\s+|(?P<remark>!.*)|(?P<num>\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+)|(?P<name>[A-Za-z]\w*)|(?P<text>\"[^\"]*\")"
    r"|(?P<sign>:=|<>|<=|>=|.)"
)
FIELDS = {
    "robtarget": ["trans", "rot", "robconf", "extax"],
    "pos": ["x", "y", "z"],
    "orient": ["q1", "q2", "q3", "q4"],
    "pose": ["trans", "rot"],
    "tooldata": ["robhold", "tframe", "tload"],
    "wobjdata": ["robhold", "ufprog", "ufmec", "uframe", "oframe"],
    "mark": ["at", "up"],
}
PART = {
    "trans": "pos", "rot": "orient", "tframe": "pose", "uframe": "pose", "oframe": "pose", "at": "robtarget",
}  # fmt: skip
FIRST = frozenset((";", ":", "then", "do", "else"))
HANDLERS = frozenset(("error", "backward", "undo"))
CLOSED = frozenset(("endif", "endwhile", "endfor", "endtest", "endproc", "endfunc", "endtrap")) | HANDLERS
PROCESSES = frozenset(("triggl", "triggj", "triggc", "arclstart", "arcl", "arclend", "arcc"))
"""Motions whose zone and tool are their last arguments."""
MOTIONS = PROCESSES | {
    "movel", "movej", "movec", "moveldo", "movejdo", "movelsync", "moveabsj", "moveextj",
}  # fmt: skip
STANDS = re.compile(r"inpos\d+|stoptime\w+")


class Halt(Exception):
    """The program ended, or ran long enough."""


class StartAgain(Exception):
    """ExitCycle."""


class Fault(Exception):
    """An error that a handler may take."""


class Left(Exception):
    """RETRY or TRYNEXT ends a handler."""


@dataclass
class Ref:
    """A variable; parameters may share it."""

    value: object


@dataclass
class Done:
    """A motion that was executed; ``aside``: by a trap or an error handler; ``elsewhere``: after one of these."""

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
    wrist: bool = False
    aside: bool = False
    elsewhere: bool = False


class Machine:
    """``rounds``: numbers have single precision; ``loose``: NOT a AND b is NOT (a AND b)."""

    def __init__(self, text: str, random, most: int = 400, rounds: bool = False, loose: bool = False) -> None:
        self.rounds, self.loose = rounds, loose
        self.armed = self.concurrent = self.strayed = False
        self.depth = self.aside = 0
        self.pending: list[str] = []
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
        self.displaced: frozenset[str] = frozenset()
        self.wrist = False
        self.override = 1.0
        self.kinds: dict[str, str] = {}
        self.world: dict[str, Ref] = {}
        self.own: dict[str, Ref] = {}
        self.own_kinds: dict[str, str] = {}
        self.routines: dict[str, tuple[int, list]] = {}
        self.traps: list[str] = []
        self._module(("const", "pers", "var"))

    # -- structure
    def _module(self, kinds: tuple[str, ...]) -> None:
        """Declares data of some kinds, and finds the routines."""
        i = 0
        while i < len(self.tokens):
            word = self.tokens[i][1]
            if word in ("const", "pers", "var"):
                i = (
                    self._declare(i, self.world, self.kinds, [self.world])
                    if word in kinds
                    else self._semicolon(i)
                )
            elif word == "trap":
                self.traps.append(self.tokens[i + 1][1])
                self.routines[self.tokens[i + 1][1]] = (i + 2, [])
                i = self._end(i)
            elif word in ("proc", "func"):
                i += word == "func"
                name = self.tokens[i + 1][1]
                i += 3
                parameters = []
                while self.tokens[i][1] != ")":
                    mode = ""
                    optional = self.tokens[i][1] == "\\"
                    i += optional
                    if self.tokens[i][1] == "switch":
                        parameters.append(("", "switch", self.tokens[i + 1][1], True))
                        i += 2 + (self.tokens[i + 2][1] == ",")
                        continue
                    if self.tokens[i][1] in ("inout", "pers", "var"):
                        mode = "inout"
                        i += 1
                    parameters.append((mode, self.tokens[i][1], self.tokens[i + 1][1], optional))
                    i += 2
                    if self.tokens[i][1] == ",":
                        i += 1
                self.routines[name] = (i + 1, parameters)
                i = self._end(i)
            else:
                i += 1

    def _end(self, i: int) -> int:
        """Where the routine around a token ends."""
        while self.tokens[i][1] not in ("endproc", "endfunc", "endtrap"):
            i += 1
        return i

    def _declare(self, i: int, into: dict, kinds: dict, scopes: list) -> int:
        kind, name = self.tokens[i + 1][1], self.tokens[i + 2][1]
        i += 3
        sizes = []
        while self.tokens[i][1] in ("{", ","):
            size, i = self._value(i + 1, scopes)
            sizes.append(int(size))
        i += bool(sizes)
        kinds[name] = kind
        if self.tokens[i][1] == ":=":
            value, i = self._value(i + 1, scopes)
        else:
            zero = [[0.0] * 3, [0.0] * 4, [0.0] * 4, [0.0] * 6]
            value = {"robtarget": zero, "pos": [0.0] * 3, "mark": [zero, 0.0], "bool": False}.get(kind, 0.0)
            for size in reversed(sizes):
                value = [value] * size
        into[name] = Ref(_copied(value))
        return i + 1

    # -- running
    def run(self, name: str = "main") -> list[Done]:
        with contextlib.suppress(Halt, StartAgain, Fault):
            self._call(name, {}, {})
        return self.done

    def cycles(self, count: int, most: int = 150) -> list[list[Done]]:
        """The motions of runs of main one after the other; some are stopped, and the next one starts from main."""
        found = []
        for _ in range(count):
            self.done, self.own, self.own_kinds, self.force, self.depth = [], {}, {}, None, 0
            stopped = self.random.random() < 0.4
            self.left = int(self.random.integers(1, 40)) if stopped else most
            ended = False
            with contextlib.suppress(Halt, Fault):
                with contextlib.suppress(StartAgain):
                    self._call("main", {}, {})
                ended = True
            found.append(self.done)
            if not ended:
                self._module(("var",))
                self.displaced, self.override, self.wrist, self.armed = frozenset(), 1.0, False, False
        return found

    def _call(self, name: str, own: dict, kinds: dict) -> object:
        """Runs a routine; the value of RETURN."""
        if self.depth > 20:
            raise Halt
        start, _ = self.routines[name]
        saved = self.own, self.own_kinds
        self.own, self.own_kinds = own, kinds
        stop = self._end(start)
        parts = [i for i in range(start, stop) if self.tokens[i][1] in HANDLERS]
        first = parts[0] if parts else stop
        handler = next((i for i in parts if self.tokens[i][1] == "error"), stop)
        after = next((i for i in parts if i > handler), stop)
        labels = {
            self.tokens[i][1]: i + 2
            for i in range(start, first)
            if self.tokens[i + 1][1] == ":" and self.tokens[i][0] == "name" and self._starts(i)
        }
        self.depth += 1
        try:
            return self._body(start, first, labels, None if handler == stop else (handler + 1, after))
        finally:
            self.own, self.own_kinds = saved
            self.depth -= 1

    def _interrupt(self) -> None:
        """A trap runs between two statements, or a routine that a motion calls."""
        if self.pending and not self.aside and self.random.random() < 0.5:
            self._aside(self.pending.pop(0))
        if not self.armed or self.random.random() > 0.08:
            return
        self.armed = False
        for name in self.traps:
            self._aside(name)
        self.armed = True

    def _aside(self, name: str) -> None:
        self.aside += 1
        try:
            self._call(name, {}, {})
        finally:
            self.aside -= 1

    def _starts(self, i: int) -> bool:
        return self.tokens[i - 1][1] in FIRST | CLOSED | {")"} or self.tokens[i - 1][0] == "remark"

    def _body(self, i: int, end: int, labels: dict, handler: tuple[int, int] | None = None) -> object:
        """Runs from a token to the end of the routine; loops keep a stack of what they come back to."""
        stack: list[tuple] = []
        while i < end:
            self.left -= 1
            if self.left < 0:
                raise Halt
            self._interrupt()
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
                self.own[name] = Ref(first)
                if (last - first) * step < 0:
                    i = self._skip(j + 1, end, ("endfor",)) + 1
                    self._restore(name, hidden)
                else:
                    stack.append(("for", j + 1, name, last, step, hidden))
                    i = j + 1
            elif word == "endfor":
                _, body, name, last, step, hidden = stack[-1]
                self.own[name].value = self._kept(self.own[name].value + step)
                if (last - self.own[name].value) * step >= 0:
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
                i = self._jump(i, labels[self.tokens[i + 1][1]], stack)
            elif word == "return":
                return None if self.tokens[i + 1][1] == ";" else self._value(i + 1)[0]
            elif word == "exitcycle":
                raise StartAgain
            elif word in ("retry", "trynext"):
                raise Left(word)
            elif word == "raise":
                raise Fault
            elif self.tokens[i + 1][1] == ":" and kind == "name":
                i += 2
            else:
                try:
                    i = self._simple(i, line)
                except Fault:
                    if handler is None:
                        raise
                    self.aside += 1
                    try:
                        self._body(*handler, {})
                        return None
                    except Left as how:
                        i = i if how.args[0] == "retry" else self._semicolon(i)
                    finally:
                        self.aside -= 1
        return None

    def _jump(self, i: int, to: int, stack: list[tuple]) -> int:
        """Leaves the loops that the label is not in."""
        while stack and not (stack[-1][1] <= to <= self._loop_end(stack[-1])):
            left = stack.pop()
            if left[0] == "for":
                self._restore(left[2], left[5])
        return to

    def _loop_end(self, loop: tuple) -> int:
        start = loop[1] if loop[0] == "for" else loop[1] + 1
        return self._skip(start, len(self.tokens), ("endfor" if loop[0] == "for" else "endwhile",))

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
                while self.tokens[i][1] not in ("then", ";"):
                    i += 1
                depth += self.tokens[i][1] == "then"
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
        if word == "%":
            name, j = self._value(i + 1)
            self._call(name.lower(), {}, {})
            return j + 2
        if word == "connect":
            return self._semicolon(i)
        following = self.tokens[i + 1][1]
        if following in (":=", "{", "."):
            return self._assign(i)
        required, options, j = self._arguments(i + 1)
        if word in MOTIONS:
            self._move(word, line, required, options)
        elif word == "waittime" and self.done and (required[0][0] >= 0.2 or "inpos" in options):
            if "inpos" in options or not self.concurrent or self.random.random() < 0.5:
                self.done[-1] = replace(self.done[-1], zone=0.0)  # too late to be planned ahead
        elif word == "waitdi":
            if "maxtime" in options and self.random.random() < 0.3:
                raise Fault
        elif word == "isignaldi":
            self.armed = True
        elif word in ("pdispset", "pdispon", "eoffsset", "eoffson", "softact"):
            self.displaced |= {word[:4]}
        elif word in ("pdispoff", "eoffsoff", "softdeact"):
            self.displaced -= {word[:4]}
        elif word == "velset":
            self.override = required[0][0] / 100
        elif word == "speedrefresh":
            self.override *= required[0][0] / 100
        elif word == "singarea":
            self.wrist = "wrist" in options
        elif word == "incr":
            variable = self._variable(required[0][1][0][1])
            variable.value = self._kept(variable.value + 1)
        elif word == "setdataval":
            self.world[required[0][0]].value = required[1][0]
        elif word == "callbyvar":
            self._call(f"{required[0][0]}{int(required[1][0])}", {}, {})
        elif word in self.routines:
            self._start(word, required, options)
        return j

    def _variable(self, name: str) -> Ref:
        return self.own[name] if name in self.own else self.world[name]

    def _start(self, word: str, required: list, options: dict) -> object:
        """Calls a routine with arguments, of which some are the caller's own variables."""
        own, kinds = {}, {}
        parameters = self.routines[word][1]
        given = [(one, options[one[2]]) for one in parameters if one[3] and one[2] in options]
        given += zip((one for one in parameters if not one[3]), required, strict=True)
        for (mode, kind, name, _), argument in given:
            value, texts = argument if isinstance(argument, tuple) else (argument, [])
            own[name] = self._variable(texts[0][1]) if mode else Ref(_copied(value))
            kinds[name] = kind
        return self._call(word, own, kinds)

    def _kept(self, value):
        """A number as the machine keeps it."""
        return float(np.float32(value)) if self.rounds and isinstance(value, float) else value

    def _arguments(self, i: int):
        required, options = [], {}
        while self.tokens[i][1] not in (";", ")"):
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
        if word in ("movec", "triggc", "arcc"):
            via = required.pop(0)[0]
        target, speed, *_ = required
        if word == "moveextj":
            zone, tool = required[2], ("tool0", [(None, "tool0")])
        else:
            zone, tool = required[-2:] if word in PROCESSES else required[2:4]

        def named(one):
            return one[1][0][1] if isinstance(one[0], Input) or one[0] is None else one[0]

        own = options.get("v")
        millimetres = own[0] if own else speed[0][0] if isinstance(speed[0], list) else None
        if millimetres is not None:
            millimetres *= self.override
        size = None
        if isinstance(zone[0], list):
            size = 0.0 if zone[0][0] is True else options["z"][0] if "z" in options else zone[0][1]
        if "inpos" in options:
            size = 0.0 if STANDS.fullmatch(options["inpos"][1][0][1]) else None
        self.concurrent = "conc" in options
        if word == "movelsync":
            self.pending.append(required[-1][0].lower())
        if self.aside:
            self.strayed = True
        wobj = named(options["wobj"]) if "wobj" in options else "wobj0"
        self.done.append(
            Done(
                line,
                word,
                via,
                target[0],
                millimetres,
                size,
                named(tool),
                wobj,
                self.force,
                bool(self.displaced),
                self.wrist,
                self.aside > 0,
                self.strayed and not self.aside,
            )
        )
        self.strayed = self.strayed and self.aside > 0

    def _assign(self, i: int) -> int:
        name = self.tokens[i][1]
        scope, kinds = (self.own, self.own_kinds) if name in self.own else (self.world, self.kinds)
        path, kind = [], kinds.get(name, "num")
        i += 1
        while self.tokens[i][1] != ":=":
            if self.tokens[i][1] in ("{", ","):
                value, i = self._value(i + 1)
                path.append(int(value) - 1)
                i -= self.tokens[i][1] == ","
            else:
                part = self.tokens[i + 1][1]
                path.append(FIELDS[kind].index(part))
                kind = PART.get(part, "num")
                i += 1
            i += 1
        value, i = self._value(i + 1)
        value = _copied(value)
        if path:
            whole = _copied(scope[name].value)
            inner = whole
            for step in path[:-1]:
                inner = self._item(inner, step)
            self._item(inner, path[-1])
            inner[path[-1]] = value
            value = whole
        scope[name].value = value
        return i + 1

    @staticmethod
    def _item(values: list, at: int):
        if not 0 <= at < len(values):
            raise Halt
        return values[at]

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
        if self.loose and self.tokens[i][1] == "not":
            value, i = self._and(i + 1, scopes)
            return not value, i
        value, i = self._compare(i, scopes)
        while self.tokens[i][1] == "and":
            other, i = (self._and if self.loose else self._compare)(i + 1, scopes)
            value = bool(value) and bool(other)
        return value, i

    def _compare(self, i, scopes):
        value, i = self._sum(i, scopes)
        sign = self.tokens[i][1]
        if sign in ("=", "<>", "<", ">", "<=", ">="):
            other, i = self._sum(i + 1, scopes)
            one, two = value, other
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
                [self._kept(a + sign * b) for a, b in zip(value, other, strict=True)]
                if isinstance(value, list)
                else value + other
                if isinstance(value, str)
                else self._kept(value + sign * other)
            )
        return value, i

    def _product(self, i, scopes):
        value, i = self._primary(i, scopes)
        while self.tokens[i][1] in ("*", "/"):
            sign = self.tokens[i][1]
            other, i = self._primary(i + 1, scopes)
            if sign == "/" and other == 0:
                raise Halt
            value = self._kept(value * other if sign == "*" else value / other)
        return value, i

    def _primary(self, i, scopes):
        kind, word, _ = self.tokens[i]
        if kind == "num":
            return self._kept(float(word)), i + 1
        if kind == "text":
            return word.strip('"'), i + 1
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
            value, i = self._compare(i + 1, scopes)
            return not value, i
        if word in self.routines and self.tokens[i + 1][1] == "(":
            required, options, i = self._arguments(i + 2)
            return self._start(word, required, options), i
        if word == "present":
            return self.tokens[i + 2][1] in self.own, i + 4
        if word in ("offs", "reltool"):
            return self._displaced(word, i + 2, scopes)
        if word in ("true", "false"):
            return word == "true", i + 1
        scope = next((one for one in scopes if word in one), None)
        if scope is None:
            return self._foreign(word), i + 1
        value = scope[word].value
        type_name = (self.own_kinds if scopes and scope is scopes[0] and len(scopes) > 1 else self.kinds).get(
            word
        )
        i += 1
        while self.tokens[i][1] in ("{", "."):
            if self.tokens[i][1] == "{":
                while self.tokens[i][1] != "}":
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
