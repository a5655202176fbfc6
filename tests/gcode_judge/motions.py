"""Straight motions, arcs and canned cycles."""

from __future__ import annotations

import math

from .blocks import Block
from .expressions import Real
from .spelling import PLANES, Spelling


class Motions(Spelling):
    @property
    def size(self) -> float:
        return 4.0 if self.modes.inch else 100.0

    def feed(self) -> list[str]:
        modes = self.modes
        if modes.timed or not modes.fed or self.maybe(0.06):
            modes.fed = True
            real = self.reals.number(self.chance.uniform(50, 900), 1)
            return [self.word("F", real)]
        return []

    def targets(self, end: list[float], which: list[int]) -> list[str]:
        """Words that lead to ``end``; where the axes are afterwards."""
        words, modes = [], self.modes
        for axis in which:
            here = modes.here[axis]
            base = (here or 0.0) if modes.incremental else 0.0
            value = end[axis] - base
            if modes.incremental and here is None:
                value = self.chance.uniform(-0.1, 0.1) * self.size
            decimals = self.chance.choice((3, 4)) if modes.inch else None
            word, value_there = self.length("XYZ"[axis], value, decimals)
            words.append(word)
            if value_there is None or (modes.incremental and here is None):
                modes.here[axis] = None
            else:
                modes.here[axis] = base + value_there
        return words

    def place(self) -> list[float]:
        return [self.chance.uniform(-self.size, self.size) for _ in range(3)]

    def line(self) -> None:
        modes = self.modes
        which = [0, 1, 2]
        if self.has("sparse") and self.maybe(0.7):
            which = sorted(self.chance.sample(which, self.chance.randint(1, 2)))
        code = self.chance.choice("0111")
        words = self.feed() if code == "1" else []
        if not (modes.motion == code and self.maybe(0.5)):
            words.insert(0, self.code(code))
        modes.motion = code
        words += self.targets(self.place(), which)
        if self.has("dwells") and self.maybe(0.15):
            words += [self.code("4"), self.word("P", Real("0.1", None))]
        if self.has("rotary") and self.maybe(0.25):
            words.append(self.length(self.chance.choice("AABC"), self.chance.uniform(-90, 90))[0])
        self.put(*words)

    def anchor(self, *codes: str) -> None:
        """All axes at known places."""
        self.flush()
        self.modes.incremental, self.modes.motion = False, "0"
        words = [self.code("90"), *(self.code(code) for code in codes), self.code("0")]
        self.put(*words, *self.targets(self.place(), [0, 1, 2]), plain=True)

    def arc(self) -> None:
        modes, chance = self.modes, self.chance
        u, v, w = PLANES[modes.plane]
        if not modes.incremental and (modes.here[u] is None or modes.here[v] is None):
            self.anchor()
            if modes.here[u] is None or modes.here[v] is None:
                return
        if modes.absolute_centres and modes.incremental and (modes.here[u] is None or modes.here[v] is None):
            return self.line()
        start = [value or 0.0 for value in modes.here]
        radius = chance.uniform(0.05, 0.5) * self.size
        angle, sweep = chance.uniform(0, 2 * math.pi), chance.uniform(0.3, 5.5)
        if self.maybe(0.2):
            angle = 0.5 * math.pi * chance.randint(0, 3)
        code = chance.choice("23")
        words = self.feed()
        if not (modes.motion == code and self.maybe(0.4)):
            words.insert(0, self.code(code))
        modes.motion = code
        end = list(start)
        helix = [w] if self.has("helix") and self.maybe(0.4) else []
        if helix:
            end[w] += chance.uniform(-0.1, 0.1) * self.size
        rich, self.reals.rich = self.reals.rich, self.reals.rich and self.maybe(0.5)
        if self.has("radius") and self.maybe(0.4):
            chord = chance.uniform(0.4, 1.8) * radius
            end[u], end[v] = start[u] + chord * math.cos(angle), start[v] + chord * math.sin(angle)
            words += self._ends(end, [u, v, *helix])
            words.append(self.length("R", chance.choice((1, 1, -1)) * radius)[0])
        else:
            centre = list(start)
            for axis, by in ((u, radius * math.cos(angle)), (v, radius * math.sin(angle))):
                base = 0.0 if modes.absolute_centres else start[axis]
                if not modes.absolute_centres and abs(by) < 1e-9 and self.maybe(0.7):
                    continue
                real = self.reals.number(start[axis] + by - base, 4)
                words.append(self.word("IJK"[axis], real))
                centre[axis] = base + (real.value or 0.0)
            ends = list(helix)
            if self.maybe(0.85):
                turn = sweep if code == "3" else -sweep
                du, dv = start[u] - centre[u], start[v] - centre[v]
                end[u] = centre[u] + du * math.cos(turn) - dv * math.sin(turn)
                end[v] = centre[v] + du * math.sin(turn) + dv * math.cos(turn)
                ends = [u, v, *helix]
            words += self._ends(end, ends)
            if self.maybe(0.12):
                words.append(self.word("P", self.reals.number(chance.randint(1, 3), 0)))
        self.reals.rich = rich
        self.put(*words)

    def _ends(self, end: list[float], which: list[int]) -> list[str]:
        """Ends of an arc, exact to four decimals; incremental ones need no start."""
        words, modes = [], self.modes
        for axis in which:
            here = modes.here[axis]
            base = (here or 0.0) if modes.incremental else 0.0
            rich, self.reals.rich = self.reals.rich, self.reals.rich and self.maybe(0.3)
            decimals = 4 if modes.inch else self.chance.choice((3, 4, 4))
            word, value = self.length("XYZ"[axis], end[axis] - base, decimals)
            self.reals.rich = rich
            words.append(word)
            modes.here[axis] = None if value is None or (modes.incremental and here is None) else base + value
        return words

    def spline(self) -> None:
        """Cubic ones that follow each other, in the plane XY, and a motion from there: rs274 forgets where they end
        with the next change of tools."""
        self.flush()
        if self.modes.plane != 17 or self.modes.timed:
            return self.line()
        for number in range(self.chance.randint(1, 3)):
            ways = [self.word(letter, self.reals.number(self.chance.uniform(-9, 9), 2)) for letter in "IJPQ"]
            words = ways if number == 0 or self.maybe(0.5) else ways[2:]
            self.put(self.code("5"), *self.feed(), *words, *self.targets(self.place(), [0, 1]), plain=True)
        self.modes.motion = "1"
        self.put(self.code("1"), *self.feed(), *self.targets(self.place(), [0, 1]), plain=True)

    def lathe(self) -> None:
        """X as a diameter."""
        self.flush()
        self.put(self.code("7"))
        self.modes.lost()
        for _ in range(self.chance.randint(0, 2)):
            self.line()
        self.flush()
        self.put(self.code("8"))
        self.modes.lost()

    def beside(self) -> None:
        """Beside the contour by the tool's radius; corners that turn away, so that rs274 accepts most of them."""
        modes, chance = self.modes, self.chance
        self.flush()
        if modes.plane != 17 or modes.timed or modes.incremental or self.depth:
            return self.line()
        features, self.features = self.features, self.features - {"slash"}
        self.anchor()
        modes.motion = "1"
        side = chance.choice(("41.1", "42.1"))
        radius = self.reals.number(0.04 * self.size, 2)
        at, sense = [0.3 * self.size, 0.0], 1.0 if side == "42.1" else -1.0
        self.put(self.code(side), self.word("D", radius), plain=True)
        for number in range(chance.randint(2, 5)):
            words = [self.code("1"), *self.feed()] if number == 0 or self.maybe(0.5) else []
            self.put(*words, *self.targets([*at, 0.0], [0, 1]), plain=True)
            turn = math.radians(sense * (40.0 + 60.0 * number))
            at = [at[0] + 0.4 * self.size * math.cos(turn), at[1] + 0.4 * self.size * math.sin(turn)]
        if self.maybe(0.5):
            self.blocks.append(Block(("G40",)))
            self.features = features
            self.line()
        else:
            self.put(
                self.code("40"),
                self.code("1"),
                *self.targets(self.place(), chance.sample([0, 1], 1)),
                plain=True,
            )
            self.features = features

    def polar(self) -> None:
        """A straight motion to polar coordinates."""
        self.flush()
        self.modes.motion = "1"
        words = [self.word("@", self.reals.number(self.chance.uniform(0.1, 1) * self.size, 2))]
        if self.maybe(0.7):
            words.append(self.word("^", self.reals.number(self.chance.uniform(-90, 90), 1)))
        self.put(self.code("1"), *self.feed(), *words)
        self.modes.lost()

    def thread(self) -> None:
        """A motion with the turns of the spindle; after rigid tapping the tool is where it was."""
        self.flush()
        if self.modes.timed:
            return self.line()
        if not self.modes.spindle:
            self.start_spindle()
        code = self.chance.choice(("33", "33.1"))
        axes = [2] if code == "33.1" else [2, *self.chance.sample([0, 1], self.chance.randint(0, 2))]
        self.put(
            self.code(code), *self.targets(self.place(), axes), self.word("K", self.reals.number(1.5, 2))
        )
        self.modes.motion = ""
        if code == "33.1":
            self.modes.lost()

    def start_spindle(self) -> None:
        self.flush()
        self.put(self.code("3", "M"), self.word("S", Real("1000", None)))
        self.modes.spindle = True

    def cycles(self) -> None:
        """A canned cycle, further holes, its end."""
        modes, chance = self.modes, self.chance
        if modes.timed or self.depth > 2:
            return self.line()
        self.flush()
        u, v, w = PLANES[modes.plane]
        code = chance.choice(("73", "81", "81", "82", "83", "85", "86", "87", "88", "89", "81"))
        if not modes.spindle:
            self.start_spindle()
        modes.motion = code
        for hole in range(chance.randint(1, 4)):
            words = self.feed()
            if hole == 0 or self.maybe(0.3):
                words.append(self.code(code))
            if self.maybe(0.3):
                words.append(self.code(chance.choice(("98", "99"))))
            which = chance.sample([u, v], chance.choice((0, 1, 2, 2)) if hole == 0 else chance.choice((1, 2)))
            words += self.targets(self.place(), which)
            if hole == 0 or self.maybe(0.15):
                words += self._depths("XYZ"[w])
            elif code in ("73", "83", "82", "86", "88", "89", "87"):
                pass
            if code in ("73", "83") and (hole == 0 or self.maybe(0.2)):
                words.append(self.word("Q", self.reals.number(chance.uniform(0.03, 0.2) * self.size, 3)))
            if code in ("82", "86", "88", "89") and (hole == 0 or self.maybe(0.2)):
                words.append(self.word("P", self.reals.number(0.25, 2)))
            if code == "87" and hole == 0:
                words += [self.word(letter, self.reals.number(0.02 * self.size, 2)) for letter in ("I", "J")]
                words.append(self.word("K", self.reals.number(-0.6 * self.size, 2)))
            if self.maybe(0.2):
                words.append(self.word("L", Real(str(chance.randint(1, 3)), None)))
                modes.lost()
            self.put(*words)
            modes.here[w] = None
        if self.maybe(0.6):
            modes.motion = ""
            self.put(self.code("80"))
        else:
            modes.motion = "cycle"
            self.line()

    def _depths(self, axis: str) -> list[str]:
        size, chance = self.size, self.chance
        if self.modes.incremental:
            retract, depth = chance.uniform(-0.2, 0.2) * size, -chance.uniform(0.02, 0.3) * size
        else:
            depth = chance.uniform(-0.5, 0.0) * size
            retract = depth + chance.uniform(0.05, 1.0) * size
        return [
            self.length("R", retract, 3)[0],
            self.length(axis, depth, 3)[0],
        ]
