"""What only the controller knows and the cell states: values of names, and the state at the first statement."""

from __future__ import annotations

from collections.abc import Mapping

from postproc.languages.krl.assignments import numbered_frame
from postproc.languages.krl.execution_context import ExecutionContext
from postproc.languages.krl.external_axes import six
from postproc.languages.krl.modal_state import NAN
from postproc.languages.krl.target import COMPONENTS
from postproc.toolpath.initial_state import InitialState, Symbol


def start_with(run: ExecutionContext, initial: InitialState, symbols: Mapping[str, Symbol]) -> None:
    """Sets what holds where the program starts; of FDAT_ACT a file says only what an earlier run left."""
    state = run.initial
    if initial.base is not None:
        state.base = numbered_frame(run, b"BASE", initial.base, 0)
    if initial.tool is not None:
        state.tool = numbered_frame(run, b"TOOL", initial.tool, 0)
    if initial.words:
        state.point = six([initial.words.get(key.decode(), NAN) for key in COMPONENTS])
        state.point_frames = (state.base, state.tool)
        state.point_unknown = "program_start of the cell does not state it"
    if "FDAT_ACT" in map(str.upper, symbols):
        state.frames_record = run.declarations.records.get(b"FDAT_ACT")
