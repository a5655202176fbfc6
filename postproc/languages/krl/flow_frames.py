"""The blocks, labels and calls that are open at one place of a program, and what a return to them restores."""

from __future__ import annotations

from dataclasses import dataclass, field

from postproc.languages.core.motion_sources import Meeting
from postproc.languages.core.persistent_map import PersistentMap
from postproc.languages.krl.execution_context import Flow, SplineBlock
from postproc.languages.krl.lexing import LOOPS
from postproc.languages.krl.modal_state import ModalState
from postproc.languages.krl.program_blocks import Block, Routine


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """What a return to an earlier place restores: numbers of rows, annotations, comments, readings of the position and
    routines that were followed; open blocks and routines; jumps on their way and labels passed in the routine."""

    flow: Flow
    counts: tuple[int, int, int, int, int]
    blocks: int
    activations: int
    waiting: PersistentMap
    heads: PersistentMap
    returned: Flow | None
    spline: SplineBlock | None
    routine: Routine | None
    copies: tuple[BlockFrame, ...] = ()


@dataclass(eq=False)
class BlockFrame:
    """A block or call that is open.

    followed: its condition is constant, and it runs as that says; else every branch may run, and a loop any number of
    times.  before: what holds before it, None where nothing leads there.  exits: what holds where its branches, or EXIT
    in it, leave it so far.  Of branches: chosen: index of the only one that runs, None where any may; falls_through:
    none of them may run.  Of loops that are not followed: head: what holds before each pass; meeting: of these.
    counter: of a FOR that is followed: name, value, last value, step.  Of a call: back: where it goes on; returned:
    which parameter comes back into which variable (name, path); lost: variables of which one changes a part; saved:
    what the caller's variables hold.  Of a spline: opened: what its WITH sets.
    """

    block: Block
    followed: bool
    checkpoint: Checkpoint
    before: Flow | None = None
    exits: Flow | None = None
    chosen: int | None = None
    falls_through: bool = False
    head: Flow | None = None
    meeting: Meeting = field(default_factory=Meeting)
    counter: tuple[bytes, int, int, int] | None = None
    back: int = -1
    returned: tuple[tuple[bytes, bytes, bytes], ...] = ()
    lost: frozenset[bytes] = frozenset()
    saved: tuple[tuple[bytes, PersistentMap | None], ...] = ()
    opened: ModalState | None = None

    @property
    def repeats(self) -> bool:
        """A loop or a call that is followed."""
        return self.followed and (self.back >= 0 or self.block.word in LOOPS)


@dataclass(eq=False)
class LabelHead:
    """A label that was passed and to which later jumps may lead back: what holds there, and the way back to it."""

    flow: Flow | None
    entry: Flow | None
    checkpoint: Checkpoint
    meeting: Meeting


@dataclass(eq=False)
class Activation:
    """A routine that runs.

    blocks: how many are open besides its own; waiting: label further down -> Flow of the jumps that lead there; heads:
    label -> LabelHead of those that were passed; returned: what holds where it returns.
    """

    blocks: int
    waiting: PersistentMap
    heads: PersistentMap
    returned: Flow | None = None


@dataclass
class Unfollowed:
    """What earlier passes found: starts of blocks and routines that are not followed; (start of the routine, name) of
    labels after which nothing is known; whether no loop, call or jump is followed at all."""

    blocks: set[int] = field(default_factory=set)
    labels: set[tuple[int, bytes]] = field(default_factory=set)
    everything: bool = False


class Restart(Exception):
    """The program is to be read again with what ``Unfollowed`` has learnt."""
