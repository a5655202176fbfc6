"""The statements of a routine as blocks that run from their first to their last, and where each goes on."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Hashable, Iterable
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from postproc.languages.core.motion_sources import Meeting

Step = TypeVar("Step")
"""A statement that goes on with the next one."""
Condition = TypeVar("Condition")
Name = TypeVar("Name", bound=Hashable)
"""Of a label."""

END, GONE = -1, -2
"""In the place of a block: the end of the routine; what does not come back."""


@dataclass(slots=True)
class FlowBlock(Generic[Step, Condition]):
    """``condition``: None goes on with ``follow``; else with ``follow`` where it holds and ``otherwise`` where not.
    follow: the next block, END or GONE.  further: blocks with which it may go on as well."""

    steps: list[Step] = field(default_factory=list)
    condition: Condition | None = None
    follow: int = END
    otherwise: int = END
    further: tuple[int, ...] = ()


class FlowGraph(Generic[Step, Condition, Name]):
    """The blocks of a routine; the first one is where it starts.  ``missing``: labels that no statement has, or
    several; ``loops``: block with the condition of a loop -> the block after it; between them are those of its body;
    ``meetings``: of places where paths meet.

    It is built statement by statement, in the order of the text: each goes to the last block, or opens new ones.
    """

    def __init__(self) -> None:
        self.blocks: list[FlowBlock[Step, Condition]] = [FlowBlock()]
        self.missing: list[Name] = []
        self.loops: dict[int, int] = {}
        self.meetings: defaultdict[Hashable, Meeting] = defaultdict(Meeting)
        self._labels: dict[Name, int] = {}
        self._jumps: list[tuple[FlowBlock[Step, Condition], tuple[Name, ...], bool]] = []

    @property
    def is_structured(self) -> bool:
        """Whether only loops go back, and nothing jumps into them."""
        return not self._jumps

    def _new(self) -> int:
        self.blocks.append(FlowBlock())
        return len(self.blocks) - 1

    def _go_on(self) -> int:
        """A new block after the last one."""
        last = self.blocks[-1]
        last.follow = self._new()
        return last.follow

    def step(self, step: Step) -> None:
        self.blocks[-1].steps.append(step)

    def branch(self, condition: Condition) -> FlowBlock[Step, Condition]:
        """What comes runs where a condition holds; gives the block that decides it."""
        head = self.blocks[-1]
        head.condition = condition
        head.follow = self._new()
        return head

    def otherwise(self, head: FlowBlock[Step, Condition]) -> FlowBlock[Step, Condition]:
        """What comes runs where the condition of ``head`` does not hold; gives the last block of what ran where it
        does."""
        last = self.blocks[-1]
        head.otherwise = self._new()
        return last

    def meet(self, ends: Iterable[FlowBlock[Step, Condition]]) -> None:
        """What comes runs after the last block, and after all of ``ends``."""
        after = self._go_on()
        for block in ends:
            block.follow = after

    def loop(self, condition: Condition, first: Iterable[Step] = ()) -> int:
        """What comes is the body of a loop; gives the block with its ``condition``, before which ``first`` runs."""
        at = self._go_on()
        head = self.blocks[at]
        head.steps += first
        head.condition = condition
        head.follow = self._new()
        return at

    def end_loop(self, head: int) -> None:
        """The end of the body of the loop of the block ``head``."""
        self.blocks[-1].follow = head
        self.blocks[head].otherwise = self.loops[head] = self._new()

    def label(self, name: Name) -> None:
        if name in self._labels:
            self.missing.append(name)
        self._labels[name] = self._go_on()

    def jump(self, name: Name) -> None:
        self._jumps.append((self.blocks[-1], (name,), True))
        self._new()

    def may_jump(self, names: Iterable[Name]) -> None:
        """The program goes on, or jumps to one of these labels."""
        self._jumps.append((self.blocks[-1], tuple(names), False))
        self._go_on()

    def leave(self, to: int) -> None:
        """The routine ends here: ``to`` is END or GONE."""
        self.blocks[-1].follow = to
        self._new()

    def link(self) -> None:
        """Leads the jumps to their labels, once all statements are taken."""
        for block, names, surely in self._jumps:
            self.missing += [name for name in names if name not in self._labels]
            found = [self._labels.get(name, GONE) for name in names]
            if surely:
                [block.follow] = found
            else:
                block.further = tuple(found)
