"""What the variables of a program hold: assigned, forgotten, kept as they are at one place and joined at another."""

from __future__ import annotations

from typing import NamedTuple

from postproc.languages.core.persistent_map import KeyNumbers, PersistentMap
from postproc.languages.krl.expressions import Value, component
from postproc.languages.krl.target import FrameEntry, KrlTarget, UnknownValue, shown

MOST_PARTS = 64
"""Parts of one element or component that are distinguished where a value of the whole takes their place."""
Entry = dict[bytes, Value]
"""The values of one name by what follows it: b"" itself, b"[2]", b".F", b"[2].F"."""


class Fact(NamedTuple):
    """A value, and the line that assigned it (0: none did)."""

    value: Value
    line: int


class VariableFacts(NamedTuple):
    """All variables at one place of a program.

    names: name -> path -> Fact.  unknown: why a name without facts is not known; None where it is as it is declared.
    """

    names: PersistentMap
    unknown: UnknownValue | None


class Variables:
    """Names (upper case) and their values at the present place of a program.

    ``fixed``: what no part of the program changes (points of the .dat), found where no variable hides it.
    ``line``: the statement that assigns.  ``mixed``: names whose values once differed where paths meet.
    ``asked``: names of which it was asked what their declaration says.
    """

    def __init__(self, fixed: dict[bytes, Entry]) -> None:
        self.fixed = fixed
        self.line = 0
        self.mixed: set[bytes] = set()
        self.asked: set[bytes] = set()
        self._paths = KeyNumbers()
        self._parts: dict[bytes, list[bytes]] = {}
        self._nothing = PersistentMap(self._paths)
        self.facts = VariableFacts(PersistentMap(KeyNumbers()), None)

    def get(self, name: bytes, path: bytes = b"") -> Value | None:
        """The value of ``name path``; None where nothing was ever assigned; UnknownValue where it is not known."""
        found = self._fact(self.facts, name, path)
        return None if found is None else found.value

    def set(self, name: bytes, path: bytes, value: Value) -> None:
        if not path:
            # The value of the whole takes the place of all of its parts.
            self._put(name, self._nothing.set(b"", Fact(value, self.line)))
            return
        entry = self.facts.names.get(name)
        if entry is None:
            entry = self._entry(self.fixed.get(name) or {}, 0)
        self._note(path)
        parts = self._parts.get(path, ())
        if len(parts) > MOST_PARTS:
            why = UnknownValue("KRL002", f"{shown(name + path)} has more than {MOST_PARTS} parts")
            entry, parts = self._nothing.set(b"", Fact(why, self.line)), ()
        for part in parts:
            entry = entry.set(part, None)
        self._put(name, entry.set(path, Fact(value, self.line)))

    def _note(self, path: bytes) -> None:
        """Takes up a path as a part of what is before it: [2].P of [2]."""
        if path in self._paths.numbers:
            return
        head, dot, _ = path.rpartition(b".")
        while dot and head:
            self._parts.setdefault(head, []).append(path)
            head, dot, _ = head.rpartition(b".")

    def replace(self, name: bytes, entry: Entry) -> None:
        """Gives a name these values instead of all that it had."""
        self._put(name, self._entry(entry, self.line))

    def swap(self, name: bytes, entry: PersistentMap | None) -> PersistentMap | None:
        """Gives a name what another name or call had (None: nothing); gives what it had."""
        before: PersistentMap | None = self.facts.names.get(name)
        self._put(name, entry)
        return before

    def entry(self, values: Entry) -> PersistentMap:
        """Values as ``swap`` takes them."""
        return self._entry(values, self.line)

    def forget(self, name: bytes, why: UnknownValue) -> bool:
        """Makes a name unknown; gives whether it had a value."""
        had = self.facts.names.get(name) is not None or name in self.fixed
        self.replace(name, {b"": why})
        return had

    def forget_all(self, why: UnknownValue) -> None:
        """Makes everything that is not fixed unknown."""
        self.facts = VariableFacts(PersistentMap(self.facts.names.numbers), why)

    def joined(self, one: VariableFacts, other: VariableFacts) -> VariableFacts:
        """What holds where two paths meet; ``one`` itself where the other path adds nothing."""
        if one.names.root is other.names.root and one.unknown is other.unknown:
            return one

        def merge(name: bytes, a: PersistentMap | None, b: PersistentMap | None) -> PersistentMap | None:
            if a is None and one.unknown is not None and name not in self.fixed:
                self.mixed.add(name)
                return None  # it is one of those that are not known already
            left, right = self._declared(one, name, a), self._declared(other, name, b)
            return left.merged(right, lambda path, _a, _b: self._join(name, path, left, right))

        names = one.names.merged(other.names, merge)
        unknown = one.unknown or other.unknown
        return one if names is one.names and unknown is one.unknown else VariableFacts(names, unknown)

    def _declared(self, facts: VariableFacts, name: bytes, entry: PersistentMap | None) -> PersistentMap:
        """What is known of a name whose facts are ``entry``."""
        if entry is not None:
            return entry
        values = self.fixed.get(name)
        if values is None:
            values = {} if facts.unknown is None else {b"": facts.unknown}
        return self._entry(values, 0)

    def _join(self, name: bytes, path: bytes, left: PersistentMap, right: PersistentMap) -> Fact:
        own: Fact | None = left.get(path)
        a, b = (_fact_at(side, path) for side in (left, right))
        if own is not None and isinstance(own.value, UnknownValue) and not isinstance(own.value, FrameEntry):
            return own
        if a is not None and b is not None:
            if isinstance(b.value, UnknownValue) and not isinstance(b.value, FrameEntry):
                self.mixed.add(name)
                return Fact(b.value, b.line)
            if _same(a.value, b.value):
                return a
            if isinstance(a.value, KrlTarget) and isinstance(b.value, KrlTarget):
                one, two = a.value.detached(), b.value.detached()
                if one == two:
                    self.mixed.add(name)
                    return Fact(one, a.line)
        self.mixed.add(name)
        places = " or ".join(
            dict.fromkeys(f"line {fact.line}" if fact and fact.line else "its declaration" for fact in (a, b))
        )
        return Fact(UnknownValue("KRL002", f"{shown(name + path)} varies: {places}"), 0)

    def _entry(self, values: Entry, line: int) -> PersistentMap:
        entry = self._nothing
        for path, value in values.items():
            self._note(path)
            entry = entry.set(path, Fact(value, line))
        return entry

    def _put(self, name: bytes, entry: PersistentMap | None) -> None:
        self.facts = VariableFacts(self.facts.names.set(name, entry), self.facts.unknown)

    def _fact(self, facts: VariableFacts, name: bytes, path: bytes) -> Fact | None:
        entry = facts.names.get(name)
        if entry is not None:
            return _fact_at(entry, path)
        self.asked.add(name)
        values = self.fixed.get(name)
        if values is None:
            return None if facts.unknown is None else Fact(facts.unknown, 0)
        if path in values:
            return Fact(values[path], 0)
        return _fact_at(self._entry(values, 0), path)


def _fact_at(entry: PersistentMap, path: bytes) -> Fact | None:
    """What is known of a path: itself, or as a component of what is before it."""
    fact: Fact | None = entry.get(path)
    if fact is not None:
        return fact
    head, dot, _ = path.rpartition(b".")
    if dot:
        before: Fact | None = entry.get(head)
        if before is not None:
            if isinstance(before.value, UnknownValue):
                return before
            found = component(before.value, path[len(head) :])
            if found is not None:
                return Fact(found, before.line)
    whole: Fact | None = entry.get(b"")
    return whole if whole is not None and isinstance(whole.value, UnknownValue) else None


def _same(one: Value, other: Value) -> bool:
    return type(one) is type(other) and one == other
