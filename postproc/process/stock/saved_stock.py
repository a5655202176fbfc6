"""Stock files: what a program left of its blank, for the next program.

A stock file is a NumPy archive of the blank and of all sweeps that removed something: nothing is lost, and its
size goes with the number of motions, not with a grid.
"""

from __future__ import annotations

import io
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.findings import Finding, Refusal
from postproc.base.read_files import read_file
from postproc.process.stock.blank import MESH, Blank, mesh_blank
from postproc.process.stock.distance import CUTTER, REMOVES, ROW
from postproc.process.stock.stock_place import NO_NUMBER
from postproc.process.stock.stock_section import StockProcess

VERSION = 1
_KEYS = ("version", "frame", "corners", "rows", "cutters")
_BASE = "base"


@dataclass(frozen=True, eq=False)
class Removed:
    """What earlier programs removed: rows (M, ROW) and cutters (T, 6), see ``distance``; base: number of that in whose
    axes they are, or ``NO_NUMBER``."""

    rows: Floats
    cutters: Floats
    base: int = NO_NUMBER


def stock_bytes(blank: Blank, rows: Floats, cutters: Floats, base: int) -> bytes:
    """A stock file of a blank and the sweeps (M, ROW) of ``cutters`` (T, 6) that were in it, in the axes of the base of
    that number, or of ``NO_NUMBER``."""
    buffer = io.BytesIO()
    kept = rows[rows[:, REMOVES] > 0]
    values = (np.array([VERSION]), blank.frame, blank.corners, kept, cutters)
    arrays: dict[str, Any] = dict(zip(_KEYS, values, strict=True)) | {_BASE: np.array([base])}
    np.savez_compressed(buffer, **arrays)
    return buffer.getvalue()


def read_stock(path: Path, process: StockProcess) -> tuple[Blank, Removed]:
    """The blank and what was removed of it.  Refusal FIL001; STK016: no stock file, or one of another version."""
    raw = read_file(path)
    try:
        with np.load(io.BytesIO(raw)) as archive:
            values = [np.asarray(archive[key], float) for key in _KEYS]
            base = int(archive[_BASE].item()) if _BASE in archive else NO_NUMBER
    except (ValueError, KeyError, OSError, zipfile.BadZipFile, EOFError):
        raise _refused(path, "it is no stock file", process) from None
    version, frame, corners, rows, cutters = values
    if version.tolist() != [VERSION]:
        raise _refused(path, "it is of another version", process)
    shapes = frame.shape == (14,) and corners.ndim == 2 and corners.shape[1] == 9
    shapes = (
        shapes and rows.ndim == 2 and rows.shape[1] == ROW and cutters.ndim == 2 and cutters.shape[1] == 6
    )
    if not shapes or not all(np.isfinite(value).all() for value in values):
        raise _refused(path, "its content is damaged", process)
    if len(rows) and not (rows[:, CUTTER].min() >= 0 and rows[:, CUTTER].max() < len(cutters)):
        raise _refused(path, "its content is damaged", process)
    blank = Blank(frame, corners, np.zeros(1, np.int64))
    if frame[0] == MESH:
        blank = mesh_blank(corners.reshape(-1, 3, 3))
    return blank, Removed(rows, cutters, base)


def _refused(path: Path, message: str, process: StockProcess) -> Refusal:
    return Refusal(Finding("STK016", f"{path.name}: {message}", str(process.path), process.line))
