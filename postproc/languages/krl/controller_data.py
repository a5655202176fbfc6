"""What only the controller knows and the cell states: values of names, and the state at the first statement."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from postproc.languages.krl.assignments import numbered_frame
from postproc.languages.krl.data import Declarations
from postproc.languages.krl.execution_context import ExecutionContext
from postproc.languages.krl.expressions import UntypedNumber, Value
from postproc.languages.krl.external_axes import six
from postproc.languages.krl.modal_state import NAN
from postproc.languages.krl.target import AXES, COMPONENTS, EXTERNAL, KrlTarget, parse
from postproc.toolpath.initial_state import InitialState, Symbol

_POINT_KEYS = frozenset([*COMPONENTS, *AXES, *EXTERNAL, b"S", b"T"])


def bind_symbols(declarations: Declarations, symbols: Mapping[str, Symbol]) -> None:
    """Adds the names that no file declares with a value; what the program assigns is its own."""
    for name, symbol in symbols.items():
        key = name.upper().replace(" ", "").encode("latin-1", "replace")
        root = key.split(b"[")[0]
        if key in declarations.declared or key in declarations.records:
            continue
        if isinstance(symbol, Mapping):
            fields = {part.upper().encode("latin-1", "replace"): value for part, value in symbol.items()}
            if not fields.keys() <= _POINT_KEYS:
                declarations.records[key] = {part: _literal(value) for part, value in fields.items()}
                continue
            text = b",".join(part + b" " + _literal(value) for part, value in fields.items())
            value: Value = parse(b"{" + text + b"}", 0, -1)
            if isinstance(value, KrlTarget):
                value = replace(value.detached(), locked="its value is known to the controller only")
        elif declarations.types.get(root) == b"INT":
            value = int(symbol)
        else:
            value = float(symbol) if declarations.types.get(root) == b"REAL" else UntypedNumber(symbol)
        declarations.declared.add(key)
        declarations.shared.add(root)
        declarations.values.setdefault(root, {})[key[len(root) :]] = value


def start_with(run: ExecutionContext, initial: InitialState) -> None:
    """Sets what holds where the program starts."""
    state = run.initial
    if initial.base is not None:
        state.base = numbered_frame(run, b"BASE", initial.base, 0)
    if initial.tool is not None:
        state.tool = numbered_frame(run, b"TOOL", initial.tool, 0)
    if initial.words:
        state.point = six([initial.words.get(key.decode(), NAN) for key in COMPONENTS])
        state.point_frames = (state.base, state.tool)
        state.point_unknown = "program_start of the cell does not state it"
    state.frames_record = run.declarations.records.get(b"FDAT_ACT")


def _literal(value: float) -> bytes:
    return b"%d" % value if value == int(value) else repr(value).encode()
