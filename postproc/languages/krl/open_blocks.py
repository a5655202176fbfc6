"""The blocks and calls that are open while a program is read, and how far it is followed."""

from __future__ import annotations

from dataclasses import replace

from postproc.languages.core.persistent_map import KeyNumbers, PersistentMap
from postproc.languages.krl.execution_context import ExecutionContext, Flow
from postproc.languages.krl.flow_frames import Activation, BlockFrame, Checkpoint, Restart, Unfollowed
from postproc.languages.krl.lexing import LOOPS, Statement
from postproc.languages.krl.program_blocks import Block
from postproc.toolpath import Annotation

BUDGET = 20_000
"""Statements of a file that are followed again, in loops, jumps and calls; as many where it is not known that they
run."""
MOST_STEPS = 2 * BUDGET
"""Statements that are gone over besides once the text: beyond, as with one of more than ``BUDGET`` statements, a loop
that is not followed forgets at once what it may change instead of finding out what it does."""

_REPEATED = LOOPS | {b"DEF"}


class OpenBlocks:
    """Notes what is open, and returns to earlier places.

    reachable: some path leads here; else lines are passed over up to a place where one does.  stack: open blocks and
    calls; activations: routines that run; repeating, not_followed: how many of the open blocks are loops and calls that
    are followed, or are not followed. seen: statements that ran in loops and calls; stops: 1 + whether the advance run
    stops at a statement, 0 where that was not asked; spent, spent_not_followed: how often such ones ran again, surely
    or maybe; went_back: a GOTO led back, so that every line may run again; shallow: where it is not known that they
    run, loops and calls are not followed any more; steps, passes: statements that were gone over, and how many may be.
    """

    def __init__(self, run: ExecutionContext, unfollowed: Unfollowed) -> None:
        self.run, self.unfollowed = run, unfollowed
        self.stack: list[BlockFrame] = []
        self._labels = KeyNumbers()
        self.activations = [self._activation()]
        self.reachable = True
        self.repeating = self.not_followed = self.spent = self.spent_not_followed = self.steps = 0
        self.most_steps = len(run.code) + MOST_STEPS
        self.seen = bytearray(len(run.code))
        self.stops = bytearray(len(run.code))
        self.went_back = self.shallow = False
        self.text_called: set[bytes] = set()
        self.comments: dict[int, Annotation] = {}

    def _activation(self) -> Activation:
        return Activation(len(self.stack), PersistentMap(self._labels), PersistentMap(self._labels))

    def reset(self) -> None:
        """Nothing is open."""
        self.stack, self.reachable = [], True
        self.activations = [self._activation()]
        self.repeating = self.not_followed = 0
        self.run.opaque = self.run.spline = None

    def _checkpoint(self, copies: bool = False) -> Checkpoint:
        run, routine = self.run, self.activations[-1]
        counts = (
            len(run.rows),
            len(run.rows.annotations),
            len(self.comments),
            len(run.rows.reads),
            len(run.followed),
        )
        frames = tuple(map(replace, self.stack[routine.blocks :])) if copies else ()
        return Checkpoint(
            run.flow(), counts, len(self.stack), len(self.activations), routine.waiting, routine.heads,
            routine.returned, run.spline, run.routine, frames,
        )  # fmt: skip

    def _return_to(self, place: Checkpoint) -> None:
        """Takes back what was followed since; what holds there is up to the caller."""
        run = self.run
        del self.activations[place.activations :], self.stack[place.blocks :]
        routine = self.activations[-1]
        routine.waiting, routine.heads, routine.returned = place.waiting, place.heads, place.returned
        if place.copies:
            self.stack[routine.blocks :] = map(replace, place.copies)
        self._count()
        rows, annotations, comments, reads, followed = place.counts
        run.rows.truncate(rows)
        del run.rows.annotations[annotations:], run.rows.reads[reads:]
        for table, count in ((self.comments, comments), (run.followed, followed)):
            while len(table) > count:
                table.popitem()
        run.spline, run.routine = place.spline, place.routine

    def _count(self) -> None:
        self.repeating = sum(f.followed and f.block.word in _REPEATED for f in self.stack)
        self.not_followed = sum(not f.followed for f in self.stack)
        self.run.opaque = next((f.block for f in self.stack if not f.followed and f.block.broken), None)

    def _push(self, block: Block, followed: bool) -> BlockFrame:
        frame = BlockFrame(block, followed, self._checkpoint())
        frame.before = frame.checkpoint.flow if self.reachable else None
        if self.run.spline is not None:
            self.run.spline = replace(self.run.spline, can_be_entered=False)
        self.stack.append(frame)
        self.repeating += followed and block.word in _REPEATED
        self.not_followed += not followed
        return frame

    def _pop(self) -> BlockFrame:
        frame = self.stack.pop()
        self.repeating -= frame.followed and frame.block.word in _REPEATED
        self.not_followed -= not frame.followed
        if frame.block is self.run.opaque:
            self.run.opaque = None
        return frame

    def _continue_with(self, flow: Flow | None) -> None:
        """Goes on with what holds here; None: no path leads here."""
        self.reachable = flow is not None
        if flow is not None:
            self.run.resume(flow)

    def _here(self) -> Flow | None:
        return self.run.flow() if self.reachable else None

    def _forgotten(self, flow: Flow, block: Block) -> Flow:
        """What holds once everything may have run that is in a block."""
        run, here = self.run, self.run.flow()
        run.resume(flow)
        word = block.word.decode("latin-1")
        run.forget(block.effects, f"in the {word} block of line {block.line}")
        run.state.form = None
        found = run.flow()
        run.resume(here)
        return found

    def _item(self, at: int) -> Statement:
        item = self.run.code[at]
        assert isinstance(item, Statement)
        return item

    def _report_length(self, item: Statement) -> None:
        message = f"it executes more than the {BUDGET} statements that are followed; its passes are not distinguished"
        self.run.add_finding("KRL024", message, item)

    def _abort(self, frame: BlockFrame) -> int:
        """Takes back what was followed since ``frame``; from now on all of its paths are joined."""
        self._return_to(frame.checkpoint)
        self._continue_with(frame.checkpoint.flow)
        self.unfollowed.blocks.add(frame.block.start)
        return frame.back - 1 if frame.back >= 0 else frame.block.start

    def _give_up(self) -> int | None:
        """The budget is spent: gives where the reading goes on."""
        run = self.run
        if self.spent > BUDGET and not self.unfollowed.everything:
            self.unfollowed.everything = True
            outermost = next((frame for frame in self.stack if frame.repeats), None)
            if self.went_back or outermost is None:
                raise Restart
            at = self._abort(outermost)
            item = run.code[at]
            assert isinstance(item, Statement)
            self._report_length(item)
            return at
        if self.spent_not_followed > BUDGET:
            self.shallow = True
            first = next((i for i, frame in enumerate(self.stack) if not frame.followed), 0)
            inner = next((frame for frame in self.stack[first:] if frame.repeats), None)
            if inner is not None:
                return self._abort(inner)
            if self.went_back and not self.unfollowed.everything:
                self.unfollowed.everything = True
                raise Restart
        return None
