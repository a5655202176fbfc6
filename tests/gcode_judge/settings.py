"""Blocks that set what is in force: modes, offsets, tools."""

from __future__ import annotations

from .expressions import Real
from .motions import Motions
from .spelling import OFFSETS, TOOLS


class Settings(Motions):
    def mode(self) -> None:
        modes, options = self.modes, ["40", "80"]
        if self.has("planes"):
            options += ["17", "18", "19"]
        if self.has("incremental"):
            options += ["90", "91", "91"]
        if self.has("centres"):
            options += ["90.1", "91.1"]
        if self.has("paths"):
            options += ["61", "61.1", "64", "64 P"]
        if self.has("feeds"):
            options += ["93", "94", "95"]
        code = self.chance.choice(options)
        if code in ("17", "18", "19"):
            modes.plane = int(code)
        elif code in ("90", "91"):
            modes.incremental = code == "91"
        elif code in ("90.1", "91.1"):
            modes.absolute_centres = code == "90.1"
        elif code in ("93", "94", "95"):
            modes.timed, modes.fed = code == "93", False
            if code == "95" and not modes.spindle:
                self.start_spindle()
        elif code == "80":
            modes.motion = ""
            self.put(self.code(code))
            return
        elif code == "64 P":
            self.flush()
            fine = [self.word("Q", self.reals.number(0.02, 2))] if self.maybe(0.3) else []
            self.put(self.code("64"), self.word("P", self.reals.number(0.05, 2)), *fine)
            return
        self.join(code)

    def unit(self) -> None:
        modes = self.modes
        inch = self.maybe(0.5)
        if inch != modes.inch:
            factor = 1 / 25.4 if inch else 25.4
            modes.here = [None if value is None else value * factor for value in modes.here]
        modes.inch = inch
        self.join("20" if inch else "21")

    def offset(self) -> None:
        self.flush()
        self.modes.lost()
        self.join(self.chance.choice(OFFSETS))

    def some(self, share: float = 0.3) -> list[str]:
        axes = self.chance.sample("XYZ", self.chance.randint(1, 3))
        return [self.length(axis, self.chance.uniform(-share, share) * self.size)[0] for axis in axes]

    def setting(self) -> None:
        self.flush()
        if self.has("tables") and self.maybe(0.4):
            return self.table()
        if self.has("system") and self.maybe(0.3):
            return self.put(
                f"#{5221 + 20 * self.chance.randint(0, 8) + self.chance.randint(0, 2)}={self.chance.randint(-9, 9)}"
            )
        level = self.chance.choice(("2", "2", "20"))
        words = [self.code("10"), self.word("L", Real(level, None))]
        words += [self.word("P", Real(str(self.chance.randint(0, 9)), None)), *self.some()]
        if level == "2" and self.has("rotation") and self.maybe(0.5):
            words.append(self.word("R", self.reals.number(self.chance.uniform(-90, 90))))
        self.put(*words)
        self.modes.lost()

    def table(self) -> None:
        """Lengths of tools in the control's table."""
        words = [self.code("10"), self.word("L", Real(self.chance.choice(("1", "10", "11")), None))]
        words.append(self.word("P", Real(str(self.chance.randint(1, TOOLS)), None)))
        self.put(*words, self.length("Z", self.chance.uniform(0, 0.3) * self.size)[0])
        self.modes.lost()

    def shift(self) -> None:
        self.flush()
        code = self.chance.choice(("92", "92", "52", "92.1", "92.2", "92.3"))
        self.put(self.code(code), *(self.some() if code in ("92", "52") else []))
        self.modes.lost()

    def machine(self) -> None:
        self.flush()
        if self.modes.incremental:
            return self.line()
        code = self.chance.choice("01")
        self.modes.motion = code
        self.put(self.code("53"), self.code(code), *self.some(), *(self.feed() if code == "1" else []))
        self.modes.lost()

    def home(self) -> None:
        self.flush()
        if self.maybe(0.2):
            return self.put(self.code(self.chance.choice(("28.1", "30.1"))))
        self.put(self.code(self.chance.choice(("28", "30"))), *(self.some() if self.maybe(0.7) else []))
        self.modes.lost()

    def tool(self) -> None:
        self.flush()
        number = self.word("T", Real(str(self.chance.randint(0 if self.maybe(0.1) else 1, TOOLS)), None))
        if self.maybe(0.3):
            self.put(number)
            self.put(self.code("6", "M"))
        elif self.maybe(0.3):
            self.pending += [number, self.code("6", "M")]
        else:
            self.put(number, self.code("6", "M"))
        self.modes.spindle = False
        self.modes.selected = True
        self.modes.lost()

    def tool_length(self) -> None:
        self.flush()
        code = self.chance.choice(("43", "43", "43", "49", "43.1", "43.2"))
        words = [self.code(code)]
        if code == "43.2" or (code == "43" and (self.maybe(0.5) or not self.modes.selected)):
            words.append(self.word("H", Real(str(self.chance.randint(1, TOOLS)), None)))
        if code == "43.1":
            words.append(self.length("Z", self.chance.uniform(0, 0.3) * self.size)[0])
        self.modes.lost()
        if code in ("43", "49") and self.maybe(0.5):
            self.pending += words
        else:
            self.put(*words)
