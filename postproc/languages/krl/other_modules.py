"""Modules beside a program: what a call of one of their routines changes that the caller knows too."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

from postproc.base.byte_search import occurs
from postproc.base.document import Document
from postproc.languages.core.comments_in_force import VARYING
from postproc.languages.core.motion_sources import ELSEWHERE, START
from postproc.languages.krl.aliases import parameters_of
from postproc.languages.krl.data import (
    Declarations,
    at_the_start,
    bind_symbols,
    read_data,
    read_references,
)
from postproc.languages.krl.lexing import Call, Statement, StatementKind, split_values
from postproc.languages.krl.modal_state import FrameIndex, FrameRegister, ModalState
from postproc.languages.krl.motion_rows import MotionRows
from postproc.languages.krl.predecessors import expanded
from postproc.languages.krl.program_blocks import Routine
from postproc.languages.krl.program_structure import ProgramStructure, program_structure, spread_later
from postproc.languages.krl.routine_calls import closure
from postproc.languages.krl.scan import scan
from postproc.languages.krl.statement_effects import Effect, Effects, is_harmless, returned_to
from postproc.languages.krl.target import UnknownValue
from postproc.languages.krl.value_types import structures_of
from postproc.languages.krl.variables import Variables
from postproc.languages.krl.vectorised import Item
from postproc.toolpath.initial_state import Symbol

_APART = re.compile(rb"\$(?:EX_AX_IGNORE|ASYNC_AXIS)[ \t]*+=|\bASY(?:PTP|CONT)\b", re.I)
MOST_DEPTH = 5
"""Calls of modules inside of one another that are followed."""
MOST_STEPS = 100_000
"""Statements of other modules that are followed in all."""

MOST_OUTCOMES = 2000
"""Calls of other modules with different values or states that are followed in all."""
MOST_ROUTINES = 200
"""Routines of other modules; where there are more, none is read: each is followed into all that it calls."""

_MOTION = Statement(StatementKind.MOTION, b"", b"", 0, 0)

MODAL_FIELDS = (
    "base", "tool", "feed", "blend", "tool_known", "orientation", "arc_frame", "frames_record", "path_record",
    "axis_record", "no_advance", "overridden",
)  # fmt: skip
"""What a called routine leaves to its caller, besides variables and the position."""
POSITION_FIELDS = (
    "point", "point_frames", "anchor", "point_unknown", "point_line", "axes", "external", "sources",
)  # fmt: skip


@dataclass(eq=False)
class OtherModule:
    """A module that is read and never written; apart: it takes external axes out of the motions."""

    document: Document
    code: list[Item]
    structure: ProgramStructure
    declarations: Declarations
    apart: bool

    @cached_property
    def can_be_followed(self) -> bool:
        """Whether its routines end where their text says."""
        words = {one.word for one in self.code if isinstance(one, Statement)}
        return not self.structure.unclosed and b"RESUME" not in words

    @cached_property
    def shared_later(self) -> set[bytes]:
        """Variables that other modules know, and that its interrupts and triggers change."""
        own = self.declarations.types.keys() - self.declarations.shared
        return self.structure.later - self.structure.routines.keys() - own

    @cached_property
    def has_trigger(self) -> bool:
        return any(isinstance(one, Statement) and one.word == b"TRIGGER" for one in self.code)

    def variables(self, others: OtherModules) -> Variables:
        """What its own names, and those of all modules, hold at any of its calls."""
        fixed, changing = at_the_start(self.declarations, others.assigned)
        variables = Variables(fixed)
        for name, entry in changing.items():
            variables.replace(name, entry)
        return variables


class RoutineExit(NamedTuple):
    """What a routine of another module leaves, and its frames.  moves: it surely moves the robot (True), surely does
    not (False), or may (None)."""

    state: ModalState
    frames: FrameRegister
    moves: bool | None


@dataclass(eq=False)
class OtherModules:
    """routines: those that other modules may call; effects: what they and what they call change that others know;
    unread: what they call that is not here; assigned: names that any of the modules assigns; outcomes: what held at
    the end of calls that were followed, by the call and what held before; steps: statements
    that were gone over for these."""

    routines: dict[bytes, tuple[OtherModule, Routine]] = field(default_factory=dict)
    effects: dict[bytes, Effects] = field(default_factory=dict)
    unread: dict[bytes, tuple[bytes, ...]] = field(default_factory=dict)
    assigned: set[bytes] = field(default_factory=set)
    table_entries: set[bytes | None] = field(default_factory=set)
    outcomes: dict[tuple[bytes, str], RoutineExit | None] = field(default_factory=dict)
    steps: int = 0

    def share(self, structure: ProgramStructure, own: Set[bytes]) -> None:
        """Takes up what the program changes: to the modules, and to it what they change, but for its ``own`` names."""
        self.assigned |= structure.assigned
        structure.table_entries |= self.table_entries
        later = structure.later.union(*(module.shared_later for module, _ in self.routines.values()))
        structure.later |= later - own
        self._share_parameters(structure)
        for module, _ in self.routines.values():
            module.structure.table_entries |= structure.table_entries
            for name in module.structure.later & self.effects.keys():
                module.structure.later_effects |= {one for one in self.effects[name] if isinstance(one, str)}
            module.structure.later |= later - module.declarations.types.keys() | module.shared_later

    def _share_parameters(self, structure: ProgramStructure) -> None:
        """Takes up what changes later because it is handed over to another module."""
        parameters = parameters_of({name: routine for name, (_, routine) in self.routines.items()})
        for module, routine in self.routines.values():
            structure.later |= module.structure.later & {name for name, _ in routine.parameters}
        spread_later(structure, parameters)
        for module, routine in self.routines.values():
            module.structure.later |= structure.later & {name for name, _ in routine.parameters}
        for module in dict.fromkeys(module for module, _ in self.routines.values()):
            spread_later(module.structure, parameters)

    def stay_apart(self, call: Call, returned: Set[Effect]) -> bool:
        """Whether the variables that a call hands over to come back are no two of one name, and none of ``returned``
        is one of the controller, or one that a module may know by its own name."""
        back = [comes_back for _, comes_back in self.routines[call.name][1].parameters]
        given = zip(split_values(call.arguments), back, strict=False)
        names = [name for text, comes_back in given if comes_back and (name := returned_to(text))]
        surveys = [
            module.structure for module in dict.fromkeys(module for module, _ in self.routines.values())
        ]
        return (
            len(set(names)) == len(names)
            and all(isinstance(effect, bytes) for effect in returned)
            and all(returned.isdisjoint(one.read | one.assigned) for one in surveys)
        )

    def directions(self) -> dict[bytes, tuple[bool, ...]]:
        """Name of a routine -> of each parameter whether it comes back changed."""
        return {
            name: tuple(back for _, back in routine.parameters)
            for name, (_, routine) in self.routines.items()
        }


def read_modules(
    documents: Sequence[Document], references: Sequence[Document], symbols: Mapping[str, Symbol]
) -> OtherModules:
    """The modules in ``documents``: each .src with its .dat; references: what declares names for all of them."""
    data = {_stem(one): one for one in documents if not is_module(one)}
    found = OtherModules()
    twice: set[bytes] = set()
    for document in filter(is_module, documents):
        module = _module(document, data.get(_stem(document)), references, symbols)
        found.assigned |= module.structure.assigned
        found.table_entries |= module.structure.table_entries
        for routine in module.structure.routines.values():
            if routine.is_main or routine.is_global:
                if routine.name in found.routines:
                    twice.add(routine.name)
                found.routines[routine.name] = module, routine
    for name in twice:
        del found.routines[name]
    if len(found.routines) > MOST_ROUTINES:
        return OtherModules()
    for name in found.routines:
        _settle(found, name)
    return found


def is_module(document: Document) -> bool:
    return document.path.suffix.lower() == ".src"


def _stem(document: Document) -> str:
    return document.path.stem.upper()


def _module(
    document: Document,
    data: Document | None,
    references: Sequence[Document],
    symbols: Mapping[str, Symbol],
) -> OtherModule:
    own_data = [] if data is None else [data]
    shared = [one for one in references if one is not data]
    declarations = Declarations(structures=structures_of([document, *own_data], shared))
    for one in own_data:
        read_data(declarations, one, 1)
    own = frozenset([*declarations.declared, *declarations.records])
    read_references(declarations, shared)
    bind_symbols(declarations, symbols, own)
    code = list(scan(document, True))
    statements = ((i, one if isinstance(one, Statement) else _MOTION) for i, one in enumerate(code))
    apart = occurs(_APART, document.raw)
    return OtherModule(document, code, program_structure(statements), declarations, apart)


def _settle(modules: OtherModules, name: bytes) -> None:
    """Notes what a routine, and all that it calls, changes and does not find."""
    effects: Effects = set()
    unread: dict[bytes, None] = {}
    seen: set[bytes] = set()
    todo = [name]
    while todo:
        at = todo.pop()
        if at in seen:
            continue
        seen.add(at)
        if at not in modules.routines:
            if not is_harmless(at):
                unread[at] = None
                effects.add("point")
            continue
        module, routine = modules.routines[at]
        own = module.declarations
        effects |= {
            effect
            for effect in routine.effects
            if isinstance(effect, str) or effect not in own.types or effect in own.shared
        }
        called = {
            call
            for one in closure(module.structure.routines, [at])
            for call in module.structure.routines[one].calls
        }
        todo += sorted(called - module.structure.routines.keys())
    modules.effects[name], modules.unread[name] = effects, tuple(unread)


def visible(modules: OtherModules, declarations: Declarations) -> dict[bytes, Effects]:
    """The effects of routines without names that the caller's module declares for itself."""
    own = declarations.types.keys() - declarations.shared
    return {name: effects - own for name, effects in modules.effects.items()}


def state_at_entry(state: ModalState, frames: FrameRegister, inner: FrameRegister) -> ModalState:
    """What a called routine starts with."""
    entry = ModalState(**{name: getattr(state, name) for name in MODAL_FIELDS})
    entry.force, entry.switch = state.force, state.switch
    entry.base, entry.tool = (_moved(one, frames, inner, 0) for one in (state.base, state.tool))
    return entry


def exit_of(state: ModalState, frames: FrameRegister, rows: MotionRows) -> RoutineExit:
    """What holds where a routine returns, from the ``state`` there; rows: its motions."""
    sources = expanded(rows, state.sources)
    moves = None if START in sources else True
    if sources == {START} and state.point_unknown == ModalState.point_unknown:
        moves = False
    return RoutineExit(state, frames, moves)


def take_exit(
    state: ModalState, before: ModalState, left: RoutineExit, frames: FrameRegister, why: str, line: int
) -> None:
    """Goes on with what a called routine left; before: what held before the call; frames: those of the caller."""
    exit, inner = left.state, left.frames
    entry = state.base, state.tool
    for name in MODAL_FIELDS:
        setattr(state, name, getattr(exit, name))
    for name in ("force", "switch"):
        comment = getattr(before, name)
        setattr(state, name, comment if getattr(exit, name) == comment else VARYING)
    state.stop = exit.stop if left.moves else max(before.stop, exit.stop)
    state.base, state.tool = (_moved(one, inner, frames, line) for one in (exit.base, exit.tool))
    if isinstance(state.base, UnknownValue):
        state.base = (
            entry[0] if entry[0] == exit.base else UnknownValue("KRL005", f"$BASE is not known {why}")
        )
    if isinstance(state.tool, UnknownValue):
        state.tool = (
            entry[1] if entry[1] == exit.tool else UnknownValue("KRL005", f"$TOOL is not known {why}")
        )
    if left.moves is False:
        for name in POSITION_FIELDS:
            setattr(state, name, getattr(before, name))
    elif left.moves:
        _take_position(
            state, exit, [_moved(one, inner, frames, line) for one in exit.point_frames or ()], line
        )


def _take_position(
    state: ModalState, exit: ModalState, point_frames: list[FrameIndex | UnknownValue], line: int
) -> None:
    """Where the last motion of a routine ended, which nothing corrects; point_frames: its base and tool."""
    state.sources = frozenset([ELSEWHERE])
    state.axes = exit.axes
    if exit.point is not None and len(point_frames) == 2:
        base, tool = point_frames
        if isinstance(base, FrameIndex) and isinstance(tool, FrameIndex):
            state.point, state.point_frames, state.point_line = exit.point, (base, tool), line


def _moved(
    frame: FrameIndex | UnknownValue, source: FrameRegister, target: FrameRegister, line: int
) -> FrameIndex | UnknownValue:
    if isinstance(frame, UnknownValue):
        return frame
    return target.of_other(frame, source, line)
