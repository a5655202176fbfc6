"""What the variables of a program hold: assigned, forgotten, and taken back at the cost of what was done."""

from __future__ import annotations

import re

from postproc.languages.krl.expressions import Value, component
from postproc.languages.krl.target import UnknownValue

_ROOT = re.compile(rb"[A-Za-z0-9_$]+")

Entry = dict[bytes, Value]
"""The values of one name by what follows it: b"" itself, b"[2]", b".F", b"[2].F"."""

_NEW: Entry = {}


class Variables:
    """Names (upper case) and their values.

    Every change is noted, so that ``undo(mark())`` takes back what happened in between without a copy of everything.
    ``fixed``: what no part of the program changes (points of the .dat), found where no variable hides it.
    """

    def __init__(self, fixed: dict[bytes, Entry]) -> None:
        self.fixed = fixed
        self._names: dict[bytes, Entry] = {}
        self._lost: UnknownValue | None = None
        self._journal: list[tuple[Entry | None, bytes, object]] = []

    def begin(self) -> None:
        """What was set up to here is what the program starts with."""
        self._journal.clear()

    def mark(self) -> int:
        return len(self._journal)

    def undo(self, mark: int) -> None:
        while len(self._journal) > mark:
            entry, key, old = self._journal.pop()
            if entry is None and key == b"*":
                self._names, self._lost = old  # type: ignore[misc]
            elif entry is None:
                if old is None:
                    self._names.pop(key, None)
                else:
                    self._names[key] = old  # type: ignore[assignment]
            elif old is None:
                entry.pop(key, None)
            else:
                entry[key] = old  # type: ignore[assignment]

    def get(self, name: bytes, path: bytes = b"") -> Value | None:
        """The value of ``name path``; None where nothing was ever assigned; UnknownValue where it is not known."""
        entry = self._names.get(name)
        if entry is None:
            entry = self.fixed.get(name)
            if entry is None:
                return self._lost
        if path in entry:
            return entry[path]
        head, dot, _ = path.rpartition(b".")
        if dot:
            whole = entry.get(head)
            if isinstance(whole, UnknownValue):
                return whole
            found = None if whole is None else component(whole, path[len(head) :])
            if found is not None:
                return found
        whole = entry.get(b"")
        return whole if isinstance(whole, UnknownValue) else None

    def set(self, name: bytes, path: bytes, value: Value) -> None:
        if not path:
            # The value of the whole takes the place of all of its parts.
            self.replace(name, {b"": value})
            return
        entry = self._names.get(name)
        if entry is None:
            entry = dict(self.fixed.get(name, _NEW)) if name in self.fixed else {}
            self._journal.append((None, name, None))
            self._names[name] = entry
            entry[path] = value
            return
        self._journal.append((entry, path, entry.get(path)))
        entry[path] = value

    def replace(self, name: bytes, entry: Entry | None) -> Entry | None:
        """Gives a name another entry (None: none); gives the one before."""
        before = self._names.get(name)
        self._journal.append((None, name, before))
        if entry is None:
            self._names.pop(name, None)
        else:
            self._names[name] = entry
        return before

    def forget(self, name: bytes, why: UnknownValue) -> bool:
        """Makes a name unknown; gives whether it had a value."""
        had = name in self._names or name in self.fixed
        self.replace(name, {b"": why})
        return had

    def forget_all(self, why: UnknownValue) -> None:
        """Makes everything that is not fixed unknown."""
        self._journal.append((None, b"*", (self._names, self._lost)))
        self._names, self._lost = {}, why
