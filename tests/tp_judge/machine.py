"""Executes a TP listing statement by statement, with inputs and registers that are drawn at random.

Written from the description of the language; shares no code with the package.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

ODD = re.compile(r"Offset|Tool_Offset|INC|Skip|COORD|RTCP", re.I)
"""Options after which a motion does not end at its point, or not alone."""


class Halt(Exception):
    """The program ended, faulted, or ran long enough."""


@dataclass
class DoneMotion:
    """A motion that was executed; ``line``: of the file; target, via: X, Y, Z, W, P, R or J1 to J6."""

    line: int
    form: str
    target: list[float]
    via: list[float] | None
    joint: bool
    frames: tuple[int, int]
    speed: float | None
    corner: float | None
    stops: bool
    force: str | None
    displaced: bool
    from_elsewhere: bool


class TpMachine:
    def __init__(self, text: str, random, most: int = 300) -> None:
        self.random, self.left = random, most
        self.done: list[DoneMotion] = []
        self.registers: dict[int, float] = {}
        self.selected = {"UFRAME_NUM": int(random.integers(1, 3)), "UTOOL_NUM": int(random.integers(1, 3))}
        self.force: str | None = None
        self.weaves = self.called = False
        self.later = 0  # programs that motions call beside their path, and that still run
        self.override = 1.0
        self.program: list[tuple[int, str]] = []
        self.points: dict[int, dict[str, object]] = {}
        self._load(text.split("\n"))

    def _load(self, lines: list[str]) -> None:
        main, points = lines.index("/MN"), lines.index("/POS")
        for number, line in enumerate(lines[main + 1 : points], main + 2):
            label, _, rest = line.partition(":")
            rest = re.sub(r"\[(\w+):[^\]]*\]", r"[\1]", rest)  # a name in brackets says nothing
            if label.strip():
                self.program.append((number, rest))
            else:
                first, text = self.program[-1]
                self.program[-1] = (first, text + " " + rest)
        self.program = [(number, text.strip().rstrip(";").strip()) for number, text in self.program]
        for entry in "\n".join(lines[points + 1 :]).split("};"):
            head, brace, data = entry.partition("{")
            if not brace:
                continue
            values: dict[str, object] = {}
            data, second, _ = data.partition("GP2:")
            if second:
                values["GP2"] = 1.0
            for item in data.replace("GP1:", "").replace("\n", " ").split(","):
                word, _, value = item.replace("=", ":").partition(":")
                if word.strip() in ("UF", "UT"):
                    values[word.strip()] = int(value)
                elif value.split() and value.split()[0].lstrip("-").replace(".", "").isdigit():
                    values[word.strip()] = float(value.split()[0])
            self.points[int(head.strip()[2:-1].partition(":")[0])] = values

    def run(self) -> list[DoneMotion]:
        at, loops = 0, {}
        try:
            while at < len(self.program):
                self.left -= 1
                if self.left < 0:
                    raise Halt
                at = self._statement(at, loops)
        except Halt:
            pass
        return self.done

    def _statement(self, at: int, loops: dict[int, float]) -> int:
        line, text = self.program[at]
        if self.later and self.random.random() < 0.5:
            self.later -= 1
            self.registers = {}
        if text.startswith(("!", "//")):
            said = text.lstrip("!/").strip()
            if said.startswith("FORCE"):
                self.force = said
        elif text[:2] in ("J ", "L ", "C ", "A "):
            self._motion(line, text)
            if "Skip" in text and self.random.random() < 0.5:
                return self._action(at, "JMP " + text[text.index("LBL[") :].partition(" ")[0])
        elif text.startswith("IF ") and text.endswith("THEN"):
            if not self._holds(text[3:-4]):
                return self._matching(at, ("IF", "ENDIF"), "ELSE")
        elif text == "ELSE":
            return self._matching(at, ("IF", "ENDIF"), None)
        elif text.startswith("IF "):
            condition, _, action = text[3:].partition(",")
            if self._holds(condition):
                return self._action(at, action)
        elif text.startswith("SELECT"):
            return self._select(at)
        elif text.startswith("FOR "):
            return self._enter(at, text, loops)
        elif text == "ENDFOR":
            return self._again(at, loops)
        else:
            return self._action(at, text)
        return at + 1

    def _action(self, at: int, text: str) -> int:
        if text.startswith("JMP"):
            wanted = "LBL[" + text.partition("LBL[")[2]
            return [one for _, one in self.program].index(wanted)
        if text == "END":
            raise Halt
        if text.startswith("CALL"):
            self.called = True
            self.registers = {}
            for word in self.selected:
                self.selected[word] = int(self.random.integers(1, 3))
        elif text.startswith("Weave"):
            self.weaves = not text.endswith("End")
        elif text.startswith("OVERRIDE="):
            self.override = float(text[9:-1]) / 100
        elif text.partition("=")[0] in self.selected:
            self.selected[text.partition("=")[0]] = int(self._value(text.partition("=")[2]))
        elif text.startswith("R["):
            name, _, value = text.partition("=")
            self.registers[int(name[2:-1])] = self._value(value)
        elif text.startswith("P["):
            name = int(text.partition("]")[0][2:])
            for word in "XYZ":
                self.points[name][word] = float(self.random.uniform(0, 9))
        return at + 1

    def _value(self, text: str) -> float:
        for sign in ("+", "*"):
            left, found, right = text.partition(sign)
            if found:
                one, two = self._value(left), self._value(right)
                return one + two if sign == "+" else one * two
        if text.startswith("R["):
            number = int(text[2:-1])
            if number not in self.registers:
                self.registers[number] = float(self.random.integers(0, 4))
            return self.registers[number]
        return float(text.strip("()"))

    def _holds(self, text: str) -> bool:
        text = text.strip().strip("()")
        if text.startswith("DI"):
            return bool(self.random.random() < 0.5)
        for sign in ("<>", "=", ">"):
            left, found, right = text.partition(sign)
            if found:
                a, b = self._value(left), self._value(right)
                return a != b if sign == "<>" else a == b if sign == "=" else a > b
        raise AssertionError(text)

    def _select(self, at: int) -> int:
        register, _, rest = self.program[at][1][7:].partition("=")
        value = self._value(register.strip())
        while True:
            case, _, action = rest.partition(",")
            if case.strip() == "ELSE" or float(case) == value:
                return self._action(at, action)
            at += 1
            if at == len(self.program):
                return at
            text = self.program[at][1]
            if not text.startswith(("=", "ELSE")):
                return at
            rest = text.lstrip("=")

    def _matching(self, at: int, words: tuple[str, str], other: str | None) -> int:
        depth = 0
        for place in range(at + 1, len(self.program)):
            text = self.program[place][1]
            if text.startswith(words[0] + " ") and text.endswith("THEN"):
                depth += 1
            elif text == words[1]:
                if depth == 0:
                    return place + 1
                depth -= 1
            elif text == other and depth == 0:
                return place + 1
        raise AssertionError("no end")

    def _enter(self, at: int, text: str, loops: dict[int, float]) -> int:
        name, _, rest = text[4:].partition("=")
        first, _, last = rest.partition(" TO ")
        register = int(name[2:-1])
        self.registers[register] = self._value(first)
        loops[at] = self._value(last)
        if self.registers[register] > loops[at]:
            return self._end_of(at) + 1
        return at + 1

    def _end_of(self, at: int) -> int:
        depth = 0
        for place in range(at, len(self.program)):
            text = self.program[place][1]
            depth += text.startswith("FOR ")
            depth -= text == "ENDFOR"
            if depth == 0:
                return place
        raise AssertionError("no ENDFOR")

    def _again(self, at: int, loops: dict[int, float]) -> int:
        start = next(place for place in range(at, -1, -1) if self._opens(place, at))
        register = int(self.program[start][1][6:].partition("]")[0])
        self.registers[register] = self._value(f"R[{register}]") + 1
        return start + 1 if self.registers[register] <= loops[start] else at + 1

    def _opens(self, place: int, end: int) -> bool:
        return self.program[place][1].startswith("FOR ") and self._end_of(place) == end

    def _motion(self, line: int, text: str) -> None:
        words = text.split()
        form, names = words[0], [word for word in words if word.startswith("P[")]
        points = [self.points[int(name[2:-1])] for name in names]
        frames = (points[-1]["UF"], points[-1]["UT"])
        if frames != (self.selected["UFRAME_NUM"], self.selected["UTOOL_NUM"]):
            raise Halt
        joint = "J1" in points[-1]
        keys = [f"J{k}" for k in range(1, 7)] if joint else list("XYZWPR")
        rest = words[words.index(names[-1]) + 1 :]
        corner = rest[1]
        self.done.append(
            DoneMotion(
                line, form, [points[-1][key] for key in keys],
                [points[0][key] for key in keys] if form == "C" else None, joint, frames, self._speed(rest[0]),
                0.0 if corner == "FINE" else float(corner[2:]) if corner.startswith("CR") else None,
                corner == "FINE", self.force, self._is_elsewhere(rest) or "GP2" in points[-1], self.called,
            )
        )  # fmt: skip
        self.later += any("CALL" in word for word in rest)
        self.called = self._is_elsewhere(rest)

    def _is_elsewhere(self, options: list[str]) -> bool:
        """Whether a motion ends where the text does not say."""
        return self.weaves or any(ODD.match(word) for word in options)

    def _speed(self, word: str) -> float | None:
        for unit, factor in (("mm/sec", 1.0), ("cm/min", 10 / 60), ("inch/min", 25.4 / 60)):
            if word.endswith(unit):
                return self._value(word[: -len(unit)]) * factor * self.override
        return None
