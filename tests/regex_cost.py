"""What a regular expression costs at worst, from its parsed form: `re` backtracks, so a pattern costs more than linear
time if one text can lead through it in many ways (infinite ambiguity of its automaton: Weber and Seidl, 1991,
doi:10.1016/0304-3975(91)90381-B), or if `search` starts anew at every place of one run.

A possessive repeat of one class leaves only at a character outside of the class, a look-behind restricts the
character before: with these the automaton says what `re` does. Other atomic groups are taken for plain groups.
"""

import re
from collections import deque
from dataclasses import dataclass
from itertools import product

from regex_automaton import Builder


@dataclass(frozen=True)
class Ambiguity:
    """A text `before + pump * n + after` that costs more than linear time in n, if the pattern fails after it."""

    before: str | bytes
    pump: str | bytes
    exponential: bool


class _Steps:
    """The automaton without empty edges: from node to node by a class of characters, after a class of characters."""

    def __init__(self, pattern: re.Pattern, use: str) -> None:
        builder = Builder(pattern)
        automaton = builder.automaton
        start = automaton.node()
        first = start
        if use == "search":
            again = automaton.node()
            automaton.join(start, again)
            automaton.read[again] = (automaton.edge - 1, start)
            first = automaton.node()
            automaton.join(start, first)
        end = builder.add(builder.parsed, builder.flags, first)
        self.characters = automaton.characters
        self.accept_by = automaton.edge if use == "fullmatch" else automaton.anything
        self.automaton, self.end = automaton, end
        self.start = start
        self._classes()
        self._close()

    def _classes(self) -> None:
        masks = [mask for mask, _ in self.automaton.read.values()]
        for edges in self.automaton.empty.values():
            masks += [each for before, after, _ in edges for each in (before, after)]
        masks = list(dict.fromkeys(masks))
        groups: dict[tuple, list[int]] = {}
        for place in range(len(self.characters) + 1):
            groups.setdefault(tuple(mask >> place & 1 for mask in masks), []).append(place)
        self.examples = [min(group, key=_readable(self.characters)) for group in groups.values()]
        self.edge_class = next(
            number for number, group in enumerate(groups.values()) if len(self.characters) in group
        )
        text = [number for number, group in enumerate(groups.values()) if group != [len(self.characters)]]
        self.text_classes = text
        self.compress = {
            mask: sum(1 << number for number, place in enumerate(self.examples) if mask >> place & 1)
            for mask in masks
        }

    def _close(self) -> None:
        """steps[node][before][by]: nodes reached and in how many ways; nodes from which the pattern has matched."""
        automaton = self.automaton
        all_classes = (1 << len(self.examples)) - 1
        closures: dict[int, list[tuple[int, int, int]]] = {}

        def close(node: int) -> list[tuple[int, int, int]]:
            if node not in closures:
                found: list[tuple[int, int, int]] = []
                stack = [(node, all_classes, all_classes, frozenset())]
                while stack:
                    here, before, after, passed = stack.pop()
                    if here in automaton.read or here == self.end:
                        found.append((here, before, after))
                    for edge_before, edge_after, target in automaton.empty[here]:
                        b, a = before & self.compress[edge_before], after & self.compress[edge_after]
                        if (here, target) not in passed and b and a:
                            stack.append((target, b, a, passed | {(here, target)}))
                    if len(found) > 20000:
                        raise RecursionError("too many empty ways")
                closures[node] = found
            return closures[node]

        accepting_after = all_classes if self.accept_by == automaton.anything else 1 << self.edge_class
        self.accepts: dict[int, list[tuple[int, int]]] = {}  # state -> (before, after)
        self.steps: dict[int, list[tuple[int, int, int]]] = {}  # state -> (before, by, next state)
        todo, seen = [self.start], {self.start}
        while todo:
            state = todo.pop()
            out = []
            matched = False
            self.accepts[state] = []
            for here, before, after in close(state):
                if here == self.end:
                    self.accepts[state].append((before, after & accepting_after))
                    matched = matched or before == after & accepting_after == all_classes
                    continue
                mask, target = automaton.read[here]
                by = self.compress[mask] & after
                if by and before:
                    out.append((before, by, target))
            if matched:
                out = []  # matched already: never fails, so never comes back
            self.steps[state] = out
            for _, _, target in out:
                if target not in seen:
                    seen.add(target)
                    todo.append(target)

    def after(self, state: int, before: int, by: int) -> list[int]:
        return [target for b, mask, target in self.steps[state] if b >> before & 1 and mask >> by & 1]

    def can_fail(self, state: int, before: int) -> bool:
        """Whether some text after `state` does not match, so that `re` goes back and tries all other ways."""
        todo = [(frozenset([state]), before)]
        seen = set(todo)
        while todo:
            states, before = todo.pop()
            for by in (self.edge_class, *self.text_classes):
                if any(b >> before & 1 and a >> by & 1 for each in states for b, a in self.accepts[each]):
                    continue
                following = frozenset(target for each in states for target in self.after(each, before, by))
                if by == self.edge_class or not following or len(seen) > 3000:
                    return True
                if (following, by) not in seen:
                    seen.add((following, by))
                    todo.append((following, by))
        return False

    def text(self, classes: list[int]) -> str | bytes:
        empty = b"" if isinstance(self.characters[0], bytes) else ""
        return empty.join(self.characters[self.examples[number]] for number in classes)  # type: ignore[attr-defined]


def _readable(characters: list):
    def key(place: int) -> tuple:
        if place >= len(characters):
            return (3, place)
        text = characters[place]
        text = text.decode("latin-1") if isinstance(text, bytes) else text
        return (
            0 if text.isascii() and text.isalnum() else 1 if text.isascii() and text.isprintable() else 2,
            place,
        )

    return key


def find_ambiguity(pattern: re.Pattern, use: str) -> Ambiguity | None:
    """A text that costs `pattern` more than linear time.

    Args:
        pattern: Compiled pattern.
        use: `match`, `fullmatch` or `search` (as `finditer`, `sub` and `split` search).
    """
    steps = _Steps(pattern, use)
    reach = _reachable(steps)
    component = {state: frozenset(o for o in reach[state] if state in reach[o]) for state in steps.steps}
    looping = [state for state in steps.steps if component[state]]
    for state in looping:
        found = _two_ways(steps, state, component[state])
        if found is not None and steps.can_fail(state, found[0]):
            return Ambiguity(_way_to(steps, state, found[0]), steps.text(found[1]), True)
    inside = {state: _classes_inside(steps, component[state]) for state in looping}
    for one, other in product(looping, looping):
        if one == other or other not in reach[one] or not inside[one] & inside[other]:
            continue
        between = {
            each for each in steps.steps if each in reach[one] and (other in reach[each] or each == other)
        }
        found = _triple(steps, one, other, component[one], between | {one}, component[other])
        if found is not None and steps.can_fail(other, found[0]):
            return Ambiguity(_way_to(steps, one, found[0]), steps.text(found[1]), False)
    return None


def _classes_inside(steps: _Steps, inner: frozenset) -> int:
    seen = 0
    for state in inner:
        for _, by, target in steps.steps[state]:
            seen |= by if target in inner else 0
    return seen


def _reachable(steps: _Steps) -> dict[int, set[int]]:
    following = {state: {target for _, _, target in out} for state, out in steps.steps.items()}
    reach = {}
    for state in following:
        seen: set[int] = set()
        todo = list(following[state])
        while todo:
            each = todo.pop()
            if each not in seen:
                seen.add(each)
                todo.extend(following[each])
        reach[state] = seen
    return reach


def _triple(steps: _Steps, one: int, other: int, inner: frozenset, between: set, outer: frozenset):
    """A word by which `one` comes back to itself and to `other`, and `other` to itself: (class before, word)."""
    for last in range(len(steps.examples)):
        start = (one, one, other, last)
        goal = (one, other, other, last)
        came: dict[tuple, tuple | None] = {start: None}
        queue = deque([start])
        while queue:
            here = queue.popleft()
            for by in steps.text_classes:
                for a in steps.after(here[0], here[3], by):
                    if a not in inner:
                        continue
                    thirds = [c for c in steps.after(here[2], here[3], by) if c in outer]
                    if not thirds:
                        continue
                    for b in steps.after(here[1], here[3], by):
                        if b not in between and b not in outer:
                            continue
                        for c in thirds:
                            there = (a, b, c, by)
                            if there not in came:
                                came[there] = (here, by)
                                queue.append(there)
                                if there == goal:
                                    return last, _word(came, goal)
    return None


def _two_ways(steps: _Steps, state: int, inner: frozenset):
    """A word by which `state` comes back to itself in two ways: (class before, word)."""
    for last in range(len(steps.examples)):
        start = (state, state, last, False)
        goal = (state, state, last, True)
        came: dict[tuple, tuple | None] = {start: None}
        queue = deque([start])
        while queue:
            here = queue.popleft()
            for by in steps.text_classes:
                one = [each for each in steps.after(here[0], here[2], by) if each in inner]
                other = [each for each in steps.after(here[1], here[2], by) if each in inner]
                for a, b in product(one, other):
                    apart = here[3] or a != b or (here[0] == here[1] and one.count(a) > 1)
                    there = (a, b, by, apart)
                    if there not in came:
                        came[there] = (here, by)
                        queue.append(there)
                        if there == goal:
                            return last, _word(came, goal)
    return None


def _word(came: dict, goal: tuple) -> list[int]:
    word = []
    here = goal
    while came[here] is not None:
        here, by = came[here]
        word.append(by)
        if len(word) > 10000:
            break
    return word[::-1]


def _way_to(steps: _Steps, goal: int, last: int) -> str | bytes:
    start = (steps.start, steps.edge_class)
    came: dict[tuple, tuple | None] = {start: None}
    queue = deque([start])
    while queue:
        here = queue.popleft()
        if here[0] == goal and (here[1] == last or len(came) > 100000):
            return steps.text(_word(came, here))
        for by in steps.text_classes:
            for target in steps.after(*here, by):
                if (target, by) not in came:
                    came[target, by] = (here, by)
                    queue.append((target, by))
    return steps.text([])
