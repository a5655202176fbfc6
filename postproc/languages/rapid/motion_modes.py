"""Instructions that change how motions after them are meant."""

from __future__ import annotations

from postproc.languages.rapid.declared_data import walk
from postproc.languages.rapid.evaluation import Evaluator
from postproc.languages.rapid.instructions import MODES, SCALING
from postproc.languages.rapid.motion_facts import override_of
from postproc.languages.rapid.program_state import ProgramState
from postproc.languages.rapid.syntax_tree import Instruction, Module, NotUnderstood
from postproc.languages.rapid.values import UnknownData
from postproc.toolpath import ArcFrame, OrientationMode

MODES_OF_MOTIONS = SCALING | {b"CONFL", b"CONFJ", b"SINGAREA", b"CIRPATHMODE", b"VELSET"}
_LITERALS_ALONE = Evaluator(lambda name: (UnknownData("it is no literal"), b""))


def set_mode(step: Instruction, state: ProgramState, evaluator: Evaluator) -> None:
    """Takes up an instruction of ``MODES_OF_MOTIONS``."""
    options = frozenset(argument.name for argument in step.arguments)
    match step.name:
        case b"CONFL" | b"CONFJ":
            given = options & {b"ON", b"OFF"}
            checks = b"ON" in given if len(given) == len(step.arguments) == 1 else None
            setattr(state, "checks_linear" if step.name == b"CONFL" else "checks_joint", checks)
        case b"SINGAREA":
            modes = {frozenset([b"OFF"]): OrientationMode.VAR, frozenset([b"WRIST"]): OrientationMode.JOINT}
            state.orientation = modes.get(options, OrientationMode.UNKNOWN)
        case b"CIRPATHMODE":
            arcs = {frozenset([b"PATHFRAME"]): ArcFrame.PATH, frozenset([b"OBJECTFRAME"]): ArcFrame.BASE}
            state.arc = arcs.get(options, ArcFrame.UNKNOWN)
        case b"VELSET":
            state.override = override_of(step.arguments, evaluator)
        case _:
            state.scaled = True


def modes_at_start(module: Module) -> frozenset[bytes]:
    """Instructions of ``MODES`` by which the module sets nothing but what is in force where a program starts."""
    others: set[bytes] = set()
    for routine in module.routines:
        for step in (*walk(routine.body), *walk(routine.handlers)):
            if isinstance(step, NotUnderstood):
                others |= step.names
            elif isinstance(step, Instruction) and step.name in MODES and not _is_at_start(step):
                others.add(step.name)
    return frozenset(MODES - others)


def _is_at_start(step: Instruction) -> bool:
    if step.name not in MODES_OF_MOTIONS:
        return False
    state = ProgramState()
    set_mode(step, state, _LITERALS_ALONE)
    return state.is_same(ProgramState())
