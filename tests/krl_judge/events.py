"""What comes at a time of its own: TRIGGER and INTERRUPT with what they do, BRAKE and RESUME.

An event comes so many motions after its statement as the inputs of the run say; one that an INTERRUPT states comes
again after as many, as long as it is on.  An interrupt is known in the routine that declares it and in what that
calls, with GLOBAL everywhere.  Names in what an event does are those of the routine that states it.  Where an event
has moved the robot nothing is said of where the next motion starts.  RESUME ends all that runs, up to the routine that
declares the interrupt.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass

from .motions import End
from .robot import Robot
from .syntax import Reader
from .values import UNDETERMINED, Cell, Stop, assign

MOST_EVENTS = 3
"""Events inside of each other's routines."""


class Resumed(Exception):
    """All ends up to that routine."""

    def __init__(self, scope: object) -> None:
        self.scope = scope


@dataclass(frozen=True, eq=False)
class Event:
    """``place`` gets ``value``, or the routine ``called`` runs with ``arguments``; ``scope``: the routine that states
    it."""

    scope: object
    is_global: bool = True
    number: int = -1
    place: tuple | None = None
    value: tuple | None = None
    called: str = ""
    arguments: tuple = ()


class Events:
    robot: Robot
    scopes: list

    def __init__(self, delay: int) -> None:
        self.delay = delay
        self.waiting: list[tuple[int, Event]] = []
        self.interrupts: dict[int, Event] = {}
        self.disabled: set[int] = set()
        self.running: list[Event] = []

    @abstractmethod
    def value(self, tree: tuple) -> object: ...

    @abstractmethod
    def whole(self, tree: tuple) -> int: ...

    @abstractmethod
    def assigned(self, tree: tuple) -> Cell | None: ...

    @abstractmethod
    def call(self, name: str, arguments: list) -> object: ...

    def later(self, event: Event) -> None:
        """Notes what comes some motions later."""
        self.waiting.append((len(self.robot.executed) + self.delay, event))

    def forget_events(self, scope: object) -> None:
        """The routine returns that has stated them."""
        mine = {n for n, one in self.interrupts.items() if one.scope is scope and not one.is_global}
        self.interrupts = {n: one for n, one in self.interrupts.items() if n not in mine}
        self.waiting = [(when, one) for when, one in self.waiting if one.number not in mine]

    def come_due(self) -> None:
        now = len(self.robot.executed)
        if len(self.running) >= MOST_EVENTS:
            return
        due = [one for when, one in self.waiting if when <= now and one.number not in self.disabled]
        self.waiting = [(when, one) for when, one in self.waiting if one not in due]
        for event in due:
            if self.delay and event.number in self.interrupts:
                self.waiting.append((now + 1 + self.delay, event))
            self.happen(event)

    def happen(self, event: Event) -> None:
        before = len(self.robot.executed)
        inside = self.scopes[-1] is not event.scope
        if inside:
            self.scopes.append(event.scope)
        self.running.append(event)
        try:
            if event.place is not None and event.value is not None:
                value, cell = self.value(event.value), self.assigned(event.place)
                if cell is not None:
                    assign(cell, value, UNDETERMINED)
            else:
                self.call(event.called, list(event.arguments))
        finally:
            self.running.pop()
            if inside:
                self.scopes.pop()
            if len(self.robot.executed) > before:
                self.robot.end = End()

    def resume(self) -> None:
        event = next((one for one in reversed(self.running) if one.number >= 0), None)
        if event is None:
            raise Stop("RESUME outside of interrupts")
        raise Resumed(event.scope)

    def trigger(self, reader: Reader, scope: object) -> None:
        reader.take()
        reader.expect("WHEN")
        if not reader.accept("DISTANCE"):
            reader.expect("PATH")
        reader.expect("=")
        self.value(reader.expression())
        reader.expect("DELAY")
        reader.expect("=")
        self.value(reader.expression())
        reader.expect("DO")
        self.later(self.action(reader, scope))

    def action(self, reader: Reader, scope: object, is_global: bool = True, number: int = -1) -> Event:
        name = reader.name()
        if reader.accept("("):
            event = Event(scope, is_global, number, called=name, arguments=tuple(reader.arguments()))
        else:
            place = reader.place(name)
            reader.expect("=")
            event = Event(scope, is_global, number, place, reader.expression())
        if reader.accept("PRIO"):
            reader.expect("=")
            self.value(reader.expression())
        reader.end()
        return event

    def interrupt(self, reader: Reader, scope: object) -> None:
        is_global = reader.accept("GLOBAL")
        reader.expect("INTERRUPT")
        if reader.accept("DECL"):
            number = self.whole(reader.expression())
            reader.expect("WHEN")
            reader.expression()
            reader.expect("DO")
            self.waiting = [(when, one) for when, one in self.waiting if one.number != number]
            self.interrupts[number] = self.action(reader, scope, is_global, number)
            return
        word = reader.take()
        if word not in ("ON", "OFF", "ENABLE", "DISABLE"):
            raise Stop(f"INTERRUPT {word}")
        if reader.kind == "end":
            numbers = sorted(self.interrupts)
        else:
            numbers = [self.whole(reader.expression())]
            if numbers[0] not in self.interrupts:
                raise Stop("no such interrupt")
        if word in ("ENABLE", "DISABLE"):
            self.disabled = self.disabled - {*numbers} if word == "ENABLE" else self.disabled | {*numbers}
            return
        self.waiting = [(when, one) for when, one in self.waiting if one.number not in numbers]
        if word == "ON":
            for number in numbers:
                self.later(self.interrupts[number])
