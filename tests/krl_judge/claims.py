"""What the reader says of each motion of a program; the only place that knows it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from postproc.base.document import Document
from postproc.base.geometry import Poses
from postproc.base.units import DEG, MM
from postproc.languages import DIALECTS
from postproc.languages.dialect import ReadingSettings
from postproc.toolpath import FrameRef, Kind, Toolpath

from .motions import Six
from .values import FRAME, matrix

Tables = dict[str, dict[int, Six]]
_ENTRY = re.compile(r"\b(BASE_DATA|TOOL_DATA)\s*\[\s*(\d+)", re.I)
NEVER_RUNS = "KRL023"
_ROUTINE = re.compile(r"^[ \t]*(?:GLOBAL[ \t]+)?DEF(?:FCT[ \t]+\w+)?[ \t]+(\w+)", re.I | re.M)


@dataclass(frozen=True)
class Claim:
    """One row of a toolpath, in mm and deg.

    claimed: its target is said to be known and can be corrected.  never: it is said not to run; apart: it is not said
    after which motion it runs, if it does.  position (3,),
    rotation (3, 3) or None; partial: X .. C of a target whose NaN components are what the axis angles ``origin`` give;
    base, tool: (4, 4), None where not known.  force: of the last FORCE comment before it, "" for none and for OFF.
    """

    line: int
    kind: str
    claimed: bool
    never: bool
    apart: bool
    position: np.ndarray
    rotation: np.ndarray
    partial: np.ndarray | None
    origin: np.ndarray | None
    axes: np.ndarray | None
    base: np.ndarray | None
    tool: np.ndarray | None
    feed: float
    approximation: float
    orientation: str
    arc: tuple[np.ndarray, np.ndarray, float] | None
    force: str


def read_claims(src: str, dat: str, config: str, tables: Tables) -> list[Claim]:
    documents = [Document(Path("part.src"), src.encode("latin-1"))]
    if dat:
        documents.append(Document(Path("part.dat"), dat.encode("latin-1")))
    references = (Document(Path("$config.dat"), config.encode("latin-1")),) if config else ()
    program = DIALECTS["krl"].read(tuple(documents), ReadingSettings(references=references))
    tables = _without_stated(tables, config)
    return _claims(program.toolpath, tables)


def read_split_claims(src: str, dat: str, config: str, tables: Tables) -> list[Claim]:
    """The claims of the first routine alone: each other one is a module of its own, and the .dat belongs to all."""
    main, modules = split(src)
    data = "".join(f"{text}\n" for text in (config, dat) if text)
    others = [("$config.dat", data), *((f"{name}.src", text) for name, text in modules.items())]
    siblings = tuple(Document(Path(name), text.encode("latin-1")) for name, text in others)
    document = Document(Path("part.src"), main.encode("latin-1"))
    program = DIALECTS["krl"].read((document,), ReadingSettings(siblings=siblings))
    tables = _without_stated(tables, config)
    return _claims(program.toolpath, tables)


def _without_stated(tables: Tables, config: str) -> Tables:
    """The tables of the cell: not what the controller's own file says of an entry, or says so that it is not known."""
    stated = {(name.upper(), int(n)) for name, n in _ENTRY.findall(config)}
    return {name: {n: of[n] for n in of if (name, n) not in stated} for name, of in tables.items()}


def split(src: str) -> tuple[str, dict[str, str]]:
    """The first routine of a program, and the others by their names."""
    starts = [found.start() for found in _ROUTINE.finditer(src)] + [len(src)]
    texts = [src[start:stop] for start, stop in pairwise(starts[1:])]
    names = [_ROUTINE.match(text)[1].lower() for text in texts]  # type: ignore[index]
    return src[: (*starts, len(src))[1]], dict(zip(names, texts, strict=True))


def _claims(path: Toolpath, tables: Tables) -> list[Claim]:
    forces = [""] * len(path)
    for comment in path.annotations:
        word, *words = comment.text.split()
        if word.upper() == "FORCE":
            said = " ".join(words)
            said = "" if said.upper() == "OFF" else said
            forces[comment.row :] = [said] * len(forces[comment.row :])
    return [_claim(path, row, tables, force) for row, force in enumerate(forces)]


def _claim(path: Toolpath, row: int, tables: Tables, force: str) -> Claim:
    refused = path.constraints.refused.get(row)
    from_row = int(path.partial_targets.inherits_from_row[row])
    on_axes = bool(path.on_axes[row])
    said = bool(path.known[row]) or on_axes or from_row >= 0
    return Claim(
        line=int(path.line[row]),
        kind=Kind(path.kind[row]).name,
        claimed=said and refused is None,
        never=refused is not None and refused.code == NEVER_RUNS,
        apart=not bool(path.continues[row]),
        position=path.position[row] / MM,
        rotation=path.programmed_rotation[row],
        partial=path.partial_targets.coordinates[row] / ([MM] * 3 + [DEG] * 3) if from_row >= 0 else None,
        origin=np.asarray(path.axes[from_row]) / DEG if from_row >= 0 else None,
        axes=np.asarray(path.axes[row]) / DEG if on_axes else None,
        base=_frame(path.frames, int(path.base[row]), tables["BASE_DATA"]),
        tool=_frame(path.frames, int(path.tool[row]), tables["TOOL_DATA"]),
        feed=float(path.feed[row]),
        approximation=float(path.approximation[row]) / MM,
        orientation=("#VAR", "#CONSTANT", "#JOINT", "")[path.orientation_control.mode[row]],
        arc=(path.arcs.centre[row] / MM, path.arcs.normal[row], float(path.arcs.sweep[row]) / DEG)
        if np.isfinite(path.arcs.sweep[row])
        else None,
        force=force,
    )


def _frame(frames: tuple[FrameRef, ...], index: int, table: dict[int, Six]) -> np.ndarray | None:
    if index < 0:
        return None
    frame = frames[index]
    if frame.pose is None:
        if frame.declared is None:
            stated = table.get(frame.entry)
            entry = None if stated is None else matrix(dict(zip(FRAME, stated, strict=True)))
        else:
            entry = _homogeneous(frame.declared)
        found = entry if entry is None or frame.in_entry is None else entry @ _homogeneous(frame.in_entry[1])
        if found is not None:
            for axis, value in enumerate(frame.components):
                if value is not None:
                    found[axis, 3] = value / MM
        return found
    return _homogeneous(frame.pose)


def _homogeneous(pose: Poses) -> np.ndarray:
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = pose.rotation, pose.position / MM
    return out
