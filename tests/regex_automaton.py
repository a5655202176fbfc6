"""The automaton of a regular expression, from its parsed form: see regex_cost."""

import re
import re._compiler as compiler  # type: ignore[import-not-found]
import re._constants as op  # type: ignore[import-not-found]
import re._parser as parser  # type: ignore[import-not-found]
from dataclasses import dataclass, field

MOST_COPIES = 4  # of the body of a bounded repeat: cost grows with the text, not with these
UNBOUNDED = 256  # repeats of so many are taken for unbounded ones
BEYOND_LATIN = "\u017f\u0130\u0660\u2003\u212a\u4e00\ud800"


@dataclass
class Automaton:
    """Nodes with edges: a character of a mask, or empty under a condition on the characters before and after."""

    characters: list[str | bytes]
    read: dict[int, tuple[int, int]] = field(default_factory=dict)  # node -> (mask, next node)
    empty: dict[int, list[tuple[int, int, int]]] = field(
        default_factory=dict
    )  # node -> (before, after, next node)
    nodes: int = 0

    @property
    def edge(self) -> int:
        """The bit that stands for no character: start or end of the text."""
        return 1 << len(self.characters)

    @property
    def anything(self) -> int:
        return 2 * self.edge - 1

    def node(self) -> int:
        self.nodes += 1
        self.empty[self.nodes] = []
        return self.nodes

    def join(self, one: int, other: int, before: int | None = None, after: int | None = None) -> None:
        every = self.anything
        self.empty[one].append(
            (every if before is None else before, every if after is None else after, other)
        )


class Builder:
    def __init__(self, pattern: re.Pattern) -> None:
        self.parsed = parser.parse(pattern.pattern, pattern.flags & ~re.DEBUG)
        self.flags = self.parsed.state.flags
        binary = isinstance(pattern.pattern, bytes)
        characters: list[str | bytes] = [bytes([code]) if binary else chr(code) for code in range(256)]
        self.automaton = Automaton(characters if binary else [*characters, *BEYOND_LATIN])
        self.dead = self.automaton.node()
        self.masks: dict[tuple[str, int], int] = {}

    def mask(self, item: tuple, flags: int) -> int:
        key = (repr(item), flags)
        if key not in self.masks:
            single = parser.SubPattern(self.parsed.state, [item])
            found = compiler.compile(single, flags & ~re.DEBUG & ~re.VERBOSE)
            self.masks[key] = sum(
                1 << place for place, each in enumerate(self.automaton.characters) if found.fullmatch(each)
            )
        return self.masks[key]

    def one_class(self, items: list, flags: int) -> int | None:
        """The mask of items that are exactly one character."""
        items = list(items)
        if len(items) != 1:
            return None
        code, argument = items[0]
        if code is op.SUBPATTERN:
            return self.one_class(argument[3], (flags | argument[1]) & ~argument[2])
        if code in (op.LITERAL, op.NOT_LITERAL, op.IN, op.ANY):
            return self.mask(items[0], flags)
        if code is op.BRANCH:
            each = [self.one_class(branch, flags) for branch in argument[1]]
            return None if None in each else sum({1 << bit for mask in each for bit in _bits(mask)})
        return None

    def add(self, items: list, flags: int, start: int) -> int:
        for item in items:
            start = self.add_item(item, flags, start)
        return start

    def add_item(self, item: tuple, flags: int, start: int) -> int:
        code, argument = item
        automaton = self.automaton
        if code in (op.LITERAL, op.NOT_LITERAL, op.IN, op.ANY):
            end = automaton.node()
            middle = automaton.node()
            automaton.join(start, middle)
            automaton.read[middle] = (self.mask(item, flags), end)
            return end
        if code is op.SUBPATTERN:
            return self.add(argument[3], (flags | argument[1]) & ~argument[2], start)
        if code is op.ATOMIC_GROUP:
            return self.add(argument, flags, start)
        if code is op.BRANCH:
            end = automaton.node()
            for branch in argument[1]:
                first = automaton.node()
                automaton.join(start, first)
                automaton.join(self.add(branch, flags, first), end)
            return end
        if code in (op.MAX_REPEAT, op.MIN_REPEAT, op.POSSESSIVE_REPEAT):
            return self.add_repeat(item, flags, start)
        if code in (op.ASSERT, op.ASSERT_NOT):
            return self.add_look(item, flags, start)
        if code is op.AT:
            return self.add_place(argument, flags, start)
        raise NotImplementedError(str(code))

    def add_repeat(self, item: tuple, flags: int, start: int) -> int:
        code, (least, most, body) = item
        automaton = self.automaton
        single = self.one_class(body, flags) if code is op.POSSESSIVE_REPEAT else None
        bounded = most is not op.MAXREPEAT and most < UNBOUNDED
        for _ in range(min(least, MOST_COPIES)):
            start = self.add(body, flags, start)
        end = automaton.node()
        outside = None if single is None else automaton.anything & ~single
        if bounded:
            for _ in range(min(most - least, MOST_COPIES)):
                automaton.join(start, end, after=outside)
                start = self.add(body, flags, start)
            automaton.join(start, end)
            return end
        loop = automaton.node()
        automaton.join(start, loop)
        again = self.add(body, flags, loop)
        automaton.join(again, loop)
        automaton.join(loop, end, after=outside)
        return end

    def add_look(self, item: tuple, flags: int, start: int) -> int:
        code, (direction, body) = item
        automaton = self.automaton
        end = automaton.node()
        ends = _branches(body)
        masks = [self._seen(branch, flags, direction) for branch in ends]
        if None not in masks:
            seen = 0
            for mask in masks:
                seen |= mask
            allowed = seen if code is op.ASSERT else automaton.anything & ~seen
            automaton.join(start, end, **{"after" if direction > 0 else "before": allowed})
            return end
        automaton.join(start, end)
        if direction > 0:
            first = automaton.node()
            automaton.join(start, first)
            automaton.join(self.add(body, flags, first), self.dead)
        return end

    def _seen(self, body: list, flags: int, direction: int) -> int | None:
        if len(body) == 1 and body[0][0] is op.AT:
            place = body[0][1]
            if place is op.AT_END_STRING and direction > 0:
                return self.automaton.edge
            if place is op.AT_BEGINNING_STRING and direction < 0:
                return self.automaton.edge
        return self.one_class(body, flags)

    def add_place(self, place: object, flags: int, start: int) -> int:
        automaton = self.automaton
        end = automaton.node()
        line = 1 << 10
        if place is op.AT_BEGINNING:
            automaton.join(start, end, before=automaton.edge | (line if flags & re.M else 0))
        elif place is op.AT_BEGINNING_STRING:
            automaton.join(start, end, before=automaton.edge)
        elif place is op.AT_END:
            automaton.join(start, end, after=automaton.edge | line)
        elif place is op.AT_END_STRING:
            automaton.join(start, end, after=automaton.edge)
        else:
            word = self.mask((op.IN, [(op.CATEGORY, op.CATEGORY_WORD)]), flags)
            other = automaton.anything & ~word
            same = place is op.AT_NON_BOUNDARY
            automaton.join(start, end, word, word if same else other)
            automaton.join(start, end, other, other if same else word)
        return end


def _branches(body: list) -> list[list]:
    items = list(body)
    if len(items) == 1 and items[0][0] is op.SUBPATTERN:
        return _branches(items[0][1][3])
    if len(items) == 1 and items[0][0] is op.BRANCH:
        return [list(branch) for branch in items[0][1][1]]
    return [items]


def _bits(mask: int) -> list[int]:
    return [place for place in range(mask.bit_length()) if mask >> place & 1]
