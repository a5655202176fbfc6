"""Runs the blocks of a routine with what holds at its start, and joins what holds where its paths meet.

A loop whose conditions are constants is run pass by pass, any other one until nothing changes any more.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from heapq import heappop, heappush
from typing import Any, Generic, Protocol, TypeVar

from postproc.languages.core.flow_graph import FlowGraph
from postproc.languages.core.motion_sources import Meeting

UNROLLED = 10_000
"""Statements in loops up to which these are run by themselves, in a run of a routine and what it calls; further ones
are run together, each statement a few times."""
NESTED = 1
"""Loops in each other whose passes are not known and in which further loops are run pass by pass."""
DEEPEST = 20
"""Loops in each other that are run by themselves; those in them are run together."""

LONG = 8
"""Statements of a block from which on it is remembered what it did with the states of its last runs."""
KEPT = 3
"""Runs that are remembered."""
MOST_PASSES = 16
"""Passes over a place after which what is known of variables there is lost where it still changes: a chain of
assignments would else take as many passes as it has variables."""


class FlowState(Protocol):
    """What holds at a place of a program."""

    def copy(self: State) -> State: ...

    def join(self: State, other: State, meeting: Meeting) -> bool:
        """Takes in what holds where another path meets this one, at the place of ``meeting``; whether anything
        changed."""

    def is_same(self: State, other: State) -> bool:
        """Whether the same holds in both."""

    @property
    def known(self) -> object:
        """What is known of variables: another object where it is another."""

    def forget(self: State) -> None:
        """Makes every variable unknown that the program has set."""


State = TypeVar("State", bound=FlowState)
_Stable = tuple[dict[int, State], dict[int, list[tuple[int, State]]]]
Graph = TypeVar("Graph", bound=FlowGraph[Any, Any, Any])


class FlowRunner(Generic[Graph, State]):
    """``after``: runs a block, and gives where it leads and what holds there; ``version``: a number that changes where
    that may become another one; ``recording``: what runs is taken up."""

    def __init__(
        self,
        after: Callable[[Graph, int, State], list[tuple[int, State]]],
        version: Callable[[], int] = lambda: 0,
    ) -> None:
        self._run_block, self._version = after, version
        self.recording = False
        self._known: dict[tuple[int, int], list[tuple[State, int, list[tuple[int, State]]]]] = {}
        self._stable_known: dict[tuple[int, int, int], list[tuple[State, int, _Stable[State]]]] = {}
        self._left = 0  # statements and blocks that can still be run in loops
        self._deep = 0  # loops in each other
        self._unknown = 0  # loops that are run until nothing changes

    def start(self) -> None:
        """Starts a run of the program."""
        self._left = UNROLLED

    def run(self, graph: Graph, state: State, recording: bool) -> State | None:
        """The state after a routine; None where it does not come back."""
        before, self.recording = self.recording, recording
        ends: list[State] = []
        try:
            if graph.is_structured:
                self._region(graph, 0, len(graph.blocks), state, ends)
            else:
                self._repeated(graph, 0, len(graph.blocks), state, ends)
        finally:
            self.recording = before
        return _joined(ends, graph.meetings[-1])

    def _after(self, graph: Graph, at: int, state: State) -> list[tuple[int, State]]:
        """Runs a block with ``state``, which is not kept; a long one that ran with the same is not run again."""
        if self.recording or len(graph.blocks[at].steps) < LONG:
            return self._run_block(graph, at, state)
        runs = self._known.setdefault((id(graph), at), [])
        version = self._version()
        for before, known, led in runs:
            if known == version and before.is_same(state):
                return [(there, after.copy()) for there, after in led]
        before = state.copy()
        led = self._run_block(graph, at, state)
        runs.append((before, self._version(), [(there, after.copy()) for there, after in led]))
        del runs[:-KEPT]
        return led

    def _region(self, graph: Graph, first: int, stop: int, state: State, ends: list[State]) -> State | None:
        """Runs the blocks from ``first`` to before ``stop``, of which none goes back but loops; the state with which
        they are left for others, None where they never are.  ends: the states with which the routine is left."""
        starts = {first: state}
        leaving: list[State] = []
        at = first
        while at < stop:
            here = starts.pop(at, None)
            after_loop = graph.loops.get(at)
            if here is None:
                at += 1
                continue
            if self._deep:
                self._left -= 1 + len(graph.blocks[at].steps)
            if after_loop is None:
                led = self._after(graph, at, here.copy())
                at += 1
            else:
                end = self._loop(graph, at, after_loop, here, ends)
                led = [] if end is None else [(after_loop, end)]
                at = after_loop
            for there, after in led:
                if there == -1:
                    ends.append(after.copy())
                elif first <= there < stop and there in starts:
                    starts[there].join(after, graph.meetings[there])
                elif first <= there < stop:
                    starts[there] = after.copy()
                elif there >= 0:
                    leaving.append(after.copy())
        return _joined(leaving, graph.meetings[first, stop])

    def _loop(self, graph: Graph, head: int, after: int, state: State, ends: list[State]) -> State | None:
        """The state after a loop with its condition in the block ``head``; None where it is not left so."""
        if self._deep >= DEEPEST:
            return self._repeated(graph, head, after, state, ends)
        self._deep += 1
        try:
            return self._passes(graph, head, after, state, ends)
        finally:
            self._deep -= 1

    def _passes(self, graph: Graph, head: int, after: int, state: State, ends: list[State]) -> State | None:
        """As ``_loop``, pass by pass as long as the condition is a constant."""
        while True:
            if self._left < 0:
                return self._until_stable(graph, head, after, state, ends)
            led = self._after(graph, head, state.copy())
            if len(led) > 1:
                return self._until_stable(graph, head, after, state, ends)
            [(there, inside)] = led
            if there == after:
                return inside
            back = self._region(graph, head + 1, after, inside, ends)
            if back is None or back.is_same(state):
                return None
            state = back

    def _until_stable(
        self, graph: Graph, head: int, after: int, state: State, ends: list[State]
    ) -> State | None:
        """As ``_loop``, where it is not known how often it runs."""
        if self._unknown >= NESTED or self._left < 0:
            return self._repeated(graph, head, after, state, ends)
        state, before = state.copy(), self.recording
        self._unknown += 1
        passes = 0
        try:
            self.recording = False
            while True:
                passes += 1
                found: list[State] = []
                inside, end = self._entered(graph, head, after, state)
                back = None if inside is None else self._region(graph, head + 1, after, inside, found)
                if back is None or not self._learns(state, back, graph.meetings[head], passes):
                    break
            self.recording = before
            if before:
                found = []
                inside, end = self._entered(graph, head, after, state)
                if inside is not None:
                    self._region(graph, head + 1, after, inside, found)
            ends += found
        finally:
            self.recording = before
            self._unknown -= 1
        return end

    def _learns(self, state: State, other: State, meeting: Meeting, passes: int) -> bool:
        """Joins what holds where another path leads to a place that was passed before; whether anything changed."""
        known = state.known
        if not state.join(other, meeting):
            return False
        if passes >= MOST_PASSES and state.known is not known:
            state.forget()
        return True

    def _entered(
        self, graph: Graph, head: int, after: int, state: State
    ) -> tuple[State | None, State | None]:
        """The states in which a loop is entered, and left, after its condition."""
        led = dict(self._after(graph, head, state.copy()))
        inside = led.get(head + 1)
        end = led.get(after)
        return (None if inside is None else inside.copy()), (None if end is None else end.copy())

    def _repeated(self, graph: Graph, first: int, stop: int, state: State, ends: list[State]) -> State | None:
        """As ``_region``, of blocks that go back in any way: each with what holds on all paths that lead to it."""
        starts, outside = self._stable(graph, first, stop, state)
        before = self.recording
        leaving: list[State] = []
        for at in sorted(starts):
            led = self._after(graph, at, starts[at].copy()) if before else outside[at]
            for there, after in led:
                if there == -1:
                    ends.append(after.copy())
                elif there >= 0 and not first <= there < stop:
                    leaving.append(after.copy())
        return _joined(leaving, graph.meetings[first, stop])

    def _stable(self, graph: Graph, first: int, stop: int, state: State) -> _Stable[State]:
        """What holds before the blocks from ``first`` to before ``stop`` once nothing changes any more, and with what
        each leaves for others; remembered, as a loop around them often comes with the same again."""
        runs = self._stable_known.setdefault((id(graph), first, stop), [])
        version = self._version()
        for known_state, known_version, found in runs:
            if known_version == version and known_state.is_same(state):
                return found
        before, self.recording = self.recording, False
        starts, pending, waiting = {first: state.copy()}, [first], {first}
        outside: dict[int, list[tuple[int, State]]] = {}
        passes = Counter[int]()
        later: list[int] = []  # what a jump back leads to waits for the rest of the text
        while pending or later:
            if not pending:
                pending, later = sorted(later), []
            at = heappop(pending)
            waiting.remove(at)
            passes[at] += 1
            outside[at] = []
            for there, after in self._after(graph, at, starts[at].copy()):
                if not first <= there < stop:
                    outside[at].append((there, after))
                    continue
                if there not in starts:
                    starts[there] = after.copy()
                elif not self._learns(starts[there], after, graph.meetings[there], passes[there]):
                    continue
                if there not in waiting:
                    waiting.add(there)
                    if there > at:
                        heappush(pending, there)
                    else:
                        later.append(there)
        self.recording = before
        runs.append((state.copy(), self._version(), (starts, outside)))
        del runs[:-KEPT]
        return starts, outside


def _joined(states: list[State], meeting: Meeting) -> State | None:
    """What holds in all of them, which meet at ``meeting``; None of none."""
    if not states:
        return None
    found = states[0]
    for other in states[1:]:
        found.join(other, meeting)
    return found
