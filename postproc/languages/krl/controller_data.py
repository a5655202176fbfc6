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
from postproc.languages.krl.execution_context import ExecutionContext
from postproc.languages.krl.external_axes import six
from postproc.languages.krl.modal_state import NAN
from postproc.languages.krl.spatial import ZERO, Numbers
from postproc.languages.krl.target import COMPONENTS, KrlTarget, parse
from postproc.toolpath import FrameRef
from postproc.toolpath.initial_state import InitialState, Symbol

_ENTRY = re.compile(
    rb"^[ \t]*+(BASE|TOOL)_DATA[ \t]*+\[[ \t]*+(\d{1,4})[ \t]*+\][ \t]*+=[ \t]*+(\{[^{}\r\n]*+\})",
    re.I | re.M,
)


_LOAD = re.compile(
    rb"^[ \t]*+LOAD_DATA[ \t]*+\[[ \t]*+(\d{1,4})[ \t]*+\][ \t]*+=[ \t]*+\{[ \t]*+"
    rb"M[ \t]++(\d++\.?+\d*+(?:E[-+]?\d++)?+)[ \t]*+,[ \t]*+CM[ \t]*+(\{[^{}\r\n]*+\})",
    re.I | re.M,
)

Load = tuple[float, float, float, float]


def declared_loads(documents: Iterable[Document]) -> dict[int, Load]:
    """Number of a tool -> mass [kg] and its centre [m] on the flange as ``LOAD_DATA`` of the controller's own files
    states them; what two of them state differently is left out, and so is what has no mass."""
    found: dict[int, Load] = {}
    different: set[int] = set()
    for document in documents:
        if "config" not in document.path.stem.lower():
            continue
        for said in _LOAD.finditer(document.raw):
            number, mass, centre = int(said[1]), float(said[2]), parse(said[3], 0, -1)
            if not isinstance(centre, KrlTarget) or centre.numbers is None or not mass > 0:
                continue
            x, y, z = (value * MM for value in centre.numbers[:3])
            if found.setdefault(number, (mass, x, y, z)) != (mass, x, y, z):
                different.add(number)
    return {number: load for number, load in found.items() if number not in different}


def with_loads(loads: Mapping[int, Load], used: Ints, frames: tuple[FrameRef, ...]) -> tuple[FrameRef, ...]:
    """The frames with the ``loads`` of those that motions ``use`` (N,) as tools."""
    tools = set(np.unique(used[used >= 0]).tolist()) if loads else set()
    return tuple(
        replace(frame, load=loads.get(frame.entry or 0)) if index in tools else frame
        for index, frame in enumerate(frames)
    )


def declared_frames(documents: Iterable[Document]) -> dict[str, tuple[Numbers, str]]:
    """``BASE_DATA[n]`` or ``TOOL_DATA[n]`` -> X..C [mm, deg] as the controller's own files ($config.dat) state it, and
    the file; what two of them state differently is left out, and so are tools of zeros, which a controller has before
    they are measured."""
    found: dict[str, tuple[Numbers, str]] = {}
    different: set[str] = set()
    for document in documents:
        if "config" not in document.path.stem.lower():
            continue
        for said in _ENTRY.finditer(document.raw):
            entry, target = entry_of(said[1].upper(), int(said[2])), parse(said[3], 0, -1)
            values = target.numbers if isinstance(target, KrlTarget) else None
            if values == ZERO and entry.startswith("TOOL"):
                values = None
            if values is None or found.setdefault(entry, (values, document.path.name))[0] != values:
                different.add(entry)
    return {entry: frame for entry, frame in found.items() if entry not in different}


def entry_of(table: bytes, number: int | None) -> str:
    """The name of an entry of BASE_DATA or TOOL_DATA; table: ``BASE`` or ``TOOL``."""
    return f"{table.decode()}_DATA[{number}]"


def with_declared(
    declared: Mapping[str, tuple[Numbers, str]], table: bytes, used: Ints, frames: tuple[FrameRef, ...]
) -> tuple[Ints, tuple[FrameRef, ...]]:
    """(N,) the indices ``used`` (N,) of the bases or tools of motions, and the frames with what ``declared`` states of
    those without a pose."""
    more = list(frames)
    renamed = np.append(np.arange(len(frames)), -1)
    for index in np.unique(used[used >= 0]).tolist():
        frame = frames[index]
        entry = entry_of(table, frame.entry)
        if frame.pose is None and entry in declared:
            values, _ = declared[entry]
            pose = Poses.from_abc(np.array(values[:3]) * MM, np.array(values[3:]) * DEG)
            renamed[index] = len(more)
            more.append(replace(frame, declared=pose))
    return renamed[used], tuple(more)


def start_with(run: ExecutionContext, initial: InitialState, symbols: Mapping[str, Symbol]) -> None:
    """Sets what holds where the program starts; of FDAT_ACT a file says only what an earlier run left."""
    state = run.initial
    if initial.base is not None:
        state.base = run.numbered_frame(b"BASE", initial.base, 0)
    if initial.tool is not None:
        state.tool = run.numbered_frame(b"TOOL", initial.tool, 0)
    if initial.words:
        state.point = six([initial.words.get(key.decode(), NAN) for key in COMPONENTS])
        state.point_frames = (state.base, state.tool)
        state.point_unknown = "program_start of the cell does not state it"
    if "FDAT_ACT" in map(str.upper, symbols):
        state.frames_record = run.declarations.records.get(b"FDAT_ACT")
