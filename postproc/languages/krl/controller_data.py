"""What only the controller knows and the cell states: values of names, and the state at the first statement."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from postproc.base.arrays import Ints
from postproc.base.document import Document
from postproc.base.geometry import Poses
from postproc.base.units import DEG, MM
from postproc.languages.krl.assignments import numbered_frame
from postproc.languages.krl.execution_context import ExecutionContext
from postproc.languages.krl.external_axes import six
from postproc.languages.krl.modal_state import NAN
from postproc.languages.krl.spatial import Numbers
from postproc.languages.krl.target import COMPONENTS, KrlTarget, parse
from postproc.toolpath import FrameRef
from postproc.toolpath.initial_state import InitialState, Symbol

_BASE = re.compile(
    rb"^[ \t]*+BASE_DATA[ \t]*+\[[ \t]*+(\d{1,4})[ \t]*+\][ \t]*+=[ \t]*+(\{[^{}\r\n]*+\})", re.I | re.M
)


def declared_bases(documents: Iterable[Document]) -> dict[int, tuple[Numbers, str]]:
    """Number of a base -> X..C [mm, deg] as the controller's own files ($config.dat) state it, and the file; what two
    of them state differently is left out."""
    found: dict[int, tuple[Numbers, str]] = {}
    different: set[int] = set()
    for document in documents:
        if "config" not in document.path.stem.lower():
            continue
        for said in _BASE.finditer(document.raw):
            number, target = int(said[1]), parse(said[2], 0, -1)
            values = target.numbers if isinstance(target, KrlTarget) else None
            if values is None or found.setdefault(number, (values, document.path.name))[0] != values:
                different.add(number)
    return {number: base for number, base in found.items() if number not in different}


def with_declared_bases(
    bases: Mapping[int, tuple[Numbers, str]], base: Ints, frames: tuple[FrameRef, ...]
) -> tuple[Ints, tuple[FrameRef, ...]]:
    """(N,) the indices ``base`` (N,) of the bases of motions, and the frames with what ``bases`` state of those without
    a pose."""
    more = list(frames)
    renamed = np.append(np.arange(len(frames)), -1)
    for index in np.unique(base[base >= 0]).tolist():
        frame = frames[index]
        if frame.pose is None and frame.number in bases:
            values, _ = bases[frame.number]
            pose = Poses.from_abc(np.array(values[:3]) * MM, np.array(values[3:]) * DEG)
            renamed[index] = len(more)
            more.append(replace(frame, declared=pose))
    return renamed[base], tuple(more)


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
